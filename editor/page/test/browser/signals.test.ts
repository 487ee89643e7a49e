import { execFileSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { is_there, start } from "./browser.ts";
import { Desk, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
const soon = <T>(what: () => T) => expect.poll(what, { timeout: 8000 });
const model = `model: tank
step: 0.01
stop: 4
blocks:
  inflow: {block: Constant, value: 0.5}   # m/s
  level: {block: DiscreteIntegrator}
  sink: {block: Terminator}
connections:
  inflow: level
  level: sink
`;

describe.skipIf(!is_there || !command)("signals of a model", () => {
  let browser: Browser, desk: Desk, page: Page;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => void ({ page } = desk = await Desk.open(browser, { "tank.yaml": model })));
  afterEach(() => desk.close());
  async function choose(to: string): Promise<void> {
    const { corners } = (await desk.drawing()).elements.find((e) => e.kind === "wire" && e.to === to)!;
    const at = await desk.hand.at({ x: (corners[0]!.x + corners[1]!.x) / 2, y: corners[0]!.y });
    await page.mouse.click(at.x, at.y);
    await page.getByRole("button", { name: "Reroute" }).waitFor();
  }

  test("are named, recorded and plotted in the file by the smallest change, undone byte for byte", async () => {
    await choose("sink");
    await page.keyboard.press("F2");
    await page.getByRole("textbox", { name: "Name of the signal from level" }).fill("h2");
    await page.keyboard.press("Enter");
    const named = `${model}signals:\n  h2: level\n`;
    await soon(() => desk.text()).toBe(named);
    await page.getByRole("heading", { name: "h2 → sink" }).waitFor();
    await page.keyboard.press("l");
    await soon(() => desk.text()).toBe(`${named}record: [h2]\n`);
    await page.getByRole("button", { name: "Record", exact: true, pressed: true }).waitFor();
    await page.keyboard.press("Shift+L");
    await page.getByRole("combobox", { name: "Plot of the model" }).fill("Level [m]");
    await page.keyboard.press("Enter");
    await soon(() => desk.text()).toBe(`${named}record: [h2]\nplots:\n  "Level [m]": [h2]\n`);
    await page.getByText("in the plots Level [m]").waitFor();
    for (let i = 0; i < 3; ++i) await page.keyboard.press("Control+z");
    await soon(() => desk.text()).toBe(model);
  });

  test("are looked for, and waited for, by their names, also in a run that was there before", async () => {
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await page.getByLabel("Speed").selectOption("fast");
    await choose("sink");
    await page.keyboard.press("s");
    await soon(() => instant(page)).toBe(0.01);
    await page.keyboard.press("F2");
    await page.getByRole("textbox", { name: "Name of the signal from level" }).fill("h2");
    await page.keyboard.press("Enter");
    await soon(() => desk.text()).toContain("h2: level");
    const wire = (await desk.drawing()).elements.find((e) => e.kind === "wire" && e.to === "sink")!;
    expect(wire.shapes.filter((shape) => shape.kind === "text").map((shape) => shape.text)).toEqual(["h2"]);
    await page.getByText("Branches (2)").waitFor();
    const until = page.getByLabel("Run until");
    await until.fill("h2 > 0.6");
    await until.press("Enter");
    await soon(() => instant(page)).toBeCloseTo(1.205, 1); // 0.5 m/s from 0
    await page.keyboard.press("Escape");
    await page.locator("canvas").first().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await page.keyboard.press("Control+f");
    await page.keyboard.type("h2");
    await page.getByRole("option", { name: /level.*h2 = level/ }).click();
    await page.getByRole("heading", { name: "level", exact: true }).waitFor();
  });

  test("that lack at a block which was just placed are open ports, and mistakes once a run was refused", async () => {
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await page.keyboard.press("Control+k");
    await page.keyboard.type("sum");
    await page.getByRole("dialog").getByRole("option", { name: /^Sum/ }).first().waitFor();
    await page.keyboard.press("Enter");
    await page.getByRole("button", { name: "2 open ports" }).waitFor();
    const asked = (marks_open: boolean) => desk.client.call("draw", { system: "", show: [], moved: [], moved_notes: [], bent: [], marks_open });
    const sum = async (marks_open: boolean) => (await asked(marks_open)).elements.find((e) => e.path === "sum")!;
    expect((await sum(false)).marks).toEqual([]);
    expect((await sum(false)).shapes.filter((shape) => shape.style === "open").length).toBe(3);
    await soon(async () => (await sum(true)).marks.length).toBe(2);
    const before = await page.locator("canvas").first().screenshot();
    await page.keyboard.press("p");
    await page.getByRole("alert").filter({ hasText: "sum: input 'u1' is not connected; connect a signal to it" }).waitFor();
    await page.getByRole("button", { name: "2 mistakes" }).waitFor();
    await soon(async () => (await page.locator("canvas").first().screenshot()).equals(before)).toBe(false);
    await page.keyboard.press("r"); // an edit, which gives another chance
    await page.getByRole("button", { name: "2 open ports" }).waitFor();
  });

  test("have labels instead of a wire, which are taken, given a name and made a wire again", async () => {
    await choose("sink");
    await page.keyboard.press("Alt+l");
    const labelled = `${model}layout:\n  wires:\n    sink: labels\n`;
    await soon(() => desk.text()).toBe(labelled);
    const wire = async () => (await desk.drawing()).elements.find((e) => e.kind === "wire" && e.to === "sink")!;
    const texts = async () => (await wire()).shapes.filter((shape) => shape.kind === "text").map((shape) => shape.text);
    expect(await texts()).toEqual(["level", "level"]);
    await page.getByRole("button", { name: "Labels", pressed: true }).waitFor(); // it is drawn, too
    await page.keyboard.press("Escape");
    const end = (await wire()).shapes.filter((shape) => shape.kind === "text")[1]!.points[0]!; // the label at the source
    const at = await desk.hand.at(end);
    await page.mouse.click(at.x, at.y);
    await page.getByRole("button", { name: "Labels", pressed: true }).waitFor();
    await page.keyboard.press("F2");
    await page.getByRole("textbox", { name: "Name of the signal from level" }).fill("h");
    await page.keyboard.press("Enter");
    await soon(texts).toEqual(["h", "h"]);
    await page.mouse.move(at.x, at.y);
    await page.mouse.down();
    await page.mouse.move(at.x + 30, at.y + 40, { steps: 4 }); // labels are not bent
    await page.mouse.up();
    await page.keyboard.press("Alt+l");
    await soon(() => desk.text()).toBe(`${model}signals:\n  h: level\n`);
    expect((await wire()).corners.length).toBeGreaterThan(1);
    for (let i = 0; i < 3; ++i) await page.keyboard.press("Control+z");
    await soon(() => desk.text()).toBe(model);
  });

  test("are on paper and in a file as bf draw has them", async () => {
    const waiting = page.waitForEvent("download");
    await page.keyboard.press("Control+Shift+s");
    const download = await waiting, svg = await readFile(await download.path(), "utf8");
    expect(download.suggestedFilename()).toBe("tank.svg");
    execFileSync(command!, ["draw", desk.file, "-o", `${desk.file}.svg`]);
    expect(svg).toBe(await readFile(`${desk.file}.svg`, "utf8"));
    await page.evaluate(() => { window.print = () => { document.body.dataset.printed = document.title + (document.querySelector(".printed") as HTMLImageElement).naturalWidth; }; });
    await page.keyboard.press("Control+p");
    await soon(() => page.evaluate(() => document.body.dataset.printed ?? "")).toMatch(/^tank[1-9]\d+$/);
    expect(await page.title()).toContain("BlockFactory");
    expect(await page.locator(".printed").count()).toBe(0);
  });
});
