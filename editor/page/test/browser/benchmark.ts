// Measures the page of a bf edit in Chromium: `node benchmark.ts open|edit|pan BF MODEL` prints seconds, and of
// `pan` those of the mean and of the longest frame. Times are taken in the page, so that the driver has no part in them.
import type { Browser, Page } from "playwright-core";
import { edited, is_there, start } from "./browser.ts";

/** The page answers a key by what the inspector says of the first block, 'c': it can be worked with. */
async function until_interactive(browser: Browser, address: string): Promise<{ page: Page; seconds: number }> {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  await page.addInitScript(() => {
    let is_asked = false;
    const look = (): void => {
      const is_there = document.querySelector('[role="option"][id^="element-"]') !== null, heading = document.querySelector("h1")?.textContent;
      if (is_there && !is_asked) is_asked = document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true, cancelable: true })) === false;
      if (heading === "c") Object.assign(globalThis, { interactive: performance.now() / 1000 });
      else requestAnimationFrame(look);
    };
    addEventListener("DOMContentLoaded", look);
  });
  await page.goto(address);
  const seconds = await page.waitForFunction(() => (globalThis as { interactive?: number }).interactive, undefined, { timeout: 60_000 });
  return { page, seconds: (await seconds.jsonValue())! };
}

/** From the operation to the badge that it deserves, and back. */
async function edit(page: Page): Promise<number> {
  await page.getByRole("button", { name: "✓ No mistakes" }).waitFor({ timeout: 30_000 });
  return page.evaluate(async () => {
    const taken: number[] = [];
    const until = async (is_so: () => boolean) => { while (!is_so()) await new Promise(requestAnimationFrame); };
    const has_badge = () => [...document.querySelectorAll('[role="option"]')].some((e) => e.textContent!.includes("mistake:"));
    const field = () => document.querySelector<HTMLInputElement>("input[id$='.value']");
    for (let i = 0; i < 10; ++i) {
      await until(() => field() !== null);
      for (const text of ["nothing_of_that_name", "0.5"]) {
        await new Promise((resolve) => setTimeout(resolve, 200)); // as a person does, who reads the field
        field()!.value = text;
        const before = performance.now();
        field()!.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
        await until(() => has_badge() === (text !== "0.5"));
        taken.push(performance.now() - before);
      }
    }
    return taken.sort((a, b) => a - b)[Math.floor(taken.length / 2)]! / 1000;
  });
}

async function pan(page: Page): Promise<string> {
  const box = (await page.locator("canvas").first().boundingBox())!, middle = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  await page.evaluate(() => {
    const frames: number[] = [];
    const tick = (time: number): void => {
      frames.push(time);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    Object.assign(globalThis, { frames });
  });
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down({ button: "middle" });
  const begin = Date.now();
  for (let angle = 0; Date.now() - begin < 3000; angle += 0.05)
    await page.mouse.move(middle.x + 60 * Math.sin(angle), middle.y + 60 * Math.cos(angle));
  const frames = await page.evaluate(() => (globalThis as unknown as { frames: number[] }).frames);
  await page.mouse.up({ button: "middle" });
  const taken = frames.slice(1).map((time, i) => (time - frames[i]!) / 1000);
  return `${taken.reduce((sum, t) => sum + t, 0) / taken.length} ${Math.max(...taken)}`;
}

const [what, bf, model] = process.argv.slice(2) as [string, string, string];
if (!is_there) process.exit(1);
const service = await edited(bf, model), browser = await start();
try {
  const { page, seconds } = await until_interactive(browser, service.address);
  console.log(what === "open" ? seconds : what === "edit" ? await edit(page) : await pan(page));
} finally {
  await browser.close();
  service.end();
}
