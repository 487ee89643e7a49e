import { spawn, type ChildProcess } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, opened, start } from "./browser.ts";

const command = process.env.BF_COMMAND;
const model = `model: served
step: 0.001
variables:
  k: {value: 0.3, maximum: 5}
blocks:
  sine: {block: Sine, frequency: 7}
  control: {block: Gain, K: k}
connections: {sine: control}
`;

describe.skipIf(!is_there || command === undefined)("the cockpit", () => {
  let browser: Browser, page: Page, complaints: string[], folder: string, processes: ChildProcess[];

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    processes = [];
    folder = await mkdtemp(join(tmpdir(), "bf-cockpit-"));
    await writeFile(join(folder, "served.yaml"), model);
  });
  afterEach(async () => {
    await page.close();
    for (const one of processes) one.kill("SIGINT");
    await rm(folder, { recursive: true });
    expect(complaints).toEqual([]);
  });

  /** A process, and the first address that it prints. */
  function run(...options: string[]): Promise<{ one: ChildProcess; address: string }> {
    const one = spawn(command!, options, { cwd: folder });
    processes.push(one);
    return new Promise((resolve) => {
      for (const stream of [one.stdout!, one.stderr!]) stream.on("data", (data) => {
        const found = /(http|ws):\S+/.exec(String(data));
        if (found) resolve({ one, address: found[0] });
      });
    });
  }
  async function open(...options: string[]): Promise<ChildProcess> {
    const program = await run("run", "served.yaml", "--realtime", "--priority", "0", "--stop", "Inf", "--quiet", "--serve", "0", ...options);
    const editor = await run("edit", "--no-browser", "--attach", program.address, "served.yaml");
    ({ page, complaints } = await opened(browser, editor.address));
    await page.getByRole("region", { name: "Cockpit" }).waitFor();
    return program.one;
  }
  const ended = (one: ChildProcess) => new Promise<number | null>((resolve) => one.exitCode !== null ? resolve(one.exitCode) : one.on("exit", resolve));
  const button = (name: string) => page.getByRole("button", { name, exact: true });
  const log = () => page.getByRole("list", { name: "Log" });

  test("starts a program that waits, shows how it keeps its period, tunes it and stops it", async () => {
    const program = await open("--control", "--wait");
    await page.getByText("waiting, 0 steps of 1 ms").waitFor();
    await button("Start").click();
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await expect.poll(() => button("Start").isDisabled()).toBe(true);
    await expect.poll(() => page.getByRole("img", { name: /^Deviation of the period: .*µs: \d+/ }).count()).toBe(1);
    const bars = page.getByRole("img", { name: /^From release to the end of a step: .*µs: \d+/ }).locator("rect");
    await expect.poll(() => bars.count()).toBeGreaterThan(0);
    await page.getByText(/\d+ deadlines? missed/).first().waitFor();
    const ticks = await page.locator("figure", { hasText: "Deviation of the period" }).locator(".axis span").allInnerTexts();
    expect(ticks).toContain("0");
    for (const tick of ticks) expect(tick).toMatch(/^0$|^−?\d+ (µs|ms|s)$/);
    await page.getByLabel("k of the run, as a number").fill("2");
    await page.getByLabel("k of the run, as a number").press("Tab");
    await log().getByText("k = 2, was 0.3").waitFor();
    await page.getByText("This is page 1.").waitFor();
    expect(await log().textContent()).toMatch(/k = 2, was 0\.3\s*this page/);
    expect(await log().getByText("this page").first().getAttribute("title")).toMatch(/^page 1 of \S+@\S* \(\d+\) at 127\.0\.0\.1:\d+$/);
    expect(await found_by_axe(page)).toEqual([]);
    if (process.env.BF_PICTURES) await page.screenshot({ path: join(process.env.BF_PICTURES, "cockpit.png") });
    await button("Stop").click();
    expect(await ended(program)).toBe(0);
    const end = page.getByRole("status").filter({ hasText: /^the program ended in order, stopped by page 1 of / });
    await end.waitFor();
    await page.getByRole("group", { name: "Live" }).getByText("ended").waitFor();
    await page.getByText(/ended, \d+ steps of 1 ms/).waitFor();
    await log().getByText("stop", { exact: true }).waitFor();
    expect(await page.getByRole("alert").count()).toBe(0);
    for (const name of ["k of the run", "k of the run, as a number"]) {
      expect(await page.getByLabel(name, { exact: true }).isDisabled()).toBe(true);
      expect(await page.getByLabel(name, { exact: true }).getAttribute("title")).toMatch(/^the program ended in order/);
    }
    for (const name of ["Start", "Stop", "Emergency stop"]) expect(await button(name).isDisabled()).toBe(true);
    expect(await found_by_axe(page)).toEqual([]);
    if (process.env.BF_PICTURES) await page.screenshot({ path: join(process.env.BF_PICTURES, "cockpit_ended.png") });
  });

  test("says who did what: this page, or another one by its number", async () => {
    await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    const other = await browser.newPage();
    await other.goto(page.url());
    await other.getByText("This is page 2.").waitFor();
    await other.getByLabel("k of the run, as a number").fill("4");
    await other.getByLabel("k of the run, as a number").press("Tab");
    await expect.poll(() => log().textContent()).toMatch(/k = 4, was 0\.3\s*page 2 of /);
    await expect.poll(() => other.getByRole("list", { name: "Log" }).textContent()).toMatch(/k = 4, was 0\.3\s*this page/);
    await other.close();
  });

  test("lets an edit go on in a program that was started so", async () => {
    await open("--control", "--editable");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await writeFile(join(folder, "served.yaml"), model.replace("K: k", "K: 2*k").replace("connections:", "  sum: {block: DiscreteIntegrator}\nconnections:").replace("sine: control", "sine: [control, sum]"));
    await expect.poll(() => log().textContent()).toMatch(/edit: /);
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    expect(await page.getByRole("alert").count()).toBe(0);
    await writeFile(join(folder, "served.yaml"), model);
    const question = page.getByRole("alert").filter({ hasText: "'sum.x' is no longer there" });
    await question.waitFor();
    if (process.env.BF_PICTURES) await page.screenshot({ path: join(process.env.BF_PICTURES, "cockpit_edit.png") });
    await question.getByRole("button", { name: "Go on with the edit" }).click();
    await question.waitFor({ state: "detached" });
    await expect.poll(() => log().getByText("edit: ").count()).toBe(2);
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("says of a program that was not started so that edits change the file alone", async () => {
    await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await writeFile(join(folder, "served.yaml"), model.replace("K: k", "K: 2*k"));
    await page.getByRole("alert").filter({ hasText: "without --editable" }).waitFor();
    expect(await page.getByRole("button", { name: "Start anew" }).count()).toBe(0);
  });

  test("says that a program that was killed is gone, and why nothing can be set", async () => {
    const program = await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    program.kill("SIGKILL");
    await page.getByRole("alert").filter({ hasText: "the program" }).waitFor();
    await page.getByText(/not connected, \d+ steps of 1 ms/).waitFor();
    expect(await page.getByLabel("k of the run", { exact: true }).isDisabled()).toBe(true);
  });

  test("stops at once by a key", async () => {
    const program = await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await page.keyboard.press("Shift+Escape");
    expect(await ended(program)).toBe(1);
    await log().getByText("emergency stop", { exact: true }).waitFor();
    await page.getByRole("status").filter({ hasText: /^the program was stopped by emergency stop of page 1 of / }).waitFor();
    expect(await page.getByRole("alert").count()).toBe(0);
  });

  test.each([["the text", "y", "Text of the model"], ["a search", "Control+k", "Insert a block, or do something"], ["the keys", "?", ""], ["models", "Control+o", ""]])(
    "stops at once by a key, while %s is open", async (_, opening, field) => {
      const program = await open("--control");
      await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
      await page.keyboard.press(opening);
      await (field ? page.getByLabel(field).first().focus() : page.getByRole("dialog").waitFor());
      await page.keyboard.press("Shift+Escape");
      expect(await ended(program)).toBe(1);
    });
  test("stops at once by a button of each dialog", async () => {
    const program = await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await page.keyboard.press("Control+o");
    await page.getByRole("dialog").getByRole("button", { name: "Emergency stop" }).click();
    expect(await ended(program)).toBe(1);
  });

  test("is stopped by no key that is typed into a dialog, each of which gives the keyboard to its own field", async () => {
    await writeFile(join(folder, "dot.svg"), '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>');
    const program = await open("--control");
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    const dialog = page.locator("dialog");
    const focused = () => page.evaluate(() => {
      const on = document.activeElement!;
      return !on.closest("dialog") ? "outside" : on.getAttribute("aria-label") ?? on.textContent!.trim();
    });
    const to = async (...keys: string[]) => { for (const key of keys) await page.keyboard.press(key); };
    const by_search = async (text: string) => {
      await to("Control+k");
      await page.keyboard.type(text);
      await to("Enter");
    };
    const dialogs: [string, () => Promise<unknown>, string][] = [
      ["a search", () => to("Control+k"), "Insert a block, or do something"],
      ["connections", () => to("c"), "Connect"],
      ["what is found", () => to("Control+f"), "Find names, types and settings in the whole model"],
      ["models", () => to("Control+o"), "Open a model"],
      ["the keys", () => to("?"), "Close"],
      ["earlier versions", () => to("Shift+D"), "Compare with"],
      ["a comparison", async () => {
        await writeFile(join(folder, "other.yaml"), model);
        await to("Shift+D");
        await dialog.getByRole("option", { name: "other.yaml" }).click();
        await dialog.getByText("Both say the same.").waitFor();
      }, "Show all of the model"],
      ["images", async () => { await by_search("Image"); await dialog.getByRole("option", { name: "dot.svg" }).waitFor(); }, "Insert an image of the folder"],
      ["recordings", async () => {
        if (await page.getByRole("button", { name: "Compare with …" }).count() === 0) await page.getByRole("button", { name: "Signals" }).click();
        await page.getByRole("button", { name: "Compare with …" }).click();
      }, "Compare with a recording"],
    ];
    for (const [name, come, field] of dialogs) {
      await come();
      await dialog.waitFor();
      await expect.poll(focused, { message: name }).toBe(field);
      const emergency = dialog.getByRole("button", { name: "Emergency stop" });
      const box = (await emergency.boundingBox())!;
      await page.mouse.move(box.x + 5, box.y + 5); // pressed, and let go elsewhere
      await page.mouse.down();
      await page.mouse.move(10, 790);
      await page.mouse.up();
      expect(await focused(), name).toBe(field);
      if (field !== "Close") await page.keyboard.type("no such thing");
      for (let i = 0; i < 12; ++i) {
        await to("Tab");
        expect(await focused(), name).not.toBe("Emergency stop");
      }
      await to("Escape");
      await dialog.waitFor({ state: "detached" });
    }
    await by_search("gain");
    await dialog.waitFor({ state: "detached" });
    await page.keyboard.press("Space");
    await expect.poll(() => readFile(join(folder, "served.yaml"), "utf8"), { timeout: 8000 }).toContain("block: Gain}");
    await page.getByRole("group", { name: "Live" }).getByText("live", { exact: true }).waitFor();
    expect(program.exitCode).toBe(null);
  }, 120_000);

  test("says why a program that is looked at alone cannot be controlled", async () => {
    await open();
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
    await page.getByText("start it with --control").waitFor();
    for (const name of ["Start", "Stop", "Emergency stop"]) expect(await button(name).isDisabled()).toBe(true);
    expect(await page.getByLabel("k of the run, as a number").isDisabled()).toBe(true);
    await page.keyboard.press("Shift+Escape");
    expect(await found_by_axe(page)).toEqual([]);
    if (process.env.BF_PICTURES) await page.screenshot({ path: join(process.env.BF_PICTURES, "cockpit_alone.png") });
    await page.getByText(/running, \d+ steps of 1 ms/).waitFor();
  });
});
