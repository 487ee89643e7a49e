import { execFileSync, spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, start } from "./browser.ts";
import { instant } from "./desk.ts";

const command = process.env.BF_COMMAND, motor = join(process.env.BF_SOURCE ?? "", "docs/start/motor.yaml");
const examples = ["bouncing_ball", "buck_converter", "cart_pole", "dc_motor", "double_pendulum", "stick_slip", "thermostat", "two_rates"];
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
    await expect.poll(() => speed(page, "soft: ")).toBeGreaterThan(1);
    await expect.poll(() => speed(page)).toBe(await speed(page, "same: "));
    expect(Math.abs((await speed(page)) - (await speed(page, "soft: ")))).toBeGreaterThan(1);
    expect(complaints).toEqual([]);
    await page.context().close();
  });

  test.each(examples)("runs the example %s to its end, and goes back in it", async (name) => {
    execFileSync(command!, ["publish", join(motor, "../../../examples", name, "model.yaml"), "-o", join(folder, name)]);
    const { page, complaints } = await opened(pathToFileURL(join(folder, name, "index.html")).href);
    await page.getByText("No mistakes").waitFor();
    await page.getByLabel("Speed", { exact: true }).selectOption("");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    const slider = page.getByLabel("Time", { exact: true }), last = await slider.getAttribute("max");
    await expect.poll(() => slider.inputValue(), { timeout: 20_000 }).toBe(last);
    const end = await instant(page);
    await slider.fill(String(Math.floor(Number(last) / 2)));
    await expect.poll(() => instant(page)).toBeCloseTo((end / Number(last)) * Math.floor(Number(last) / 2));
    expect(await page.getByRole("alert").allInnerTexts()).toEqual([]);
    expect(complaints).toEqual([]);
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
