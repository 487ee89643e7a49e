// Pages as they are to look, in test/browser/pictures. BF_STORE_PICTURES=FOLDER writes those of now there, to be looked at
// before they are kept.
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { existsSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { found_by_axe } from "./axe.ts";
import { edited, is_there, opened, start } from "./browser.ts";
import { go_to } from "./desk.ts";

const command = process.env.BF_COMMAND, store = process.env.BF_STORE_PICTURES, source = process.env.BF_SOURCE!;
const has_robots = command !== undefined && existsSync(join(dirname(command), "../lib/blockfactory/WholeBodyToolbox.so"));
const kept = join(import.meta.dirname, "pictures");
/** Edges of letters differ a little between versions of the browser; what has another place or colour differs more. */
const most = 0.004; // of all pixels

const phases = `model: phases
step: 0.01
stop: 4
blocks:
  go: {block: Step, time: 1}
  phases: {block: StateMachine, states: "{'rest', 'lift', 'walk'}", transitions: "[1 2 1 0; 2 3 0 0.6; 3 1 0 1.2]"}
  speed: {block: Gain, K: 0.5}
connections:
  go: phases.conditions
  phases.state: speed
layout:
  displays:
    phase: {shows: states, signals: [phases.state]}
    speed: {shows: lines, signals: [speed]}
`;

describe.skipIf(!is_there || !command || !source)("the page looks as it did:", () => {
  let browser: Browser, page: Page, complaints: string[], folder: string, bf: Awaited<ReturnType<typeof edited>>;

  beforeAll(async () => void (browser = await start()));
  afterAll(() => browser.close());
  afterEach(async () => {
    await page.close();
    bf.end();
    await rm(folder, { recursive: true });
    expect(complaints).toEqual([]);
  });

  async function open(model: string, options: BrowserContextOptions = {}): Promise<void> {
    folder = await mkdtemp(join(tmpdir(), "bf-page-"));
    const file = join(folder, "model.yaml");
    if (model.includes("\n")) await writeFile(file, model);
    else await cp(dirname(join(source, model)), folder, { recursive: true });
    bf = await edited(command!, model.includes("\n") ? file : join(folder, model.split("/").at(-1)!));
    ({ page, complaints } = await opened(browser, bf.address, { viewport: { width: 1000, height: 640 }, ...options }));
    await page.getByRole("button", { name: /No mistakes|mistake/ }).waitFor({ timeout: 20_000 });
  }
  /** A run to an instant: the same numbers each time. */
  async function run_to(time: number): Promise<void> {
    await page.getByRole("button", { name: "One step" }).click();
    await go_to(page, time);
    await page.waitForTimeout(500);
  }
  /** How many of all pixels of two pictures differ so that a person would see it. */
  const difference = (a: string, b: string): Promise<number> => page.evaluate(async (urls) => {
    const [one, other] = await Promise.all(urls.map(async (url) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext("2d")!;
      context.drawImage(image, 0, 0);
      return context.getImageData(0, 0, image.width, image.height);
    }));
    if (one!.width !== other!.width || one!.height !== other!.height) return 1;
    let count = 0;
    for (let i = 0; i < one!.data.length; i += 4)
      if ([0, 1, 2].some((c) => Math.abs(one!.data[i + c]! - other!.data[i + c]!) > 60)) ++count;
    return (4 * count) / one!.data.length;
  }, [a, b].map((picture) => `data:image/png;base64,${picture}`));

  async function looks_like(name: string): Promise<void> {
    await page.mouse.move(500, 600);
    await page.evaluate(() => document.fonts.ready);
    let now = await page.screenshot({ animations: "disabled" });
    for (let before: Buffer = Buffer.alloc(0); !now.equals(before); ) { // until nothing comes any more
      before = now;
      await page.waitForTimeout(400);
      now = await page.screenshot({ animations: "disabled" });
    }
    expect(await found_by_axe(page)).toEqual([]);
    if (store) {
      await mkdir(store, { recursive: true });
      return writeFile(join(store, `${name}.png`), now);
    }
    const found = await difference((await readFile(join(kept, `${name}.png`))).toString("base64"), now.toString("base64"));
    if (found >= most) await writeFile(join(tmpdir(), `bf-${name}.png`), now);
    expect(found, `${name}: see ${join(tmpdir(), `bf-${name}.png`)}`).toBeLessThan(most);
  }

  test("a motor", async () => {
    await open("docs/start/motor.yaml");
    await looks_like("motor");
  });
  test("a motor in the dark, with rates by colour, sizes and a map", async () => {
    await open("docs/start/motor.yaml", { colorScheme: "dark" });
    for (const name of ["colours", "sizes", "map"]) await page.getByRole("button", { name, exact: true }).click();
    await looks_like("dark");
  });
  test("a subsystem, with a block that is chosen", async () => {
    await open("docs/start/motor.yaml");
    await page.getByLabel("Elements of the model").focus();
    await page.keyboard.press("Control+f");
    await page.keyboard.type("proportional");
    await page.getByRole("option", { name: /^controller.proportional/ }).first().click();
    await page.getByRole("heading", { name: "proportional" }).waitFor();
    await looks_like("subsystem");
  });
  test("panels of a run", async () => {
    await open("docs/start/motor.yaml");
    await run_to(0.9);
    await looks_like("panels");
  });
  test("a state machine", async () => {
    await open(phases);
    await run_to(1.3);
    await looks_like("states");
  });
  test("mistakes", async () => {
    await open((await readFile(join(source, "docs/start/motor.yaml"), "utf8")).replace("K: Gain.Kp", "K: Gain.Kpp").replace("      speed: error.u2\n", ""));
    await page.getByRole("button", { name: /mistake/ }).click();
    await looks_like("mistakes");
  });
  test.skipIf(!has_robots)("the palette, which finds blocks of the toolbox, too", async () => {
    await open("docs/start/motor.yaml");
    await page.keyboard.press("Control+k");
    await page.keyboard.type("integrat");
    await page.getByRole("option", { name: /^Integrator/ }).first().waitFor();
    await looks_like("palette");
  });
  test("the text beside the drawing", async () => {
    await open("docs/start/motor.yaml");
    await page.keyboard.press("y");
    await page.getByRole("textbox", { name: "Text of the model" }).waitFor();
    await page.keyboard.press("ArrowRight");
    await looks_like("text");
  });
  test("all of it at 200 %", async () => {
    await open("docs/start/motor.yaml", { viewport: { width: 640, height: 400 }, deviceScaleFactor: 2 });
    await looks_like("zoomed");
  });
  test.skipIf(!has_robots)("a humanoid's controller", async () => {
    await open("examples/icub_balancing/balancing.yaml");
    await page.getByRole("button", { name: "Close the robot's view" }).click({ timeout: 20_000 });
    await page.getByRole("option", { name: /not wired: .*s_dot/ }).first().waitFor({ state: "attached" }); // ports are known
    await page.keyboard.press("f");
    complaints.splice(0); // it has no WebGL here
    await looks_like("icub");
  });
});
