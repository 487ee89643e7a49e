import { execFileSync, spawn, type ChildProcess } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, start } from "./browser.ts";
import { instant } from "./desk.ts";

const command = process.env.BF_COMMAND, source = process.env.BF_SOURCE ?? "";
const examples = [
  "docs/start/motor", ...["bouncing_ball", "buck_converter", "cart_pole", "dc_motor", "double_pendulum", "stick_slip", "thermostat", "two_rates"].map((name) => `examples/${name}/model`)];
const is_built = process.env.BF_PAGE !== undefined && existsSync(join(process.env.BF_PAGE, "../published/engine.js"));

describe.skipIf(!is_there || !is_built)("the site of the documentation", () => {
  let browser: Browser, folder: string, server: ChildProcess, from_server: string, from_files: string;

  beforeAll(async () => {
    browser = await start();
    folder = await mkdtemp(join(tmpdir(), "bf-site-"));
    const site = join(folder, "site");
    execFileSync(process.execPath, [join(source, "docs/site/site.mjs"), source, ".", site, command!]);
    server = spawn("python3", ["-u", "-m", "http.server", "0", "--bind", "127.0.0.1", "--directory", site]);
    const port = await new Promise<string>((resolve) => server.stdout!.on("data", (data) => {
      const found = /port (\d+)/.exec(String(data));
      if (found) resolve(found[1]!);
    }));
    from_server = `http://127.0.0.1:${port}/`;
    from_files = `${pathToFileURL(site).href}/`;
  }, 120_000);
  afterAll(async () => {
    server.kill();
    await browser.close();
    await rm(folder, { recursive: true });
  });

  /** A page, and all that it complains of; it may ask for files of the site alone. */
  async function opened(site: string): Promise<{ page: Page; complaints: string[] }> {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, offline: site === from_files });
    const page = await context.newPage(), complaints: string[] = [];
    page.setDefaultTimeout(20_000);
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("console", (message) => { if (message.type() === "error") complaints.push(`${page.url()}: ${message.text()}`); });
    page.on("request", (request) => {
      if (!request.url().startsWith(site) && !request.url().startsWith("blob:")) complaints.push(`asks ${request.url()}`);
    });
    page.on("response", (response) => { if (response.status() >= 400) complaints.push(`${response.url()}: ${response.status()}`); });
    page.on("requestfailed", (request) => complaints.push(`${request.url()} fails`));
    return { page, complaints };
  }

  test.each(["a web server", "the file system"])("every link leads to a page of it, and every image is there, from %s", async (where) => {
    const site = where === "a web server" ? from_server : from_files;
    const { page, complaints } = await opened(site);
    const pages = [`${site}index.html`], anchors = new Map<string, Set<string>>(), models = new Set<string>();
    const wanted: { from: string; to: string; anchor: string }[] = [];
    for (const address of pages) { // which grows
      await page.goto(address, { waitUntil: "load" });
      anchors.set(address, new Set(await page.locator("[id]").evaluateAll((all) => all.map((element) => element.id))));
      expect(await page.locator("img").evaluateAll((all) => (all as HTMLImageElement[]).filter((image) => image.naturalWidth === 0).map((image) => image.src))).toEqual([]);
      for (const link of await page.locator("a").evaluateAll((all) => (all as HTMLAnchorElement[]).map((a) => a.href))) {
        if (!link.startsWith(site)) {
          expect(link).toMatch(/^https:/);
          continue;
        }
        const [to = "", anchor = ""] = link.split("#");
        if (to.includes("/models/") && !to.endsWith("/models/index.html")) models.add(to);
        else if (!pages.includes(to)) pages.push(to);
        if (anchor) wanted.push({ from: address, to, anchor: decodeURIComponent(anchor) });
      }
    }
    expect(pages.length).toBeGreaterThan(80);
    expect(wanted.filter(({ to, anchor }) => !anchors.get(to)!.has(anchor))).toEqual([]);
    expect([...models].sort()).toEqual(examples.map((name) => `${site}models/${name}/index.html`).sort());
    expect(complaints).toEqual([]);
    await page.context().close();
  }, 120_000);

  /** The values that the legends of all panels show: of the run, and of what bf run recorded. */
  async function values(page: Page): Promise<{ run: Map<string, number>; recorded: Map<string, number> }> {
    const rows = await page.locator("li[title]:has(.number)").evaluateAll((all) => all.map((row) => [(row as HTMLElement).title, row.querySelector(".number")!.textContent!] as const));
    const numbers = rows.map(([title, text]) => [title, Number(text.replaceAll("−", "-"))] as const), prefix = "bf_run: ";
    return {
      run: new Map(numbers.filter(([title]) => !title.startsWith(prefix))),
      recorded: new Map(numbers.filter(([title]) => title.startsWith(prefix)).map(([title, value]) => [title.slice(prefix.length), value])),
    };
  }

  test.each(examples)("%s is reached from the page that tells of it, runs there, and gives what bf run gives", async (name) => {
    const { page, complaints } = await opened(from_files);
    await page.goto(`${from_files}${name === "docs/start/motor" ? "docs/start/first_model" : name.replace("model", "index")}.html`);
    await page.getByRole("link", { name: "Run it here" }).click();
    await page.getByText("No mistakes").waitFor();
    expect(page.url()).toBe(`${from_files}models/${name}/index.html`);
    await page.getByLabel("Speed", { exact: true }).selectOption("");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    const slider = page.getByLabel("Time", { exact: true }), last = await slider.getAttribute("max");
    await expect.poll(() => slider.inputValue(), { timeout: 20_000 }).toBe(last);
    for (const part of [0.98, 0.5, 0.2]) { // a recording ends a step before the run
      const before = await instant(page);
      await slider.fill(String(Math.floor(part * Number(last))));
      await expect.poll(() => instant(page)).not.toBe(before);
      await expect.poll(async () => {
        const { run, recorded } = await values(page);
        return run.size > 0 && run.size === recorded.size && [...run].every(([path, value]) => {
          const other = recorded.get(path)!; // the last digits that are shown may differ, see docs/how-to/publish_a_model.md
          return Math.abs(value - other) <= 1e-3 * Math.abs(other) + 1e-6;
        });
      }).toBe(true);
    }
    expect(await page.getByRole("alert").allInnerTexts()).toEqual([]);
    expect(complaints).toEqual([]);
    await page.context().close();
  });

  test("is readable for those who hear it, in both colours", async () => {
    for (const colorScheme of ["light", "dark"] as const)
      for (const place of ["examples/dc_motor/index.html", "docs/start/motor.yaml.html", "models/index.html"]) {
        const { page } = await opened(from_files);
        await page.emulateMedia({ colorScheme });
        await page.goto(from_files + place);
        expect(await found_by_axe(page)).toEqual([]);
        await page.context().close();
      }
  });
});
