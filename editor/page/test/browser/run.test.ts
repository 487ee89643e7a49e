import { execFileSync } from "node:child_process";
import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { is_there, start } from "./browser.ts";
import { Desk, go_to, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
const soon = <T>(what: () => T) => expect.poll(what, { timeout: 8000 });
const model = `model: tank
step: 0.01
stop: 60
variables:
  rate: 0.5
  twice: 2*rate
blocks:
  inflow: {block: Constant, value: rate}   # m/s
  level: {block: DiscreteIntegrator}
  gain: {block: Gain, K: twice}
  sink: {block: Terminator}
connections:
  inflow: [level, gain]
  gain: sink
`;

describe.skipIf(!is_there || !command)("a run", () => {
  let browser: Browser, desk: Desk, page: Page;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    ({ page } = desk = await Desk.open(browser, { "tank.yaml": model }));
    await page.getByRole("button", { name: "✓ No mistakes" }).or(page.getByRole("button", { name: "1 open port" })).waitFor();
  });
  afterEach(() => desk.close());
  const message = () => page.getByRole("alert");

  test("goes to each of its instants, by a field and by the keys of the slider", async () => {
    await page.getByRole("button", { name: "One step" }).click();
    await soon(() => instant(page)).toBe(0.01);
    await go_to(page, 19.26);
    const slider = page.getByLabel("Time", { exact: true });
    expect([await slider.getAttribute("max"), await slider.inputValue(), await slider.getAttribute("aria-valuetext")]).toEqual(["6000", "1926", "19.26 s"]);
    await slider.press("ArrowLeft");
    await soon(() => instant(page)).toBe(19.25);
    await go_to(page, 3);
    expect(await page.getByLabel("Instant in s").inputValue()).toBe("3.00");
  });

  test("says that a text is no instant, and covers no field with that", async () => {
    await page.getByRole("button", { name: "Parameters" }).click();
    await page.getByRole("region", { name: "Parameters of the model" }).getByLabel("rate").waitFor();
    await page.getByLabel("Instant in s").fill("soon");
    await page.getByLabel("Instant in s").press("Enter");
    await message().getByText("'soon' is no instant; give a number of seconds").waitFor();
    const shown = (await message().boundingBox())!;
    for (const field of await page.locator("input, select, textarea").all()) {
      const box = await field.boundingBox();
      if (box) expect(box.x + box.width <= shown.x || box.x >= shown.x + shown.width || box.y + box.height <= shown.y || box.y >= shown.y + shown.height).toBe(true);
    }
  });

  test("is compared with a recording, and the model with a file, that came since the page was opened", async () => {
    await page.getByRole("button", { name: "Signals" }).click();
    await page.getByRole("button", { name: "Compare with …" }).click();
    await page.getByText("Nothing of that name.").waitFor();
    await page.keyboard.press("Escape");
    execFileSync(command!, ["run", desk.file, "--stop", "1", "--record", join(desk.folder, "later.mcap")], { stdio: "ignore" });
    execFileSync("cp", [desk.file, join(desk.folder, "later.yaml")]);
    await page.getByRole("button", { name: "Compare with …" }).click();
    await page.getByRole("option", { name: "later.mcap" }).click();
    await page.getByRole("button", { name: "Close later.mcap" }).waitFor();
    await page.keyboard.press("Control+o");
    await page.getByRole("option", { name: "later.yaml" }).waitFor();
  });

  test("says why it failed where everybody sees it", async () => {
    await writeFile(desk.file, "model: m\nstep: 0.01\nstop: 60\nblocks:\n  s: {block: Step, time: 0.5, before: 1, after: 0}\n  inverse: {block: MatrixInverse}\nconnections: {s: inverse}\n");
    await page.getByRole("option", { name: /inverse/ }).first().waitFor();
    await page.getByRole("button", { name: /No mistakes|open port/ }).waitFor();
    await page.getByLabel("Speed").selectOption("fast");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await message().filter({ hasText: "singular" }).waitFor();
  });

  test("has settings that keep the keyboard when their field moves to those that are given", async () => {
    const inspector = page.getByRole("region", { name: "Inspector" }), focused = () => page.evaluate(() => document.activeElement!.id);
    await inspector.locator("summary").click();
    await inspector.getByLabel("relative_tolerance").fill("0.001");
    await page.keyboard.press("Enter");
    await soon(() => desk.text()).toContain("relative_tolerance: 0.001");
    await inspector.locator("details").getByLabel("relative_tolerance").waitFor({ state: "detached" });
    await soon(focused).toBe("field-relative_tolerance");
    await inspector.getByLabel("solver", { exact: true }).focus();
    await inspector.getByLabel("solver", { exact: true }).selectOption("rk4");
    await soon(() => desk.text()).toContain("solver: rk4");
    await inspector.locator("details").getByLabel("solver").waitFor({ state: "detached" });
    await soon(focused).toBe("field-solver");
  });

  test("shows each of several wires in a panel of its own, by one edit", async () => {
    await page.keyboard.press("Control+a");
    await page.keyboard.press("Shift+W");
    const panels = async () => (await desk.text()).match(/panel \d: .*/g);
    const each = ["inflow", "gain", "level"].map((signal, i) => `panel ${i + 1}: {shows: lines, signals: [${signal}]}`);
    await soon(panels).toEqual(each);
    await page.keyboard.press("Shift+W");
    await page.waitForTimeout(200);
    expect(await panels()).toEqual(each);
    await page.keyboard.press("Control+z");
    await soon(() => desk.text()).toBe(model);
    await page.keyboard.press("Shift+W");
    await page.keyboard.press("Shift+W"); // the page may not know yet that they are there
    await page.keyboard.press("Control+z");
    await page.waitForTimeout(200);
    await soon(() => desk.text()).toBe(model);
  });

  test("loses no variable that is used without a word, which takes it back", async () => {
    await page.getByRole("button", { name: "Remove rate" }).click();
    await message().getByText("'rate' was used by twice, inflow.").waitFor();
    await message().getByRole("button", { name: "Undo" }).click();
    await soon(() => desk.text()).toBe(model);
    await message().waitFor({ state: "detached" });
  });

  test("is set by what a model has, and not by what only subsystems have", async () => {
    const inspector = page.getByRole("region", { name: "Inspector" });
    await inspector.locator("summary").click();
    await inspector.getByLabel("relative_tolerance").waitFor();
    for (const name of ["execution", "trigger", "reset", "iterations", "states"]) expect(await inspector.getByLabel(name, { exact: true }).count()).toBe(0);
    const label = inspector.locator("label", { hasText: "relative_tolerance" });
    const lines = await label.evaluate((one) => {
      const range = document.createRange(), seen = new Map<number, string>();
      for (const node of one.childNodes) for (let i = 0; i < (node.textContent ?? "").length; ++i) {
        range.setStart(node, i);
        range.setEnd(node, i + 1);
        const top = Math.round(range.getBoundingClientRect().top);
        seen.set(top, (seen.get(top) ?? "") + node.textContent![i]);
      }
      return [...seen.values()];
    });
    expect(lines).toEqual(["relative_", "tolerance"]);
    await page.getByRole("textbox", { name: "rate", exact: true }).waitFor();
    expect((await page.getByRole("textbox", { name: "rate", exact: true }).boundingBox())!.y).toBeLessThan(760);
  });
});
