import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import type { PanelInfo } from "../../src/protocol.ts";
import { Model, serve } from "../service.ts";
import { found_by_axe } from "./axe.ts";
import { Hand, is_there, opened, place_of, start } from "./browser.ts";
import { instant } from "./desk.ts";

const panel = (name: string, shows: PanelInfo["shows"], signals: string[]): PanelInfo => ({ name, shows, signals, is_kept: true });

describe.skipIf(!is_there)("panels", () => {
  let browser: Browser, page: Page, complaints: string[], service: Awaited<ReturnType<typeof serve>>, hand: Hand;
  const operations = () => service.model.operations as any[];
  const shown = (name: string): Locator => page.getByRole("region", { name: `Panel ${name}`, exact: true });

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  async function open(...panels: PanelInfo[]): Promise<void> {
    const model = new Model();
    model.panels = panels;
    service = await serve(process.env.BF_PAGE ?? "dist", 0, model);
    ({ page, complaints } = await opened(browser, `http://127.0.0.1:${service.port}/?token=x`));
    hand = new Hand(page, async () => service.model.draw("", []));
    await page.keyboard.press("p");
  }
  const ended = () => expect.poll(() => instant(page), { timeout: 8000 }).toBe(1.2);
  afterEach(async () => {
    await page.close();
    service.drop();
    service.server.close();
    expect(complaints).toEqual([]);
  });

  test("open with the run, each as it is kept, and read alike by assistive technology", async () => {
    await open(panel("error", "lines", ["error.y", "motor.x"]), panel("phase", "xy", ["error.y", "motor.x"]), panel("both", "bars", ["motor.x"]),
      panel("J", "heat_map", ["law.J"]), panel("now", "numbers", ["motor.x", "phases.state"]), panel("phases", "states", ["phases.state"]));
    await ended();
    await page.getByRole("application", { name: "Plot error of error.y, motor.x[i], motor.x[omega]" }).waitFor();
    await page.getByRole("img", { name: "Plot phase of motor.x[i], motor.x[omega] against error.y" }).waitFor();
    const bars = await page.getByRole("list", { name: "Bars of both" }).getByRole("listitem").allInnerTexts();
    expect(bars.map((text) => text.replace(/\s+/g, " "))).toEqual(["motor.x[i] 1.2 A", "motor.x[omega] −1.2 A"]);
    const cells = await page.getByRole("table", { name: "law.J in J" }).locator("tr").allInnerTexts();
    expect(cells.map((row) => row.split(/\s+/))).toEqual([["1", "3", "5"], ["2", "−4", "6"]]); // column by column
    expect(await shown("now").locator("dd").allInnerTexts()).toEqual([expect.stringMatching(/1\.2\s+−1\.2\s+A/), expect.stringMatching(/^walk/)]);
    await page.getByRole("img", { name: "States of phases; now walk" }).waitFor();
    expect(await shown("phases").locator("path.arrow").count()).toBe(2);
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("take a wire that is drawn into them, and a signal of the list", async () => {
    await open(panel("a", "lines", []));
    const box = (await shown("a").boundingBox())!;
    await hand.drag(await hand.at({ x: 250, y: 84 }), { x: box.x + box.width / 2, y: box.y + box.height / 2 });
    await expect.poll(() => operations()).toEqual([
      { do: "watch", name: "a", display: { name: "a", shows: "lines", signals: [{ path: "error.y" }] } }]);
    await page.getByRole("application", { name: "Plot a of error.y" }).waitFor();
    await page.getByRole("button", { name: /signals of a$/ }).click();
    await page.getByRole("combobox", { name: "Add a signal to a" }).fill("law.J");
    await page.getByRole("combobox", { name: "Add a signal to a" }).press("Enter");
    await expect.poll(() => operations().at(-1).display.signals).toEqual([{ path: "error.y" }, { path: "law.J" }]);
    await page.getByRole("button", { name: "Take error.y off a" }).click();
    await expect.poll(() => operations().at(-1).display.signals).toEqual([{ path: "law.J" }]);
    await page.getByLabel("What a shows").selectOption("heat_map");
    await expect.poll(() => operations().at(-1).display.shows).toBe("heat_map");
    await page.getByLabel("Name of the panel a").fill("J");
    await page.getByLabel("Name of the panel a").press("Enter");
    await expect.poll(() => operations().at(-1)).toMatchObject({ name: "a", display: { name: "J" } });
    await page.getByRole("button", { name: "Remove the panel J" }).click();
    await expect.poll(() => operations().at(-1)).toEqual({ do: "watch", name: "J" });
  });

  test("stand beneath the drawing, over which the time of each block lies on demand", async () => {
    await open();
    await ended();
    await page.keyboard.press("t");
    const times = page.getByRole("list", { name: "Time of blocks in the run" });
    await expect.poll(async () => (await times.getByRole("listitem").allInnerTexts()).map((text) => text.replace(/\s+/g, " ").trim()))
      .toEqual(["gain 75 % 3 µs", "motor 25 % 1 µs"]);
    expect(await found_by_axe(page)).toEqual([]);
    await page.getByRole("button", { name: "time", exact: true }).click();
    await times.waitFor({ state: "detached" });
  });

  test("zoom together by pointer and keys, and measure between a mark and the pointer", async () => {
    await open(panel("a", "lines", ["motor.x"]), panel("b", "lines", ["error.y"]));
    await ended();
    const plot = page.getByRole("application", { name: /^Plot a of/ }), over = plot.locator(".u-over");
    const box = await place_of(over);
    const ticks = async (name: string) => (await shown(name).screenshot()).toString("base64");
    const whole = await ticks("b");
    await hand.drag({ x: box.x + box.width * 0.25, y: box.y + 20 }, { x: box.x + box.width * 0.5, y: box.y + 20 });
    await expect.poll(() => ticks("b")).not.toBe(whole);
    await page.mouse.move(0, 0);
    await page.mouse.move(box.x + box.width / 2, box.y + 30); // of 0.3 to 0.6 s: 0.45 s
    const legend = page.getByRole("list", { name: "Values of a" });
    await expect.poll(async () => Number(/motor\.x\[i\]\s*([\d.]+)/.exec(await legend.innerText())?.[1])).toBeCloseTo(0.44, 1);
    await page.mouse.click(box.x + box.width / 2, box.y + 30);
    await page.mouse.move(box.x + box.width * 0.9, box.y + 30);
    await expect.poll(async () => Number(/Δt\s*([\d.]+)/.exec(await legend.innerText())?.[1])).toBeCloseTo(0.12, 1);
    await plot.focus();
    await page.keyboard.press("m"); // takes the mark away
    await page.keyboard.press("0");
    await page.mouse.move(0, 0);
    await page.getByRole("application", { name: /^Plot b of/ }).focus();
    await page.mouse.move(0, 0);
    await page.keyboard.press("+");
    await page.keyboard.press("-");
    expect(await found_by_axe(page)).toEqual([]);
  });
});
