import { rename, writeFile } from "node:fs/promises";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { is_there, opened, start } from "./browser.ts";
import { Desk } from "./desk.ts";

const command = process.env.BF_COMMAND;
const soon = <T>(what: () => T) => expect.poll(what, { timeout: 8000 });
const text = `# A law.
model: law
step: 0.01
blocks:
  wanted: {block: Constant, value: 3}   # m
  law:
    inputs: [e]
    outputs: [u]
    blocks:
      gain: {block: Gain, K: 2}
    connections:
      e: gain
      gain: u
  scope: {block: Terminator}
connections:
  wanted: law.e
  law: scope
`;

describe.skipIf(!is_there || !command)("the text of a model", () => {
  let browser: Browser, desk: Desk, page: Page, file: string;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    ({ page, file } = desk = await Desk.open(browser, { "law.yaml": text }));
    await open(page);
  });
  afterEach(() => desk.close());

  async function open(one: Page): Promise<void> {
    await one.keyboard.press("y");
    await one.getByRole("textbox", { name: "Text of the model" }).waitFor();
    await one.getByText("written", { exact: true }).waitFor();
  }
  const sheet = (one = page) => one.getByRole("textbox", { name: "Text of the model" });
  const held = () => desk.text();
  const shown = async (one = page) => (await sheet(one).locator(".cm-line").allInnerTexts()).map((line) => line.replace(/\n$/, "")).join("\n");
  const says = (words: string | RegExp, one = page) => one.locator("section[aria-label='Text of the model'] [role=status]").filter({ hasText: words }).waitFor();
  const line = (words: string, one = page) => sheet(one).locator(".cm-line").filter({ hasText: words });
  /** As editors do. */
  async function write(wanted: string): Promise<void> {
    await writeFile(`${file}.new`, wanted);
    await rename(`${file}.new`, file);
  }
  /** Behind those words of a line. */
  async function type_behind(words: string, typed: string, one = page): Promise<void> {
    await line(words, one).click();
    await one.keyboard.press("End");
    const all = (await line(words, one).innerText()).replace(/\n$/, "");
    for (let i = all.indexOf(words) + words.length; i < all.length; ++i) await one.keyboard.press("ArrowLeft");
    await one.keyboard.type(typed);
  }

  test("stands beside the drawing, byte for byte, and is read alike by assistive technology", async () => {
    expect(await shown()).toBe(text);
    for (const colours of ["light", "dark"] as const) {
      await page.emulateMedia({ colorScheme: colours });
      expect(await found_by_axe(page)).toEqual([]);
    }
    await page.getByRole("button", { name: "Close the text" }).click();
    await sheet().waitFor({ state: "detached" });
  });

  test("shows the lines of what is chosen in the drawing, and the drawing what the cursor is at", async () => {
    await page.keyboard.press("ArrowRight");
    await page.getByRole("heading", { name: "wanted" }).waitFor();
    await soon(() => sheet().locator(".cm-chosen").allInnerTexts()).toEqual(["  wanted: {block: Constant, value: 3}   # m"]);
    await line("gain: {").click();
    await page.getByRole("heading", { name: "gain" }).waitFor();
    await page.getByRole("button", { name: "law", exact: true }).waitFor(); // it has opened the subsystem
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("ArrowDown");
    await page.getByRole("heading", { name: "e → gain" }).waitFor();
    await line("law:").first().click();
    await page.getByRole("heading", { name: "law" }).waitFor();
    await soon(() => sheet().locator(".cm-chosen").count()).toBe(8);
  });

  test("takes what is typed as an edit of the document, which its undo takes back", async () => {
    await type_behind("K: 2", "5");
    await soon(held).toBe(text.replace("K: 2", "K: 25"));
    await says("written");
    await page.keyboard.press("Control+z");
    await soon(held).toBe(text);
    await soon(() => shown()).toBe(text);
    await page.keyboard.press("Control+y");
    await soon(held).toBe(text.replace("K: 2", "K: 25"));
    await page.keyboard.press("Escape"); // to the drawing, where Delete removes
    await page.keyboard.press("Delete");
    await soon(() => shown()).not.toContain("Gain");
    expect(await held()).toBe(await shown());
  });

  test("keeps a text that is no model, says where it is wrong, and writes nothing", async () => {
    await type_behind("K: 2", "["); // the first key makes it no model: what is one for a while may be written while another is typed
    await says(/Not written: line \d+: /);
    expect(await held()).toBe(text);
    expect(await sheet().locator(".cm-lintRange-error, .cm-lintPoint-error").count()).toBeGreaterThan(0);
    await page.keyboard.press("Control+z"); // what is not in the document yet is taken back here
    await says("written");
    expect(await shown()).toBe(text);
    expect(await page.getByRole("button", { name: "Undo" }).isEnabled()).toBe(false);
  });

  test("marks mistakes of the model at their lines", async () => {
    await type_behind("K: 2", "*nothing");
    await soon(held).toContain("K: 2*nothing");
    await soon(() => line("K: 2*nothing").locator(".cm-lintRange-error").count()).toBe(1);
    await page.getByRole("button", { name: "1 mistake" }).waitFor();
  });

  test("takes over what others write meanwhile, from another page and from an editor", async () => {
    const other = await opened(browser, desk.address);
    await open(other.page);
    await type_behind("step: 0.01", ": [", other.page); // unfinished
    await says(/Not written/, other.page);
    await type_behind("K: 2", "5");
    await soon(() => shown(other.page)).toBe(text.replace("0.01", "0.01: [").replace("K: 2", "K: 25"));
    await write(text.replace("K: 2", "K: 25").replace("value: 3", "value: 4"));
    await soon(() => shown(other.page)).toBe(text.replace("0.01", "0.01: [").replace("K: 2", "K: 25").replace("value: 3", "value: 4"));
    for (let i = 0; i < 3; ++i) await other.page.keyboard.press("Backspace");
    await other.page.keyboard.type("2");
    await soon(held).toBe(text.replace("0.01", "0.012").replace("K: 2", "K: 25").replace("value: 3", "value: 4"));
    await soon(() => shown()).toBe(await held());
    expect(other.complaints).toEqual([]);
    await other.page.close();
  });

  test("asks who is right where both changed the same line", async () => {
    await type_behind("K: 2", "[");
    await says(/Not written/);
    await write(text.replace("K: 2", "K: 7"));
    await says("Not written: line 10 was changed elsewhere, too.");
    expect(await shown()).toBe(text.replace("K: 2", "K: 2["));
    await page.getByRole("button", { name: "Take the other" }).click();
    await soon(() => shown()).toBe(text.replace("K: 2", "K: 7"));
    await type_behind("K: 7", "[");
    await says(/Not written: line/);
    await write(text.replace("K: 2", "K: 8").replace("value: 3", "value: 4"));
    await says("Not written: line 10 was changed elsewhere, too.");
    await page.getByRole("button", { name: "Keep mine" }).click();
    await soon(() => shown()).toBe(text.replace("K: 2", "K: 7[").replace("value: 3", "value: 4"));
    await type_behind("K: 7[", "");
    await page.keyboard.press("Backspace");
    await page.keyboard.type("1");
    await soon(held).toContain("K: 71");
  });

  test("outlives the page where it stands in no file, which asks before it goes", async () => {
    const asked: string[] = [];
    page.on("dialog", (dialog) => {
      asked.push(dialog.type());
      void dialog.accept();
    });
    const again = async () => {
      await page.reload();
      await page.getByRole("status").filter({ hasText: "saved" }).waitFor();
      await page.keyboard.press("y");
      await sheet().waitFor();
    };
    await type_behind("K: 2", "[");
    await says(/Not written: line/);
    await again();
    expect(asked).toEqual(["beforeunload"]);
    await says("What was typed here before stands in no file.");
    expect(await shown()).toBe(text);
    await type_behind("step: 0.01", "7"); // nothing is typed before that is decided
    expect(await shown()).toBe(text);
    expect(await found_by_axe(page)).toEqual([]);
    await write(text.replace("value: 3", "value: 4")); // what others write meanwhile is taken over
    await soon(() => shown()).toContain("value: 4");
    await page.getByRole("button", { name: "Take it up" }).click();
    await soon(() => shown()).toBe(text.replace("K: 2", "K: 2[").replace("value: 3", "value: 4"));
    await says(/Not written: line/);
    await type_behind("K: 2[", "");
    await page.keyboard.press("Backspace");
    await page.keyboard.type("1");
    await soon(held).toContain("K: 21");
    await says("written");
    await again();
    expect(asked).toEqual(["beforeunload"]);
    await says("written");
    await type_behind("K: 21", "[");
    await says(/Not written: line/);
    await page.getByRole("button", { name: "Close the text" }).click(); // it is still there in this page
    await page.keyboard.press("y");
    await soon(() => shown()).toContain("K: 21[");
    await again();
    await page.getByRole("button", { name: "Discard it" }).click();
    await says("written");
    expect(await shown()).toContain("K: 21}");
    await again();
    await says("written");
    expect(asked).toEqual(["beforeunload", "beforeunload"]);
  });

  test("mends a file that another program broke", async () => {
    await write(text.replace("K: 2", "K: [2"));
    await soon(() => shown()).toContain("K: [2");
    await says(/line \d+/);
    await type_behind("K: [2", "]");
    await soon(held).toBe(text.replace("K: 2", "K: [2]"));
    await says("written");
  });
});
