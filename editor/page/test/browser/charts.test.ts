import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { writeFile } from "node:fs/promises";
import { join } from "node:path";
import { found_by_axe } from "./axe.ts";
import { is_there, start, type Hand } from "./browser.ts";
import type { Point } from "../../src/protocol.ts";
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
    await page.getByRole("combobox", { name: "condition" }).press("Escape");
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

  test("a name alone is that of a new state, whatever commands it begins, and all conditions of a new transition are seen", async () => {
    await enter();
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Insert a block, or do something" }).fill("run");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("states: [idle, move, run]");
    expect(await page.getByRole("button", { name: "Pause" }).count()).toBe(0);
    await page.setViewportSize({ width: 1280, height: 560 });
    await hand.drag(await hand.port("machine.move", "from"), await hand.middle("machine.run"));
    const offers = page.getByRole("listbox", { name: "Values of condition" });
    await offers.waitFor();
    const list = (await offers.boundingBox())!, panel = (await page.getByRole("region", { name: "Inspector" }).boundingBox())!;
    expect(list.y + list.height).toBeLessThanOrEqual(panel.y + panel.height + 1);
    await page.getByRole("combobox", { name: "condition" }).press("Escape");
  });

  test("states in states are opened, lit while they are active, and edited like others", async () => {
    const chart = `    chart:
      variables: {v: 0}
      outputs: [v]
      states:
        idle: {transitions: [{to: work, after: 0.25}]}
        work:
          states:
            up: {entry: v = 1, transitions: [{to: down, if: v > 0, after: 0.45}]}
            down: {}
            last: {history: shallow, to: up}
`;
    await writeFile(desk.file, model.replace(/ {4}states: [^]*?0 2]\n/, chart));
    await page.getByText("No mistakes").waitFor();
    const { x, y } = await hand.middle("machine");
    await page.mouse.dblclick(x, y);
    await element(/^state idle, first state/).waitFor();
    at("machine");
    await element(/^state work, state with states inside/).waitFor(); // what was written is there
    const around = await hand.middle("machine.work");
    await page.mouse.dblclick(around.x, around.y);
    await element(/^state up, first state/).waitFor();
    await element(/^state last, history/).waitFor();
    at("machine.work");
    expect(await found_by_axe(page)).toEqual([]);
    const inspector = page.getByRole("region", { name: "Inspector" }), field = (name: string) => inspector.getByLabel(name, { exact: true });
    const up = await hand.middle("machine.work.up");
    await page.mouse.click(up.x, up.y);
    await page.keyboard.press("y");
    const sheet = page.getByRole("textbox", { name: "Text of the model" });
    await expect.poll(() => sheet.locator(".cm-chosen").allInnerTexts()).toEqual(["            up: {entry: v = 1, transitions: [{to: down, if: v > 0, after: 0.45}]}"]);
    await sheet.locator(".cm-line").filter({ hasText: "down: {}" }).click();
    await page.getByRole("option", { name: /^state down/, selected: true }).waitFor();
    await page.getByRole("button", { name: "Close the text" }).click();
    await sheet.waitFor({ state: "detached" });
    await element(/^transition from up to down, \[v > 0] after 0.45 s/).waitFor();
    const [begin, end] = (await desk.drawing()).elements.find((e) => e.path === "machine.work.up.1")!.corners as [Point, Point];
    const on_it = await hand.at({ x: (begin.x + end.x) / 2, y: (begin.y + end.y) / 2 });
    await page.mouse.click(on_it.x, on_it.y);
    await field("if").fill("v > 0.5");
    await field("if").press("Enter");
    await expect.poll(() => text()).toContain("if: v > 0.5");
    await element(/^transition from up to down, \[v > 0.5] after 0.45 s/).waitFor();
    await page.keyboard.press("Escape");
    await hand.drag(await hand.border("machine.work.down", 0.5, 1), await hand.middle("machine.work.up"));
    await element(/^transition from down to up/).waitFor();
    await expect.poll(() => field("if").evaluate((its) => its === document.activeElement)).toBe(true);
    await field("if").fill("time_in_state > 9");
    await field("if").press("Enter");
    await expect.poll(() => text()).toContain("time_in_state > 9");
    await page.keyboard.press("Escape");
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Insert a block, or do something" }).fill("hold");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("hold: {}");
    await page.getByRole("option", { name: /^state hold/, selected: true }).waitFor();
    await page.keyboard.press("F2");
    await page.getByLabel("Name of hold").fill("rest");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("rest: {}");
    await page.getByRole("option", { name: /^state rest/, selected: true }).waitFor();
    await page.keyboard.press("Delete");
    await expect.poll(() => text()).not.toContain("rest: {}");
    await page.getByText("No mistakes").waitFor();
    await page.keyboard.press("p");
    await element(/^state up, first state, active/).waitFor();
    await element(/^state down, state, active/).waitFor();
    await page.keyboard.press("p");
    if (process.env.BF_PICTURES) await page.screenshot({ path: join(process.env.BF_PICTURES, "state_chart.png") });
    await page.keyboard.press("Escape");
    await element(/^state work, state with states inside, active/).waitFor();
    expect(await found_by_axe(page)).toEqual([]);
  });

  const sides = [0, 0.25, 0.5, 0.75, 1].flatMap((along) => [[along, 0], [along, 1], [0, along], [1, along]] as [number, number][]);
  const count = async () => (await desk.drawing()).elements.filter((e) => e.kind === "wire").length;
  test("a transition begins anywhere on the border of a state, from whose inside the state is moved, at every zoom", async () => {
    await enter();
    for (const zoom of [0, 4, -6, -14]) {
      hand.zoom = zoom;
      for (const [x, y] of zoom === 0 ? sides : sides.filter((_, i) => i % 5 === 0)) {
        const before = await count(), { bounds } = await hand.element("machine.idle");
        await hand.drag(await hand.border("machine.idle", x, y), await hand.middle("machine.move"));
        await expect.poll(count, { message: `from ${x}, ${y} at zoom ${zoom}` }).toBe(before + 1);
        expect((await hand.element("machine.idle")).bounds).toEqual(bounds);
        await page.getByRole("option", { name: /^transition from idle to move/, selected: true }).waitFor();
        await page.keyboard.press("Escape");
        await page.keyboard.press("Control+z");
        await expect.poll(count).toBe(before);
      }
      const { bounds } = await hand.element("machine.move"), from = await hand.middle("machine.move");
      await hand.drag(from, { x: from.x + 30, y: from.y + 24 });
      await expect.poll(async () => (await hand.element("machine.move")).bounds.x).not.toBe(bounds.x);
      expect(await count()).toBe(2);
      await expect.poll(() => page.getByRole("button", { name: "Undo" }).isEnabled()).toBe(true);
      await page.keyboard.press("Control+z");
      await expect.poll(async () => (await hand.element("machine.move")).bounds).toEqual(bounds);
    }
  });

  test("a transition leads to where it comes from once it has left it, and nowhere where it has not", async () => {
    await enter();
    const [bottom, out, top] = [await hand.border("machine.idle", 0.5, 1), await hand.border("machine.idle", 0.5, 2), await hand.border("machine.idle", 0.5, 0.5)];
    await hand.drag(bottom, top);
    await page.mouse.move(bottom.x, bottom.y);
    await page.mouse.down();
    await page.mouse.move(out.x, out.y);
    await page.mouse.move(top.x, top.y);
    await page.mouse.up();
    await page.getByRole("option", { name: /^transition from idle to idle/, selected: true }).waitFor();
    expect(await count()).toBe(3);
  });

  test("states stay where they are while transitions arrive, each of which is asked for its condition", async () => {
    await writeFile(desk.file, model.replace("connections:\n", "connections:\n  near: all.u1\n  level: all.u2\n  all: machine\n").replace("  part: {",
      "  near: {block: Constant}\n  level: {block: Constant, value: [1, 0]}\n  all: {block: Mux, inputs: 2}\n  part: {"));
    await page.getByRole("option", { name: /^block near/ }).waitFor();
    await enter();
    const [idle, move] = [(await hand.element("machine.idle")).bounds, (await hand.element("machine.move")).bounds];
    const draw = async (from: string, to: string) => hand.drag(await hand.border(`machine.${from}`, 0.5, 1), await hand.middle(`machine.${to}`));
    const condition = page.getByRole("combobox", { name: "condition" });
    await draw("idle", "move");
    await expect.poll(() => condition.evaluate((field) => field === document.activeElement)).toBe(true);
    const offers = page.getByRole("listbox", { name: "Values of condition" });
    expect(await offers.getByRole("option").allInnerTexts()).toEqual(["none", "near", "level(1)", "level(2)"]);
    expect(await found_by_axe(page)).toEqual([]);
    await page.keyboard.type("lev");
    expect(await offers.getByRole("option").allInnerTexts()).toEqual(["level(1)", "level(2)", "as typed: lev"]);
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("\n       1 2 3 0]");
    await element(/^transition from idle to move, \[level\(2\)\]/).waitFor();
    await expect.poll(() => condition.inputValue()).toBe("level(2)");
    await draw("move", "idle");
    await expect.poll(() => condition.inputValue()).toBe("none");
    await page.keyboard.type("(T)");
    await page.keyboard.press("Enter");
    await expect.poll(() => text()).toContain("\n       2 1 (T) 0]");
    for (let i = 0; i < 4; ++i) {
      await draw("idle", "move");
      await expect.poll(count).toBe(5 + i);
    }
    await offers.getByRole("option", { name: "near" }).click();
    await expect.poll(() => text()).toContain("\n       1 2 1 0]");
    expect([(await hand.element("machine.idle")).bounds, (await hand.element("machine.move")).bounds]).toEqual([idle, move]);
  });

  test("what is inserted has the name that is typed", async () => {
    const insert = async (typed: string, title: string) => {
      await page.locator("canvas").first().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
      await page.keyboard.press("Control+k");
      await page.keyboard.type(typed);
      expect(await page.getByRole("option", { selected: true }).locator(".title").innerText()).toBe(title);
      await page.keyboard.press("Enter");
      await page.getByRole("dialog").waitFor({ state: "detached" });
    };
    await insert("subsystem heater", "Subsystem heater");
    await expect.poll(() => text()).toContain("  heater:");
    await insert("gain Kp", "Gain Kp");
    await expect.poll(() => text()).toContain("  Kp: {block: Gain}");
    await insert("qqqq", "Subsystem qqqq");
    await expect.poll(() => text()).toContain("  qqqq:");
    await enter();
    await insert("hold", "State hold");
    await expect.poll(() => text()).toContain("states: [idle, move, hold]");
    await page.keyboard.press("Control+k");
    await page.keyboard.type("hold");
    await page.getByText("Nothing of that name.").waitFor();
  });

  test("a conversion is inserted where a boolean meets a double", async () => {
    await writeFile(desk.file, "model: m\nstep: 0.1\nblocks:\n  near: {block: Constant, value: true}\n  level: {block: Clock}\n  all: {block: Mux, inputs: 2}\n" +
      "connections:\n  level: all.u1\n  near: all.u2\n");
    await page.getByRole("button", { name: "1 mistake" }).click();
    await page.getByRole("button", { name: "Convert to double before u2" }).click();
    await expect.poll(() => text()).toContain("convert: {block: Convert}\nconnections:\n  level: all.u1\n  near: convert\n  convert: all.u2\n");
    await page.getByText("No mistakes.").waitFor();
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
