import { execFileSync } from "node:child_process";
import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import type { RunCommand } from "../../src/protocol.ts";
import { found_by_axe } from "./axe.ts";
import { is_there, start } from "./browser.ts";
import { Desk, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
/** x follows k; the law has one output, and blocks of its own. */
const model = `model: law
step: 0.01
stop: 4
variables:
  k: {value: 1, maximum: 50}
  tiny: 0.0000178
blocks:
  k: {block: Constant, value: k}
  law:
    inputs: [u]
    outputs: [y]
    blocks:
      double: {block: Gain, K: 2}
      half: {block: Gain, K: 0.5}
    connections:
      u: double
      double: half
      half: y
  x: {block: DiscreteIntegrator}
connections:
  k: law
  law: x
layout:
  displays:
    law: {shows: lines, signals: [law, x]}
`;

describe.skipIf(!is_there || !command)("branches", () => {
  let browser: Browser, desk: Desk, page: Page, folder: string, file: string;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    ({ page, folder, file } = desk = await Desk.open(browser, { "law.yaml": model }));
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
  });
  afterEach(() => desk.close());

  async function run(wanted: Partial<RunCommand>, time: string): Promise<void> {
    await desk.client.call("run", { action: "start", time: null, factor: null, branch: null, event: "", ...wanted });
    await expect.poll(() => instant(page), { timeout: 8000 }).toBe(Number(time));
  }
  /** Branch 0 to 2 s with k = 1; branch 1 from 1 s to the end with k = 7. */
  async function branch(): Promise<void> {
    await run({ action: "to", time: 2 }, "2");
    await run({ action: "to", time: 1 }, "1");
    await set(field("k"), "7");
    await page.getByRole("button", { name: "Keep" }).waitFor();
    await run({}, "4");
    await page.getByText("Branches (2)").click();
  }
  const field = (name: string) => page.getByLabel(`${name} of the run, as a number`);
  test("are compared, and run at the chosen speed, in a page that is loaded again", async () => {
    await branch();
    await page.getByRole("checkbox", { name: "Compare branch 0" }).check();
    await page.getByLabel("Speed").selectOption("0.25");
    await page.reload();
    await page.getByText("Branches (2)").click();
    await expect.poll(() => page.getByRole("checkbox", { name: "Compare branch 0" }).isChecked()).toBe(true);
    expect(await page.getByLabel("Speed").inputValue()).toBe("0.25");
    await page.getByLabel("Speed").selectOption("fast");
    await page.reload();
    await expect.poll(() => page.getByLabel("Speed").inputValue()).toBe("");
    await page.getByRole("button", { name: "Run", exact: true }).waitFor();
  });

  async function set(input: Locator, text: string): Promise<void> {
    await input.fill(text);
    await input.press("Enter");
  }
  const radio = (index: number) => page.getByRole("radio", { name: new RegExp(`^${index}: `) });

  test("show the values of their own runs, whatever the document has", async () => {
    await branch();
    expect(await field("tiny").inputValue()).toBe("1.78e-5");
    await radio(0).check();
    await expect.poll(() => field("k").inputValue()).toBe("1");
    await expect.poll(() => page.getByRole("button", { name: "Keep" }).count()).toBe(0);
    await radio(1).check();
    await expect.poll(() => field("k").inputValue()).toBe("7");
    await page.getByRole("button", { name: "Keep" }).click();
    await expect.poll(() => desk.text()).toContain("k: {value: 7, maximum: 50}");
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await radio(0).check();
    await expect.poll(() => field("k").inputValue()).toBe("1");
    await page.getByRole("button", { name: "Reset" }).waitFor();
  });

  test("are chosen while a question is open, which can be put off", async () => {
    await branch();
    await page.getByRole("button", { name: "Keep" }).click();
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await radio(0).check();
    const question = page.getByRole("alert").filter({ hasText: "The model was edited since" });
    await question.waitFor();
    await radio(1).check();
    await radio(0).check(); // neither lies beneath the other
    await question.getByRole("button", { name: "Later" }).click();
    await question.waitFor({ state: "detached" });
  });

  test("are listed legibly, by what was set in them", async () => {
    await branch();
    for (const width of [1500, 1100]) {
      await page.setViewportSize({ width, height: 800 });
      const rows = page.getByRole("listitem").filter({ has: page.getByRole("radio") }), list = (await rows.first().locator("..").boundingBox())!;
      expect(await rows.allInnerTexts()).toEqual([expect.stringMatching(/^0: from the beginning/), expect.stringMatching(/^1: from 1 s, k = 7/)]);
      for (const row of await rows.all()) {
        const [name, compare] = await Promise.all([0, 1].map(async (i) => (await row.locator("label").nth(i).boundingBox())!));
        expect(name!.x).toBeGreaterThanOrEqual(list.x);
        expect(name!.x + name!.width).toBeLessThanOrEqual(compare!.x);
        expect(compare!.x + compare!.width).toBeLessThanOrEqual(list.x + list.width);
        const text = await row.locator("label").first().evaluate((label) => [label.scrollWidth - label.clientWidth, label.clientHeight]);
        expect(text[0]).toBeLessThanOrEqual(0);
        expect(text[1]).toBeLessThan(30); // one line
      }
    }
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("end in plots where they ended, in the colours of their signals", async () => {
    await branch();
    await page.getByRole("checkbox", { name: "Compare branch 0" }).check();
    const legend = page.getByRole("list", { name: "Values of law" });
    const texts = async () => (await legend.getByRole("listitem").allInnerTexts()).map((text) => text.replace(/\s+/g, " "));
    await expect.poll(texts).toEqual(["law 7", "branch 0: law –", expect.stringMatching(/^x 2[12]/), "branch 0: x –"]);
    const colours = await legend.locator(".dot").evaluateAll((dots) => dots.map((dot) => getComputedStyle(dot).backgroundColor));
    expect([colours[0], colours[2]]).toEqual([colours[1], colours[3]]);
    expect(colours[0]).not.toBe(colours[2]);
    await run({ action: "to", time: 1.5 }, "1.5");
    await expect.poll(texts).toEqual(["law 7", "branch 0: law 1", expect.stringMatching(/^x 4/), expect.stringMatching(/^branch 0: x 1\.[45]/)]);
  });

  test("have in the legend the values of the very instant, where a fast run left out most samples", async () => {
    await writeFile(file, `model: law
step: 0.001
stop: 100
blocks:
  k: {block: Constant, value: 1}
  wave: {block: Sine, frequency: 20}
  law: {block: Product}
connections: {k: law.u1, wave: law.u2}
layout: {displays: {law: {shows: lines, signals: [law]}}}
`);
    await expect.poll(async () => (await desk.client.call("find", { text: "wave" })).hits.length).toBeGreaterThan(0);
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await run({ action: "to", time: 60 }, "60");
    await run({ action: "to", time: 10 }, "10");
    await desk.client.call("tune", { name: "k.value", values: [3] });
    await run({ action: "to", time: 60 }, "60");
    await page.getByText("Branches (2)").click();
    await page.getByRole("checkbox", { name: "Compare branch 0" }).check();
    const texts = async () => (await page.getByRole("list", { name: "Values of law" }).getByRole("listitem").allInnerTexts()).map((text) => Number(text.trim().split(/\s+/).at(-1)!.replace("−", "-")));
    for (const time of [33.333, 51.007, 20.019]) {
      await run({ action: "to", time }, String(time));
      const wave = Math.sin(20 * time);
      await expect.poll(async () => (await texts()).map((value, i) => Math.abs(value - (i === 0 ? 3 : 1) * wave) < 1e-3)).toEqual([true, true]);
    }
  });

  test("stand beside recordings, which have outputs of subsystems too, or say that they do not", async () => {
    execFileSync(command!, ["run", file, "--record", join(folder, "all.mcap"), "--set", "k=3"], { stdio: "ignore" });
    await writeFile(join(folder, "less.yaml"), `${model.split("layout:")[0]}record: [x]\n`);
    execFileSync(command!, ["run", join(folder, "less.yaml"), "--record", join(folder, "less.mcap")], { stdio: "ignore" });
    await run({ action: "to", time: 2 }, "2");
    for (const name of ["all.mcap", "less.mcap"]) {
      await page.getByRole("button", { name: "Compare with …" }).click();
      await page.getByRole("option", { name }).click();
    }
    const legend = page.getByRole("list", { name: "Values of law" });
    await expect.poll(async () => (await legend.innerText()).replace(/\s+/g, " ")).toMatch(/^law 1 all: law 3 x [12]\S* all: x [56]\S* less: x [12]\S*$/);
    await page.getByRole("status").filter({ hasText: "less.mcap has no law" }).waitFor();
    expect(await page.getByRole("status").filter({ hasText: "has no x" }).count()).toBe(0);
  });
});
