import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { commands } from "../../src/commands.ts";
import { serve } from "../service.ts";
import { found_by_axe } from "./axe.ts";
import { Hand, is_there, opened, start } from "./browser.ts";

describe.skipIf(!is_there)("what is chosen", () => {
  let browser: Browser, page: Page, complaints: string[], service: Awaited<ReturnType<typeof serve>>, hand: Hand;
  const operations = () => service.model.operations as any[];
  const menu = () => page.getByRole("menu", { name: "What is possible here" });
  const items = async () => (await menu().locator("button").allInnerTexts()).map((text) => text.replace(/\s+/g, " ").trim());

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    service = await serve(process.env.BF_PAGE ?? "dist");
    ({ page, complaints } = await opened(browser, `http://127.0.0.1:${service.port}/?token=x`));
    hand = new Hand(page, async () => service.model.draw("", []));
  });
  afterEach(async () => {
    await page.close();
    service.drop();
    service.server.close();
    expect(complaints).toEqual([]);
  });
  const wire = () => hand.at({ x: 370, y: 79 }); // from gain to motor
  async function click(where: Promise<{ x: number; y: number }>, button: "left" | "right" = "left"): Promise<void> {
    const { x, y } = await where;
    await page.mouse.click(x, y, { button });
  }

  test("has a menu of what is possible with it, with its keys", async () => {
    await click(hand.middle("gain"), "right");
    await menu().waitFor();
    expect(await items()).toContain("Flip R");
    expect(await items()).not.toContain("Dissolve the subsystem Ctrl+Shift+G");
    expect(await found_by_axe(page)).toEqual([]);
    await menu().getByRole("menuitem", { name: /^Flip/ }).click();
    await expect.poll(() => operations()).toEqual([{ do: "flip", path: "gain" }]);
    await menu().waitFor({ state: "detached" });
    await click(hand.middle("motor"), "right");
    expect(await items()).toContain("Dissolve the subsystem Ctrl+Shift+G");
    await page.keyboard.press("Escape");
    await click(hand.at({ x: 600, y: 150 }), "right");
    expect(await items()).toContain("Paste Ctrl+V");
    expect(await items()).not.toContain("Flip R");
    await page.keyboard.press("Escape");
    await click(wire(), "right");
    expect(await items()).toContain("Let the wire find its way Alt+W");
    await page.keyboard.press("Escape");
    await click(hand.port("motor", "omega"), "right");
    expect((await items())[0]).toBe("Connect C");
    const all = commands.map((command) => command.title);
    for (const item of await items()) expect(all.some((title) => item.includes(title))).toBe(true);
  });

  test("has its menu by keys, which go through it and no further", async () => {
    await click(hand.middle("gain"));
    await page.keyboard.press("Shift+F10");
    await menu().waitFor();
    const box = (await menu().boundingBox())!;
    expect(box.x + box.width).toBeLessThan(1280);
    expect(box.y + box.height).toBeLessThan(800);
    const focused = () => page.evaluate(() => (document.activeElement as HTMLElement).innerText.replace(/\s+/g, " ").trim());
    const all = await items();
    expect(await focused()).toBe(all[0]);
    await page.keyboard.press("ArrowUp");
    expect(await focused()).toBe(all.at(-1));
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("ArrowDown");
    expect(await focused()).toBe(all[1]);
    await page.keyboard.press("End");
    await page.keyboard.press("Home");
    await page.keyboard.press("r");
    expect(await focused()).toMatch(/^(✓ )?R/);
    await page.keyboard.press("Delete"); // R and Delete are for the drawing
    expect(operations()).toEqual([]);
    await page.keyboard.press("Escape");
    await menu().waitFor({ state: "detached" });
    await page.keyboard.press("ContextMenu");
    await menu().waitFor();
    await page.keyboard.press("f");
    await page.keyboard.press("Enter");
    await expect.poll(() => operations()).toEqual([{ do: "flip", path: "gain" }]);
    await page.keyboard.press("r"); // the drawing has the keys again
    await expect.poll(() => operations().length).toBe(2);
  });

  test("is recorded from a wire, a port and a block, and no longer", async () => {
    await click(wire());
    await page.keyboard.press("l");
    await expect.poll(() => operations()).toEqual([{ do: "record", path: "gain" }]);
    await page.getByRole("button", { name: "Record", exact: true, pressed: true }).waitFor();
    await click(wire(), "right");
    await menu().getByRole("menuitemcheckbox", { name: /Record the signal/, checked: true }).click();
    await expect.poll(() => operations().at(-1)).toEqual({ do: "record", path: "gain", is_recorded: false });
    await click(hand.port("error", "u1")); // what is wired to it
    await page.keyboard.press("Control+k");
    await page.keyboard.type("record");
    await page.keyboard.press("Enter");
    await expect.poll(() => operations().at(-1)).toEqual({ do: "record", path: "reference" });
    await click(hand.middle("motor"));
    await page.keyboard.press("l");
    await expect.poll(() => operations().at(-1)).toEqual({ do: "record", path: "motor" });
  });

  test("is put into plots of the model, and taken off", async () => {
    service.model.plots = { "Speed [rad/s]": ["gain"] };
    await click(hand.middle("reference"));
    await page.keyboard.press("r"); // the page hears of the plots
    await click(wire());
    await page.keyboard.press("Shift+L");
    await page.getByRole("option", { name: /Speed.*take the signal off/ }).waitFor();
    await page.getByRole("combobox", { name: "Plot of the model" }).fill("Voltage [V]");
    await page.keyboard.press("Enter");
    await expect.poll(() => operations().at(-1)).toEqual({ do: "record", path: "gain", plot: "Voltage [V]" });
    await page.keyboard.press("Shift+L");
    await page.getByRole("option", { name: /Speed/ }).click();
    await expect.poll(() => operations().at(-1)).toEqual({ do: "record", path: "gain", is_recorded: false, plot: "Speed [rad/s]" });
  });

  test("is named from its wire, renamed, and without a name again", async () => {
    await click(wire());
    await page.keyboard.press("F2");
    const field = page.getByRole("textbox", { name: "Name of the signal from gain" });
    expect(await field.inputValue()).toBe("");
    await field.fill("voltage");
    await field.press("Enter");
    await expect.poll(() => operations()).toEqual([{ do: "name_signal", system: "", from: "gain", name: "voltage" }]);
    await page.keyboard.press("F2");
    await expect.poll(() => field.inputValue()).toBe("voltage");
    await field.fill("u");
    await field.press("Enter");
    await expect.poll(() => operations().at(-1)).toEqual({ do: "rename", path: "voltage", name: "u" });
    await page.keyboard.press("F2");
    await field.fill("");
    await field.press("Enter");
    await expect.poll(() => operations().at(-1)).toEqual({ do: "remove", path: "voltage" });
  });

  test("shows the lines that it became in generated code", async () => {
    await click(hand.middle("motor"));
    await page.keyboard.press("g");
    const code = page.getByRole("textbox", { name: "Generated code" });
    await code.locator(".cm-line").filter({ hasText: "law = 3;" }).waitFor();
    await expect.poll(() => code.locator(".cm-chosen").allInnerTexts()).toEqual(["    law = 3;", "    more = 4;"]);
    await page.getByRole("checkbox", { name: "chosen alone" }).check();
    await expect.poll(() => code.locator(".cm-line").allInnerTexts()).toEqual(["    // motor.law (Gain)", "    law = 3;", "    more = 4;"]);
    expect(await found_by_axe(page)).toEqual([]);
    await page.getByRole("checkbox", { name: "chosen alone" }).uncheck();
    await code.locator(".cm-line").filter({ hasText: "gain = 2" }).click();
    await page.getByRole("heading", { name: "gain", exact: true }).waitFor();
    await expect.poll(() => code.locator(".cm-chosen").allInnerTexts()).toEqual(["    gain = 2 * error;"]);
    await page.keyboard.type("x");
    expect(await code.innerText()).not.toContain("x");
    await page.getByRole("combobox", { name: "File" }).selectOption("motor.hpp");
    await code.locator(".cm-line").filter({ hasText: "class Motor;" }).waitFor();
    await page.getByRole("combobox", { name: "Language" }).selectOption("C");
    await page.getByRole("region", { name: "Generated code" }).getByText("motor (Subsystem)").waitFor();
  });

  test("stands in a list of variables that marks what breaks its limits", async () => {
    service.model.mistake = "variable 'supply' must be at least 30, but is 24";
    await page.reload();
    const field = page.getByRole("textbox", { name: "supply [V]" });
    await field.waitFor();
    expect(await field.getAttribute("aria-invalid")).toBe("true");
    await page.getByRole("region", { name: "Variables" }).getByText("must be at least 30").waitFor();
    expect(await found_by_axe(page)).toEqual([]);
  });
});
