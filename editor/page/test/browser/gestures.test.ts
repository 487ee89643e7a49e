import { found_by_axe } from "./axe.ts";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { serve } from "../service.ts";
import { Hand, is_there, opened, start } from "./browser.ts";

describe.skipIf(!is_there)("the page", () => {
  let browser: Browser, page: Page, complaints: string[], service: Awaited<ReturnType<typeof serve>>, hand: Hand;
  const operations = () => service.model.operations as any[];
  const until = (wanted: () => boolean) => expect.poll(wanted, { timeout: 5000 }).toBe(true);

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

  test("draws a wire from port to port, whichever comes first", async () => {
    await hand.drag(await hand.port("scope", "u"), await hand.port("motor", "omega"));
    await until(() => operations().length === 1);
    expect(operations()).toEqual([{ do: "connect", system: "", from: "motor", to: "scope" }]);
  });
  test("offers what fits where a wire ends on an empty place", async () => {
    await hand.drag(await hand.port("motor", "omega"), await hand.at({ x: 560, y: 150 }));
    await page.getByRole("option", { name: /^Gain/ }).waitFor();
    expect(await page.getByRole("option", { name: /^Step/ }).count()).toBe(0);
    await page.getByRole("option", { name: /^Gain/ }).click();
    await until(() => operations().length > 0);
    expect(operations()[0]).toMatchObject({ do: "batch", operations: [
      { do: "add", block: { name: "gain2", type: "Gain" } }, { do: "connect", from: "motor", to: "gain2" }] });
  });
  test("takes the end of a wire to another input, and off", async () => {
    await hand.drag(await hand.port("error", "u2"), await hand.port("scope", "u"));
    await until(() => operations().length > 0);
    expect(operations()[0]).toEqual({ do: "batch", operations: [
      { do: "disconnect", system: "", from: "motor", to: "error.u2" }, { do: "connect", system: "", from: "motor", to: "scope" }] });
    operations().length = 0;
    await hand.drag(await hand.port("scope", "u"), await hand.at({ x: 500, y: 150 }));
    await until(() => operations().length > 0);
    expect(operations()).toEqual([{ do: "disconnect", system: "", from: "motor", to: "scope" }]);
  });
  test("moves what is chosen, on the grid, in one step", async () => {
    const from = await hand.middle("gain"), to = await hand.at({ x: 310 + 33, y: 80 + 41 });
    await hand.drag(from, to);
    await until(() => operations().length > 0);
    expect(operations()).toEqual([{ do: "move", path: "gain", to: { x: 315, y: 100 } }]);
  });
  test("inserts a block where it is dropped on a wire, from the drawing and from the search", async () => {
    await page.keyboard.press("Control+k");
    await page.keyboard.type("gain");
    await page.keyboard.press("Enter"); // a block without wires
    await until(() => operations().length === 1);
    await hand.drag(await hand.middle("gain2"), await hand.at({ x: 250, y: 84 }));
    await until(() => operations().length > 1);
    expect(operations().slice(1)[0]).toMatchObject({ do: "batch", operations: [{ do: "move", path: "gain2" },
      { do: "disconnect", from: "error", to: "gain" }, { do: "connect", from: "error", to: "gain2" }, { do: "connect", from: "gain2", to: "gain" }] });
    operations().length = 0;
    const wire = await hand.at({ x: 370, y: 84 });
    await page.keyboard.press("Control+k");
    await page.keyboard.type("discint");
    const option = (await page.getByRole("option", { name: /^DiscreteIntegrator/ }).boundingBox())!;
    await hand.drag({ x: option.x + 40, y: option.y + 10 }, wire);
    await until(() => operations().length > 0);
    expect(operations()[0]).toMatchObject({ do: "batch", operations: [{ do: "add", block: { name: "discreteIntegrator" }, at: { y: 80 - 20 } },
      { do: "disconnect", from: "gain", to: "motor" }, { do: "connect", from: "gain", to: "discreteIntegrator" },
      { do: "connect", from: "discreteIntegrator", to: "motor" }] });
  });
  test("inserts into the chosen wire by keys", async () => {
    const wire = await hand.at({ x: 370, y: 79 });
    await page.mouse.click(wire.x, wire.y);
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Insert into the wire" }).fill("gain");
    expect(await page.getByRole("option", { name: /^Step/ }).count()).toBe(0);
    await page.keyboard.press("Enter");
    await until(() => operations().length > 0);
    expect(operations()[0].operations.map((o: any) => o.do)).toEqual(["add", "disconnect", "connect", "connect"]);
  });
  test("bends a wire by the pointer and by keys, and lets it find its way again", async () => {
    const from = await hand.at({ x: 355, y: 80 }), to = await hand.at({ x: 355, y: 106 });
    await hand.drag(from, to);
    await until(() => operations().length === 1);
    expect(operations()[0]).toMatchObject({ do: "bend", path: "motor.voltage" });
    const points = operations()[0].points as { x: number; y: number }[];
    expect(points.map((p) => p.y)).toEqual([80, 105, 105, 76]);
    await page.keyboard.press("Shift+ArrowDown");
    await until(() => operations().length === 2);
    expect(operations()[1]).toMatchObject({ do: "bend", path: "motor.voltage" });
    await page.keyboard.press("Alt+w");
    await until(() => operations().length === 3);
    expect(operations()[2]).toEqual({ do: "bend", path: "motor.voltage", points: [] });
  });
  test("resizes a block by its handles and by keys", async () => {
    const middle = await hand.middle("gain");
    await page.mouse.click(middle.x, middle.y);
    await hand.drag(await hand.at({ x: 340, y: 100 }), await hand.at({ x: 360, y: 130 }));
    await until(() => operations().length > 0);
    expect(operations()[0]).toEqual({ do: "batch", operations: [
      { do: "move", path: "gain", to: { x: 280, y: 60 } }, { do: "resize", path: "gain", size: { x: 80, y: 70 } }] });
    operations().length = 0;
    await page.keyboard.press("Alt+Shift+ArrowRight");
    await until(() => operations().length > 0);
    expect(operations()[0]).toEqual({ do: "resize", path: "gain", size: { x: 70, y: 40 } });
  });
  test("adds, edits, moves and removes a note", async () => {
    await page.keyboard.press("Control+k");
    await page.keyboard.type("note");
    await page.keyboard.press("Enter");
    const field = page.getByRole("textbox", { name: "Text of note" });
    await field.fill("the law");
    await field.press("Control+Enter");
    await until(() => operations().length === 2);
    expect(operations()[1]).toMatchObject({ do: "annotate", name: "note", note: { name: "note", text: "the law", system: "" } });
    const before = operations()[1].note.at;
    await page.keyboard.press("Shift+ArrowRight");
    await until(() => operations().length === 3);
    expect(operations()[2].note.at).toEqual({ x: before.x + 10, y: before.y });
    await page.keyboard.press("Delete");
    await until(() => operations().length === 4);
    expect(operations()[3]).toEqual({ do: "annotate", name: "note" });
  });
  test("aligns and distributes what is chosen", async () => {
    await page.keyboard.press("Control+a");
    await page.keyboard.press("Alt+ArrowDown");
    await until(() => operations().length > 0);
    const lower = new Set(operations()[0].operations.map((o: any) => o.to.y + (o.path === "error" ? 48 : 40)));
    expect(lower).toEqual(new Set([104]));
    operations().length = 0;
    await page.getByRole("button", { name: "Distribute horizontally" }).click();
    await until(() => operations().length > 0);
    expect(operations()[0].operations.map((o: any) => o.to.x)).toEqual([40, 165, 290, 415, 540]);
  });
  test("chooses by a rubber band, and moves all of it", async () => {
    await hand.drag(await hand.at({ x: 130, y: 10 }), await hand.at({ x: 360, y: 150 }));
    await page.getByRole("heading", { name: /elements/ }).waitFor();
    await page.keyboard.press("Shift+ArrowDown");
    await until(() => operations().length > 0);
    expect(operations()[0].operations.map((o: any) => o.path).sort()).toEqual(["error", "gain"]);
  });
  test("inserts by a double click, renames and removes by keys", async () => {
    const empty = await hand.at({ x: 460, y: 140 });
    await page.mouse.dblclick(empty.x, empty.y);
    await page.keyboard.type("discint");
    await page.keyboard.press("Enter");
    await until(() => operations().length === 1);
    await page.getByRole("heading", { name: "discreteIntegrator" }).waitFor();
    await page.keyboard.press("F2");
    await page.keyboard.type("speed");
    await page.keyboard.press("Enter");
    await until(() => operations().length === 2);
    await page.getByRole("heading", { name: "speed" }).waitFor();
    await page.keyboard.press("Delete");
    await until(() => operations().length === 3);
    expect(operations().map((o) => o.do)).toEqual(["add", "rename", "remove"]);
  });
  test("connects by keys alone", async () => {
    await page.keyboard.press("Tab"); // whatever has the focus, letters are for the drawing
    await page.keyboard.press("c");
    await page.keyboard.type("motor scope");
    await page.keyboard.press("Enter");
    await until(() => operations().length === 1);
    expect(operations()).toEqual([{ do: "connect", system: "", from: "motor", to: "scope" }]);
  });
  test("opens a subsystem by a double click and leaves it by Escape", async () => {
    const motor = await hand.middle("motor");
    await page.mouse.dblclick(motor.x, motor.y);
    await page.getByRole("button", { name: "motor", exact: true }).waitFor();
    expect(await page.getByRole("option", { name: /input/ }).count()).toBe(1);
    await page.keyboard.press("Escape");
    await expect.poll(() => page.getByRole("option", { name: /block gain/ }).count()).toBe(1);
  });
  test("changes a setting by typing, and nothing where nothing was changed", async () => {
    const gain = await hand.middle("gain");
    await page.mouse.click(gain.x, gain.y);
    const field = page.getByRole("textbox", { name: "K [V*s/rad]" });
    await field.click();
    await field.press("Enter");
    await field.fill("2*Gain.Kp");
    await field.press("Enter");
    await until(() => operations().length === 1);
    expect(operations()).toEqual([{ do: "set", path: "gain", name: "K", value: "2*Gain.Kp" }]);
  });
  test("does not ask again by leaving for what was refused, and says that file and page differ", async () => {
    service.model.refusal = service.model.failure = "another program has written into the file";
    await page.reload();
    await page.getByRole("button", { name: "File and page differ" }).waitFor();
    await page.getByRole("status").filter({ hasText: "not saved" }).waitFor();
    const gain = await hand.middle("gain");
    await page.mouse.click(gain.x, gain.y);
    const field = page.getByRole("textbox", { name: "K [V*s/rad]" });
    await field.fill("4");
    await field.press("Enter");
    await page.getByRole("alert").filter({ hasText: "another program" }).nth(1).waitFor();
    service.model.refusal = "";
    const variable = page.getByLabel("supply [V]", { exact: true });
    await variable.click(); // elsewhere
    expect(await field.inputValue()).toBe("Gain.Kp");
    await variable.fill("12");
    await page.getByRole("combobox").first().focus(); // leaving what was not refused sets it
    await until(() => operations().length > 0);
    expect(operations()).toEqual([expect.objectContaining({ do: "set_variable", name: "supply" })]);
  });
  test("shows the run's value again where another one is refused, so that it cannot be kept", async () => {
    await page.keyboard.press("s");
    const field = page.getByLabel("supply of the run, as a number");
    await field.fill("30");
    await field.press("Enter");
    await page.getByRole("button", { name: "Keep" }).waitFor();
    await field.fill("100");
    await field.press("Enter");
    await page.getByRole("alert").filter({ hasText: "'supply' is at most 50" }).waitFor();
    await expect.poll(() => field.inputValue()).toBe("30");
    await page.getByRole("button", { name: "Keep" }).click();
    await until(() => operations().length > 0);
    expect(operations()).toMatchObject([{ do: "set_variable", name: "supply", variable: { value: "30" } }]);
  });
  test("leads to the sliders of variables before anything runs", async () => {
    await page.keyboard.press("Control+k");
    await page.keyboard.type("slider");
    await page.getByRole("option", { name: /^Sliders of variables/, selected: true }).waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "begin one" }).click();
    await page.getByLabel("supply of the run", { exact: true }).waitFor();
    expect(await page.getByRole("button", { name: "begin one" }).count()).toBe(0);
  });
  test("chooses the block whose port is pressed", async () => {
    const gain = await hand.middle("gain"), port = await hand.port("motor", "omega");
    await page.mouse.click(gain.x, gain.y);
    await page.mouse.click(port.x, port.y);
    await page.getByRole("heading", { name: "motor" }).waitFor();
    await page.keyboard.press("F2");
    await page.getByRole("textbox", { name: "Name of motor" }).waitFor();
  });
  test("takes a tool tip away with what it tells of", async () => {
    const port = await hand.port("motor", "omega");
    await page.mouse.move(port.x, port.y);
    await page.getByRole("tooltip").waitFor();
    await page.keyboard.press("Control+a");
    await page.keyboard.press("Delete");
    await page.getByRole("tooltip").waitFor({ state: "detached" });
  });
  test("has the chosen colours whatever those of the system are", async () => {
    const ground = () => page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor.match(/\d+/g)!.map(Number)[0]!);
    for (const system of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: system });
      for (const [choice, is_dark] of [["light", false], ["dark", true], ["system", system === "dark"]] as const) {
        await page.getByRole("button", { name: /^Colours:/ }).click();
        await page.getByRole("button", { name: `Colours: ${choice}` }).waitFor();
        expect([system, choice, (await ground()) < 128]).toEqual([system, choice, is_dark]);
      }
    }
  });
  test("shows the dialog of keys from its beginning", async () => {
    await page.setViewportSize({ width: 1000, height: 420 });
    await page.keyboard.press("?");
    const dialog = page.getByRole("dialog", { name: "Keys and pointer" });
    await dialog.waitFor();
    expect(await dialog.evaluate((element) => [element.scrollTop, element.scrollHeight > element.clientHeight])).toEqual([0, true]);
  });
  test("tells what a setting comes to while it is typed, and changes nothing before Enter", async () => {
    const gain = await hand.middle("gain");
    await page.mouse.click(gain.x, gain.y);
    const field = page.getByRole("textbox", { name: "K [V*s/rad]" });
    await field.fill("2*Gain.Kp");
    await page.getByText("= 0.2", { exact: true }).waitFor();
    await field.fill("nothing");
    await page.getByText("unknown variable 'nothing'").waitFor();
    expect(await field.getAttribute("aria-invalid")).toBe("true");
    await field.press("Escape");
    await page.getByText("unknown variable 'nothing'").waitFor({ state: "detached" });
    expect(operations()).toEqual([]);
  });
  test("sets what was typed into a field that goes, since another block is shown in its place", async () => {
    const gain = await hand.middle("gain");
    await page.mouse.click(gain.x, gain.y);
    await page.getByRole("heading", { name: "gain", exact: true }).waitFor();
    await page.getByRole("textbox", { name: "K [V*s/rad]" }).fill("2*Gain.Kp");
    await page.getByText("= 0.2", { exact: true }).waitFor();
    service.edit_beside({ do: "remove", path: "gain" });
    await until(() => operations().length === 2);
    expect(operations().slice(1)).toEqual([{ do: "set", path: "gain", name: "K", value: "2*Gain.Kp" }]);
  });
  test("mends a mistake at its badge, in the list and by keys", async () => {
    const mended = { do: "connect", system: "", from: "motor", to: "scope" };
    const { bounds } = await hand.element("scope"), badge = await hand.at({ x: bounds.x + bounds.width, y: bounds.y });
    await page.mouse.click(badge.x, badge.y);
    await page.getByRole("option", { name: /Connect 'motor' to 'scope'/ }).click();
    await until(() => operations().length === 1);
    expect(operations()[0]).toEqual(mended);
    service.model.wires.pop();
    await page.reload();
    await page.getByRole("button", { name: "1 mistake" }).click();
    await page.getByRole("button", { name: "Connect 'motor' to 'scope'" }).click();
    await until(() => operations().length === 2);
    service.model.wires.pop();
    await page.reload();
    await page.getByRole("button", { name: "1 mistake" }).waitFor();
    await page.keyboard.press("Control+.");
    await page.keyboard.press("Enter");
    await until(() => operations().length === 3);
    expect(operations()[2]).toEqual(mended);
  });
  test("finds what stands anywhere in the model, and goes there", async () => {
    await page.keyboard.press("Control+f");
    await page.keyboard.type("moto");
    await page.getByRole("option", { name: /^motor/ }).waitFor();
    await page.keyboard.press("Enter");
    await page.getByRole("heading", { name: "motor" }).waitFor();
  });
  test("goes to the block of a mistake", async () => {
    await page.getByRole("button", { name: "1 mistake" }).click();
    await page.getByRole("button", { name: /input 'u' is not connected/ }).click();
    await page.getByRole("heading", { name: "scope" }).waitFor();
  });
  test("shows values of a run on the drawing and in a plot", async () => {
    await page.keyboard.press("p");
    await page.getByRole("button", { name: "Pause" }).waitFor();
    const wire = await hand.at({ x: 250, y: 84 });
    await page.mouse.click(wire.x, wire.y);
    await page.getByRole("button", { name: "Signals (1)" }).click();
    await expect.poll(() => page.getByRole("list", { name: "Watched signals" }).textContent()).toMatch(/error.*\d/);
    await page.getByRole("button", { name: "Plot", exact: true }).click();
    await page.getByRole("application", { name: "Plot panel 1 of error.y" }).waitFor();
  });
  test("connects again by itself, and says so meanwhile", async () => {
    service.drop();
    await page.getByText("The connection to bf edit is lost").waitFor();
    await page.getByText("The connection to bf edit is lost").waitFor({ state: "detached" });
    await page.keyboard.press("Control+k");
    await page.keyboard.type("gain");
    await page.keyboard.press("Enter");
    await until(() => operations().length === 1);
  });
  test("is in order for assistive technology, in light and dark, with dialogs", async () => {
    for (const colours of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: colours });
      for (const key of ["", "Control+k", "?"]) {
        if (key) await page.keyboard.press(key);
        expect(await found_by_axe(page)).toEqual([]);
        if (key) await page.keyboard.press("Escape");
      }
    }
    await page.getByRole("button", { name: "1 mistake" }).click();
    await page.getByRole("button", { name: "colours", exact: true }).click();
    await page.getByRole("button", { name: "map", exact: true }).click();
    await page.getByRole("list", { name: "Colours of rates" }).getByText("continuous").waitFor();
    expect(await found_by_axe(page)).toEqual([]);
  });
});
