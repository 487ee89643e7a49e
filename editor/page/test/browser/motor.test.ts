import { writeFile } from "node:fs/promises";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, start, type Hand } from "./browser.ts";
import { Desk, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
const empty = "# Drawn by hand.\nmodel: motor\nstep: 0.001\nstop: 1\n";
/** As a person would write it: tau s y = K (Kp e + Ki ∫ e dt) - y. */
const by_hand = `${empty}blocks:
  step: {block: Step}
  sum: {block: Sum, signs: +-}
  gain: {block: Gain, K: 0.5}
  discreteIntegrator: {block: DiscreteIntegrator, gain: 4}
  sum2: {block: Sum}
  discreteTransferFunction: {block: DiscreteTransferFunction, numerator: [0.02], denominator: [1 -0.98]}
connections:
  step: sum.u1
  discreteTransferFunction: sum.u2
  sum: [gain, discreteIntegrator]
  gain: sum2.u1
  discreteIntegrator: sum2.u2
  sum2: discreteTransferFunction
`;
const blocks = {
  step: "Step", sum: "Sum", gain: "Gain", discreteIntegrator: "DiscreteIntegrator", sum2: "Sum", discreteTransferFunction: "DiscreteTransferFunction",
};
const connections: [string, string][] = [
  ["step", "sum.u1"], ["discreteTransferFunction", "sum.u2"], ["sum", "gain"], ["sum", "discreteIntegrator"],
  ["gain", "sum2.u1"], ["discreteIntegrator", "sum2.u2"], ["sum2", "discreteTransferFunction"],
];
const settings: [string, string, string][] = [
  ["sum", "signs", "+-"], ["gain", "K", "0.5"], ["discreteIntegrator", "gain", "4"],
  ["discreteTransferFunction", "numerator", "[0.02]"], ["discreteTransferFunction", "denominator", "[1 -0.98]"],
];

describe.skipIf(!is_there || !command)("bf edit", () => {
  let browser: Browser, desk: Desk, page: Page, file: string, hand: Hand;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => void ({ page, file, hand } = desk = await Desk.open(browser, { "motor.yaml": empty })));
  afterEach(() => desk.close());

  const elements = async () => (await desk.drawing()).elements;
  const wires = async () => (await elements()).filter((e) => e.kind === "wire").map((e) => `${e.from} → ${e.to}`);
  const until_there = (path: string) => page.getByRole("heading", { name: path, exact: true }).waitFor();
  const until_wired = (from: string, to: string) => expect.poll(wires, { timeout: 8000 }).toContain(`${from} → ${to}`);
  const named = (end: string, port: string): [string, string] => {
    const [block, own] = end.split(".");
    return [block!, own ?? port];
  };
  async function set(name: string, text: string): Promise<void> {
    const field = page.getByLabel(new RegExp(`^${name}( \\[.*\\])?$`));
    await field.fill(text);
    await field.press("Enter");
    await expect.poll(async () => (await desk.text()).includes(text)).toBe(true);
  }
  async function choose(path: string): Promise<void> {
    const p = await hand.middle(path);
    await page.mouse.click(p.x, p.y);
    await until_there(path);
  }
  /** But for where things are drawn, which is as the person pointed. */
  async function expect_the_file_of_a_person(): Promise<void> {
    const parts = async () => (await desk.text()).split("layout:\n"); // a file is written soon after its edit
    await expect.poll(async () => (await parts())[0]).toBe(by_hand);
    await expect.poll(async () => (await parts())[1]!.match(/x:/g)).toHaveLength(6);
  }
  async function runs_and_is_undone(): Promise<void> {
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await page.getByLabel("Speed").selectOption("fast");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await expect.poll(() => instant(page), { timeout: 8000 }).toBe(1);
    await page.getByRole("button", { name: "Undo" }).focus();
    while (await page.getByRole("button", { name: "Undo" }).isEnabled()) {
      await page.keyboard.press("Control+z");
      await page.waitForTimeout(50);
    }
    await expect.poll(() => desk.text()).toBe(empty);
  }

  test("builds a motor under PI control by the pointer, runs it, and undoes all of it", async () => {
    let at = { x: 200, y: 200 };
    for (const [name, type] of Object.entries(blocks)) {
      await page.mouse.dblclick(at.x, at.y);
      await page.getByRole("combobox", { name: "Insert" }).fill(type);
      await page.getByRole("option", { name: new RegExp(`^${type} `) }).first().click();
      await until_there(name);
      at = { x: 200 + ((at.x - 80) % 720), y: at.x > 700 ? at.y + 200 : at.y };
    }
    for (const [path, name, value] of settings) {
      await choose(path);
      await set(name, value);
    }
    for (const [from, to] of connections) {
      await hand.drag(await hand.port(...named(from, "y")), await hand.port(...named(to, "u")));
      await until_wired(from, to);
    }
    await expect_the_file_of_a_person();
    expect(await found_by_axe(page)).toEqual([]);
    await runs_and_is_undone();
  });

  test("builds the same by keys alone", async () => {
    for (const [name, type] of Object.entries(blocks)) {
      await page.keyboard.press("Control+k");
      await page.keyboard.type(type);
      await page.getByRole("option", { name: new RegExp(`^${type} `), selected: true }).waitFor();
      await page.keyboard.press("Enter");
      await until_there(name);
      for (const [path, setting, value] of settings.filter(([path]) => path === name)) {
        await until_there(path);
        await set(setting, value);
        await page.getByLabel("Elements of the model").focus();
      }
    }
    for (const [from, to] of connections) {
      await page.keyboard.press("Escape");
      await page.keyboard.press("c");
      await page.keyboard.type(`${named(from, "y").join(".")} → ${named(to, "u").join(".")}`);
      await page.keyboard.press("Enter");
      await until_wired(from, to);
    }
    await expect_the_file_of_a_person();
    await runs_and_is_undone();
  });

  test("changes a field of a struct, tunes it in the run, and keeps what was tuned", async () => {
    const text = "model: tuned\nstep: 0.001\nvariables:\n  Gain: {Kp: 1, Ki: 2}  # of the law\nblocks:\n  c: {block: Constant, value: Gain.Kp}\n";
    await writeFile(file, text);
    const field = page.getByLabel("Gain.Kp", { exact: true });
    await field.fill("5");
    await field.press("Enter");
    await expect.poll(() => desk.text()).toContain("Gain: {Kp: 5, Ki: 2}  # of the law");
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await page.getByRole("button", { name: "One step" }).click();
    await page.getByLabel("Gain.Kp of the run", { exact: true }).fill("7.5");
    expect(await desk.text()).toContain("Kp: 5");
    await page.getByRole("button", { name: "Keep" }).click();
    await expect.poll(() => desk.text()).toContain("Kp: 7.5");
  });
});
