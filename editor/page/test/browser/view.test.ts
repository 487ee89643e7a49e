import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import type { Client } from "../../src/client.ts";
import { Stage } from "../../src/stage.svelte.ts";
import { found_by_axe } from "./axe.ts";
import { edited, is_there, opened, start } from "./browser.ts";
import { connected, go_to, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
const has_robots = command !== undefined && existsSync(join(dirname(command), "../lib/blockfactory/WholeBodyToolbox.so"));
/** A robot that is a ball and falls freely from 3 m, and a box that lies on the floor. */
const urdf = `<robot name="ball"><link name="shell"><inertial><mass value="1"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><sphere radius="0.1"/></geometry></visual></link></robot>`;
const world = `<world><floor/>
  <robot name="ball" file="ball.urdf" base="floating" position="0 0 3"/>
  <box name="box" size="0.2 0.2 0.2" mass="1" position="0.5 0 0.1"/></world>`;
const model = `model: falling
plugins: [WholeBodyToolbox]
step: 0.001
stop: 0.5
blocks:
  world: {block: WholeBodyToolbox/World, file: "'world.xml'"}
  ball: {block: WholeBodyToolbox/WorldRobot, robot: "'ball'"}
`;

describe.skipIf(!is_there || !has_robots)("bf view", () => {
  let browser: Browser, page: Page, complaints: string[], folder: string, bf: Awaited<ReturnType<typeof edited>>, client: Client, seen: Stage, view: Locator;

  beforeAll(async () => void (browser = await start(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])));
  afterAll(() => browser.close());
  beforeEach(async () => {
    folder = await mkdtemp(join(tmpdir(), "bf-page-"));
    await writeFile(join(folder, "ball.urdf"), urdf);
    await writeFile(join(folder, "world.xml"), world);
    await writeFile(join(folder, "falling.yaml"), model);
  });
  afterEach(async () => {
    await page.close();
    client.close();
    bf.end();
    await rm(folder, { recursive: true });
    expect(complaints).toEqual([]);
  });

  function record(name: string): string {
    const file = join(folder, name);
    execFileSync(command!, ["run", join(folder, "falling.yaml"), "--quiet", "--record", file]);
    return file;
  }
  async function open(file: string): Promise<void> {
    bf = await edited(command!, file, "view");
    client = await connected(bf.address, { sampled: (frame) => seen.take(frame) });
    seen = new Stage(client);
    ({ page, complaints } = await opened(browser, bf.address));
    view = page.getByRole("application", { name: /^World world with 2 bodies/ });
    await view.waitFor();
    await page.getByText("Loading the robot").waitFor({ state: "detached" });
    await client.call("scene", { is_wanted: true });
  }
  const picture = async () => {
    await page.waitForTimeout(300);
    return (await view.screenshot()).toString("base64");
  };
  /** Of the ball that falls from 3 m, by semi-implicit steps of 1 ms. */
  const fallen = (steps: number) => 3 - (9.81 * 1e-6 * steps * (steps + 1)) / 2;
  const height = () => seen.places.get(0)![2]!;

  test("plays a recording without its model's file, and goes to any instant", async () => {
    const file = record("run.mcap");
    await rm(join(folder, "falling.yaml"));
    await open(file);
    expect(await page.getByRole("button", { name: "Insert" }).count()).toBe(0);
    expect(await instant(page)).toBe(0);
    const at_rest = await picture();
    await go_to(page, 0.3);
    expect(height()).toBeCloseTo(fallen(300), 6);
    const later = await picture();
    expect(later).not.toBe(at_rest);
    await page.getByRole("button", { name: "One step" }).click();
    await expect.poll(() => instant(page)).toBe(0.301);
    await go_to(page, 0);
    await page.getByLabel("Speed").selectOption("0.5×");
    const began = performance.now();
    await page.keyboard.press("p");
    await expect.poll(() => instant(page), { timeout: 8000 }).toBeGreaterThan(0.49);
    expect(performance.now() - began).toBeGreaterThan(800); // half a second at half the speed
    await page.getByRole("button", { name: "Run", exact: true }).waitFor(); // it has ended
    await go_to(page, 0.3);
    expect(await picture()).toBe(later);
  });

  test("shows what is chosen, and goes along with it", async () => {
    await open(record("run.mcap"));
    await go_to(page, 0.3);
    const both = await picture();
    await page.getByText("Shown").click();
    await page.getByRole("checkbox", { name: "ball" }).uncheck();
    await page.getByText("Shown (1 of 2)").click();
    expect(await picture()).not.toBe(both);
    await page.getByText("Shown (1 of 2)").click();
    await page.getByRole("checkbox", { name: "ball" }).check();
    await page.getByText("Shown").click();
    await page.getByLabel("Follow").selectOption("ball/shell");
    const near = await picture();
    await go_to(page, 0.4);
    expect(await picture()).not.toBe(near); // the floor comes nearer
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("runs a model as bf edit does", async () => {
    await open(join(folder, "falling.yaml"));
    await page.getByLabel("Speed").selectOption("fast");
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await expect.poll(() => instant(page)).toBe(0.5);
    await go_to(page, 0.2);
    expect(height()).toBeCloseTo(fallen(200), 6);
  });

  test("says which signal a recording lacks", async () => {
    await writeFile(join(folder, "falling.yaml"), model + "record: [ball.w_H_b]\n");
    const file = record("less.mcap");
    bf = await edited(command!, file, "view");
    client = await connected(bf.address);
    ({ page, complaints } = await opened(browser, bf.address));
    await page.getByText(/the recording does not tell where things are: .*world\.q/).waitFor();
  });
});
