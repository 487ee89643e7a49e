import { execFileSync, spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, start } from "./browser.ts";
import { instant } from "./desk.ts";

const command = process.env.BF_COMMAND, motor = join(process.env.BF_SOURCE ?? "", "docs/start/motor.yaml");
const has_robots = command !== undefined && existsSync(join(dirname(command), "../lib/blockfactory/WholeBodyToolbox.so"));
/** A block of a plugin, and a state machine that moves on after 1 s. */
const with_plugin = `model: m
plugins: [WholeBodyToolbox]
step: 0.1
stop: 3
blocks:
  machine: {block: StateMachine, states: [idle, move], transitions: "[1 2 0 1]"}
  filter: {block: WholeBodyToolbox/DiscreteFilter, numerator: "[0 1]", denominator: "[1 0]"}
  double: {block: Gain, K: 2}
connections: {machine.state: filter, filter: double}
record: [machine.state, filter]
plots: {Filtered: [filter]}
layout: {displays: {Rest: {signals: [double]}}}
`;
const is_built = process.env.BF_PAGE !== undefined && existsSync(join(process.env.BF_PAGE, "../published/engine.js"));

describe.skipIf(!is_there || !is_built)("a published page", () => {
  let browser: Browser, folder: string;

  beforeAll(async () => {
    browser = await start();
    folder = await mkdtemp(join(tmpdir(), "bf-published-"));
    const [same, soft] = [join(folder, "same.mcap"), join(folder, "soft.mcap")];
    execFileSync(command!, ["run", motor, "--record", same, "--quiet"]);
    execFileSync(command!, ["run", motor, "--set", "Gain.Ki=0.3", "--record", soft, "--quiet"]);
    execFileSync(command!, ["publish", motor, "-o", join(folder, "motor"), "--recording", same, "--recording", soft]);
  });
  afterAll(async () => {
    await browser.close();
    await rm(folder, { recursive: true });
  });

  /** A page without any network but its own folder, and all that it complains of. */
  async function opened(address: string): Promise<{ page: Page; complaints: string[] }> {
    const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, offline: address.startsWith("file:") });
    const page = await context.newPage(), complaints: string[] = [];
    page.setDefaultTimeout(20_000);
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
    page.on("request", (request) => {
      if (!request.url().startsWith(new URL(".", address).href) && !request.url().startsWith("blob:")) complaints.push(`asks ${request.url()}`);
    });
    await page.goto(address);
    await page.getByRole("status").filter({ hasText: "in this page alone" }).waitFor();
    return { page, complaints };
  }
  const from_files = () => opened(pathToFileURL(join(folder, "motor/index.html")).href);
  async function run(page: Page): Promise<void> {
    await page.getByLabel("Speed", { exact: true }).selectOption("");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await expect.poll(() => instant(page), { timeout: 8000 }).toBe(1.2);
  }
  /** What the legend of the first plot says at the end, of the run or of a recording. */
  async function speed(page: Page, of = ""): Promise<number> {
    const row = page.getByRole("list", { name: "Values of Speed [rad/s]" }).locator(`li[title="${of}motor.omega"]`);
    return Number(await row.locator(".number").innerText());
  }

  test("runs from the file system, without a network, and gives what bf run gives", async () => {
    const { page, complaints } = await from_files();
    await run(page);
    await page.getByLabel("Time", { exact: true }).fill("1190"); // s/1000; a recording ends a step before the run
    await expect.poll(() => speed(page, "soft: ")).toBeGreaterThan(1);
    await expect.poll(() => speed(page)).toBe(await speed(page, "same: "));
    expect(Math.abs((await speed(page)) - (await speed(page, "soft: ")))).toBeGreaterThan(1);
    expect(complaints).toEqual([]);
    await page.context().close();
  });

  test("draws the images of the model, and runs no script in them", async () => {
    const script = `<script>parent.document.title = "hacked"; fetch("https://example.org/")</script>`;
    await writeFile(join(folder, "red.svg"), `<svg xmlns="http://www.w3.org/2000/svg" width="400" height="300">${script}<rect width="400" height="300" fill="#c00"/></svg>`);
    await writeFile(join(folder, "pictured.yaml"), "model: m\nstep: 1\nblocks: {}\nlayout: {notes: {n: {image: red.svg, x: 0, y: 0, width: 400, height: 300}}}\n");
    execFileSync(command!, ["publish", join(folder, "pictured.yaml"), "-o", join(folder, "pictured")]);
    const { page, complaints } = await opened(pathToFileURL(join(folder, "pictured/index.html")).href);
    await expect.poll(() => page.locator("canvas").first().evaluate((canvas: HTMLCanvasElement) =>
      [...canvas.getContext("2d")!.getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data.slice(0, 3)])).toEqual([204, 0, 0]);
    expect(await page.title()).not.toBe("hacked");
    expect(complaints).toEqual([]);
    await page.context().close();
  });

  test.skipIf(!has_robots)("shows a model with plugins by what was recorded of it", async () => {
    const file = join(folder, "plugged.yaml"), recording = join(folder, "plugged.mcap");
    await writeFile(file, with_plugin);
    execFileSync(command!, ["run", file, "--set", "double.K=3", "--record", recording, "--quiet"]);
    execFileSync(command!, ["publish", file, "-o", join(folder, "plugged"), "--recording", recording]);
    const { page, complaints } = await opened(pathToFileURL(join(folder, "plugged/index.html")).href);
    await page.getByText("No mistakes").waitFor();
    const run = page.getByRole("button", { name: "Run", exact: true });
    const why = "blocks of plugins do not run in a browser; what was recorded can be looked at, of a run with double.K = 3";
    expect(await run.isDisabled()).toBe(true);
    expect(await run.getAttribute("title")).toBe(why);
    expect(await page.locator("#recorded").getAttribute("title")).toBe(why);
    await page.keyboard.press("p"); // does nothing
    // What was not recorded is said so, and what was goes with the time.
    await page.getByText("double was not recorded").waitFor();
    const value = () => page.getByRole("list", { name: /^Values of Filtered/ }).locator('li[title="filter"] .number').innerText();
    await expect.poll(value).toBe("2");
    const slider = page.getByLabel("Time", { exact: true });
    await slider.fill("9"); // s/10
    await expect.poll(value).toBe("1");
    // The state machine is lit as it was.
    const element = (name: RegExp) => page.getByRole("option", { name });
    await element(/^chart machine|^block machine/).waitFor();
    await page.getByRole("listbox", { name: /^Elements of/ }).focus();
    for (let i = 0; i < 10 && (await element(/^(chart|block) machine/).getAttribute("aria-selected")) !== "true"; ++i) await page.keyboard.press(".");
    await page.keyboard.press("Enter");
    await element(/^state idle, first state, active/).waitFor();
    await slider.fill("20");
    await element(/^state move, state, active/).waitFor();
    // Edits are checked by what the plugin declares.
    await page.keyboard.press("Escape");
    await page.keyboard.press("Control+z");
    expect(await page.getByRole("alert").allInnerTexts()).toEqual([]);
    expect(complaints).toEqual([]);
    expect(await found_by_axe(page)).toEqual([]);
    await page.context().close();
  });

  test("is tuned by a slider, which changes the outcome", async () => {
    const { page, complaints } = await from_files();
    await run(page);
    await expect.poll(() => speed(page)).toBeGreaterThan(150);
    await page.getByRole("button", { name: "Back to the beginning" }).click();
    await page.getByLabel("supply of the run", { exact: true }).fill("7.2"); // V, too few for the speed under load
    await run(page);
    await expect.poll(() => speed(page)).toBeLessThan(150);
    expect(complaints).toEqual([]);
    await page.context().close();
  });

  test("keeps edits in the page, and gives the edited model for download", async () => {
    const { page, complaints } = await from_files();
    await page.locator("#variable-supply").fill("30");
    await page.keyboard.press("Enter");
    await page.getByRole("button", { name: "Undo" }).and(page.locator(":enabled")).waitFor();
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Download" }).click()]);
    expect(download.suggestedFilename()).toBe("motor.yaml");
    const text = await readFile(motor, "utf8");
    expect(await readFile(await download.path(), "utf8")).toBe(text.replace("supply: 24 ", "supply: 30 "));
    await page.reload();
    await page.locator("#variable-supply").waitFor();
    expect(await page.locator("#variable-supply").inputValue()).toBe("24");
    expect(complaints).toEqual([]);
    expect(await found_by_axe(page)).toEqual([]); // which asks for files itself
    await page.context().close();
  });

  test("runs from any web server, under the policy of the page itself", async () => {
    const server = spawn("python3", ["-u", "-m", "http.server", "0", "--bind", "127.0.0.1", "--directory", join(folder, "motor")]);
    try {
      const port = await new Promise<string>((resolve) => server.stdout.on("data", (data) => {
        const found = /port (\d+)/.exec(String(data));
        if (found) resolve(found[1]!);
      }));
      const { page, complaints } = await opened(`http://127.0.0.1:${port}/`);
      await run(page);
      await expect(page.evaluate(() => fetch("https://example.org/"))).rejects.toThrow();
      expect(complaints.filter((text) => !text.includes("example.org"))).toEqual([]);
      await page.context().close();
    } finally {
      server.kill();
    }
  });
});
