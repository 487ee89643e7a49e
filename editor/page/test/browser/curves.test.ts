import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import { is_there, opened, place_of, start } from "./browser.ts";
import { Desk, go_to } from "./desk.ts";

const command = process.env.BF_COMMAND;
const soon = <T>(what: () => T) => expect.poll(what, { timeout: 20_000 });
/** 400 000 steps: the time, and a pulse of one step every 50 s from 20 s on; both are much faster simulated than they can be shown. */
const model = `model: fast
step: 0.001
stop: 400
blocks:
  one: {block: Constant, value: 1}
  time: {block: DiscreteIntegrator}
  spike: {block: Pulse, cycle: 50, width: 0.002, delay: 19.9995, amplitude: 0.0012}
  end: {block: Terminator}
connections: {one: time, spike: end}
plots:
  Time: [time]
  Spikes: [spike]
`;

describe.skipIf(!is_there || !command)("curves of a fast run", () => {
  let browser: Browser, desk: Desk, page: Page;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  beforeEach(async () => {
    ({ page } = desk = await Desk.open(browser, { "fast.yaml": model }));
    await page.getByRole("button", { name: "✓ No mistakes" }).waitFor();
    await page.getByRole("button", { name: "Signals" }).click();
    await page.getByLabel("Speed").selectOption("fast");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await soon(() => page.getByLabel("Instant in s").inputValue()).toBe("400.000");
  });
  afterEach(() => desk.close());
  const legend = (name: string, on = page) => on.getByRole("list", { name: `Values of ${name}` });
  /** Columns of a panel in which its curve stands above the middle. */
  const peaks = (name: string, on = page): Promise<number> => on.getByRole("region", { name: `Panel ${name}` }).locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
    const { width, height } = canvas, { data } = canvas.getContext("2d")!.getImageData(0, 0, width, height);
    let found = 0, was_high = false;
    for (let x = 60; x < width - 14; ++x) {
      let is_high = false;
      for (let y = 12; y < height / 2; ++y) {
        const at = 4 * (y * width + x), [r, g, b] = [data[at]!, data[at + 1]!, data[at + 2]!];
        if (data[at + 3]! > 100 && b > 1.6 * r && b > 1.2 * g) is_high = true; // the first colour of a panel
      }
      if (is_high && !was_high) ++found;
      was_high = is_high;
    }
    return found;
  });

  test("hold every peak, and show beside them what holds at the end and at the pointer", async () => {
    await soon(() => peaks("Spikes")).toBe(8);
    await soon(() => legend("Time").textContent()).toMatch(/time\s*400\s*$/);
    await go_to(page, 400);
    const plot = page.getByRole("application", { name: /^Plot Time of/ }), box = await place_of(plot);
    const right = box.x + box.width / 2, y = box.y + box.height / 2;
    await page.mouse.move(right, y);
    await page.waitForTimeout(200);
    await page.mouse.click(right, y); // marks it
    for (const left of [2, 17, 31, 50, 77]) {
      await page.mouse.move(right - left, y);
      // The signal is the time: it differs as much as the instants do, to one step for each of them.
      await soon(async () => {
        const [span, difference] = /Δt −?([\d.]+) s.*Δ −?([\d.]+)/.exec((await legend("Time").textContent())!)?.slice(1).map(Number) ?? [];
        return Math.abs(span! - difference!) < 0.0051; // of four digits
      }).toBe(true);
    }
    // A span with one peak alone, which is still there.
    const at = (time: number) => box.x + 53 + (time / 400) * (box.width - 65);
    const wait = () => page.waitForTimeout(100); // the plot hears of it with the next picture
    await page.mouse.move(at(200), box.y + 30);
    await wait();
    await page.mouse.down();
    await page.mouse.move(at(225), box.y + 40);
    await wait();
    await page.mouse.move(at(240), box.y + 40);
    await wait();
    await page.mouse.up();
    await soon(() => peaks("Spikes")).toBe(1);
  });

  test("are the same in a page that is opened later", async () => {
    await soon(() => peaks("Spikes")).toBe(8);
    const { page: other, complaints } = await opened(browser, desk.address);
    await other.getByRole("button", { name: "Signals", exact: true }).or(other.getByRole("list", { name: "Watched signals" })).first().waitFor();
    await soon(() => peaks("Spikes", other)).toBe(8);
    await soon(() => legend("Time", other).textContent()).toMatch(/time\s*400\s*$/);
    expect(await other.getByText("There is no such signal in the run.").count()).toBe(0);
    expect(complaints).toEqual([]);
    await other.close();
  });
});
