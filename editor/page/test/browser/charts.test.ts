import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, start, type Hand } from "./browser.ts";
import { Desk } from "./desk.ts";

const command = process.env.BF_COMMAND;
const model = `model: m
step: 0.1
stop: 10
variables: {T: 1}
blocks:
  machine:
    block: StateMachine
    states: [idle, move]
    transitions: |
      [1 2 0 T;
       2 1 0 2]
  part: {file: part.yaml}
connections:
  machine.state: part
`;
const part = `model: part
icon: spring
variables:
  k: {value: 2, minimum: 0, unit: N/m, doc: stiffness}
inputs: [u]
blocks:
  gain: {block: Gain, K: k}
connections: {u: gain}
`;

describe.skipIf(!is_there || !command)("what a model looks like", () => {
  let browser: Browser, desk: Desk, page: Page, hand: Hand;
  const text = () => desk.text();
  const at = (place: string) => { desk.system = place; };

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    ({ page, hand } = desk = await Desk.open(browser, {
      "m.yaml": model,
      "part.yaml": part,
      "old.yaml": model.replace("T: 1", "T: 3").replace("  part: {file: part.yaml}\n", "  part: {file: part.yaml}\n  more: {block: Constant}\n"),
      "arm.svg": `<svg xmlns="http://www.w3.org/2000/svg" width="40" height="30"><rect width="40" height="30" fill="#c00"/></svg>`,
    }));
    await page.getByText("No mistakes").waitFor();
  });
  afterEach(() => desk.close());
  const element = (name: RegExp) => page.getByRole("option", { name });
  async function enter(): Promise<void> {
    const { x, y } = await hand.middle("machine");
    await page.mouse.dblclick(x, y);
    await element(/^state idle, first state/).waitFor();
    at("machine");
  }

  test("a state machine is entered, drawn on, and lit while it runs", async () => {
    await enter();
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Insert a block, or do something" }).fill("state");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("states: [idle, move, state]");
    await page.getByRole("option", { name: /^state state/, selected: true }).waitFor();
    await page.keyboard.press("F2");
    await page.getByLabel("Name of state").fill("hold");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("states: [idle, move, hold]");
    await hand.drag(await hand.port("machine.move", "from"), await hand.middle("machine.hold"));
    await expect.poll(() => text()).toContain(" 2 1 0 2;\n       2 3 0 0]");
    await page.keyboard.press("Control+z");
    await expect.poll(() => text()).not.toContain("2 3 0 0");
    await element(/^transition from idle to move, after T s/).waitFor();
    expect(await found_by_axe(page)).toEqual([]);
    await page.keyboard.press("s");
    await element(/^state idle, first state, active/).waitFor();
    await page.keyboard.press("p");
    await element(/^state move, state, active/).waitFor();
    await page.keyboard.press("p");
  });

  test("a block turns, and its ports go to other sides", async () => {
    const { x, y } = await hand.middle("part");
    await page.mouse.click(x, y);
    await page.keyboard.press("Shift+r");
    await expect.poll(() => text()).toContain("rotated: 90");
    await page.getByLabel("Side of u").selectOption("left");
    await expect.poll(() => text()).toContain("sides: {u: left}");
  });

  test("a subsystem in a file of its own has a dialog of its parameters, and an image stands beside it", async () => {
    const { x, y } = await hand.middle("part");
    await page.mouse.click(x, y);
    const k = page.locator("#field-part\\.k");
    expect(await k.getAttribute("placeholder")).toBe("2");
    await k.fill("2*T");
    await page.getByText("= 2", { exact: true }).first().waitFor();
    await k.press("Enter");
    await expect.poll(() => text()).toContain("part: {file: part.yaml, with: {k: 2*T}}");
    await page.keyboard.press("Escape");
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Insert a block, or do something" }).fill("image");
    await page.keyboard.press("Enter");
    await page.getByRole("option", { name: "arm.svg" }).click();
    await expect.poll(() => text()).toContain("image: arm.svg");
    await page.getByLabel("Width").fill("80");
    await page.getByLabel("Width").press("Enter");
    await expect.poll(() => text()).toContain("width: 80");
    await page.keyboard.press("f");
    // What is drawn of it is the red of the file.
    await expect.poll(async () => {
      const { x, y, width, height } = (await hand.element("image")).bounds, p = await hand.at({ x: x + width / 2, y: y + height / 2 });
      return page.locator("canvas").first().evaluate((canvas: HTMLCanvasElement, { x, y }) => {
        const box = canvas.getBoundingClientRect(), by = canvas.width / box.width;
        return [...canvas.getContext("2d")!.getImageData((x - box.x) * by, (y - box.y) * by, 1, 1).data.slice(0, 3)];
      }, p);
    }).toEqual([204, 0, 0]);
  });

  test("all parameters stand in one list, and differences from another file lead to where they are", async () => {
    await page.getByRole("button", { name: "Parameters", exact: true }).click();
    const list = page.getByRole("region", { name: "Parameters of the model" });
    await list.getByLabel("Search parameters").fill("stiff");
    await list.getByRole("button", { name: "part", exact: true }).waitFor();
    expect(await list.getByRole("button").allInnerTexts()).toEqual(["part"]);
    await list.getByRole("textbox", { name: /^k/ }).fill("5");
    await list.getByRole("textbox", { name: /^k/ }).press("Enter");
    await expect.poll(() => text()).toContain("with: {k: 5}");
    await list.getByTitle("k is changed").waitFor();
    await page.getByRole("button", { name: "Parameters", exact: true }).click();
    await page.locator("canvas").first().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await page.keyboard.press("Shift+d");
    await page.getByRole("option", { name: /old\.yaml/ }).click();
    const compared = page.getByRole("dialog", { name: "Comparison with old.yaml" });
    await compared.getByText("3 differences").waitFor();
    expect(await compared.getByRole("listitem").allInnerTexts()).toEqual(expect.arrayContaining([expect.stringContaining("- more")]));
    expect(await found_by_axe(page)).toEqual([]);
    await compared.getByRole("button", { name: "Go to part in the drawing" }).first().click();
    await compared.waitFor({ state: "detached" });
    await page.getByRole("option", { name: /^subsystem part/, selected: true }).waitFor();
  });
});
