import { existsSync } from "node:fs";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from "vitest";
import type { Client } from "../../src/client.ts";
import type { Scene } from "../../src/protocol.ts";
import { Stage } from "../../src/stage.svelte.ts";
import { found_by_axe } from "./axe.ts";
import { edited, is_there, opened, start } from "./browser.ts";
import { connected, go_to, instant } from "./desk.ts";

const command = process.env.BF_COMMAND;
const has_robots = command !== undefined && existsSync(join(dirname(command), "../lib/blockfactory/WholeBodyToolbox.so"));
/** A heavy box of 0.4 m that falls freely from where it starts, or floats where there is no gravity. */
const urdf = `<robot name="box"><link name="box"><inertial><mass value="2"/>
  <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><box size="0.4 0.4 0.4"/></geometry><material name="red"><color rgba="0.8 0.1 0.1 1"/></material></visual></link></robot>`;
const model = (gravity: string) => `model: box
plugins: [WholeBodyToolbox]
step: 0.001
stop: 30
blocks:
  robot: {block: WholeBodyToolbox/Configuration, robot: "'box.urdf'", gravity: "${gravity}"}
  world: {block: WholeBodyToolbox/MujocoWorld, floor: false}
`;

describe.skipIf(!is_there || !has_robots)("the robot", () => {
  let browser: Browser, page: Page, complaints: string[], folder: string, bf: Awaited<ReturnType<typeof edited>>, client: Client, seen: Stage, view: Locator;

  beforeAll(async () => void (browser = await start(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])));
  afterAll(() => browser.close());
  beforeEach(async () => {
    folder = await mkdtemp(join(tmpdir(), "bf-page-"));
    await writeFile(join(folder, "box.urdf"), urdf);
  });
  afterEach(async () => {
    if (!page.isClosed()) await page.close();
    client.close();
    bf.end();
    await rm(folder, { recursive: true });
    expect(complaints).toEqual([]);
  });

  async function open(gravity: string, other?: Browser): Promise<void> {
    const file = join(folder, "box.yaml");
    await writeFile(file, model(gravity));
    bf = await edited(command!, file);
    // Another page that looks, without a picture.
    client = await connected(bf.address, { sampled: (frame) => seen.take(frame) });
    seen = new Stage(client);
    ({ page, complaints } = await opened(other ?? browser, bf.address));
    view = page.getByRole("application", { name: /^World world with 1 bodies/ });
    if (other) return;
    await view.waitFor();
    await page.getByText("Loading the robot").waitFor({ state: "detached" });
  }
  const picture = async () => (await view.screenshot()).toString("base64");
  async function to(time: number): Promise<void> {
    await go_to(page, time);
    await page.waitForTimeout(300);
  }
  const height = () => seen.places.get(0)![2]!;

  test("stands beside the diagram, and goes where the time is set to", async () => {
    await open("[0 0 -9.81]");
    const scene: Scene = await client.call("scene", { is_wanted: true });
    expect(scene.worlds[0]).toMatchObject({ path: "world", bodies: ["box"], disturbance: "world.disturbance",
      shapes: [{ kind: "box", body: 0, size: [0.2, 0.2, 0.2] }] });
    expect(scene.worlds[0]!.start).toHaveLength(7 + 3);
    await page.waitForTimeout(300);
    const at_rest = await picture();
    await page.getByRole("button", { name: "One step" }).click();
    await page.getByLabel("Follow").selectOption("Follow nothing");
    await to(0.3);
    // Of that time: z = -g t^2 / 2, by semi-implicit steps.
    expect(height()).toBeCloseTo((-9.81 * 1e-6 * 300 * 301) / 2, 6);
    const fallen = await picture();
    expect(fallen).not.toBe(at_rest);
    await to(0.06);
    expect(height()).toBeCloseTo((-9.81 * 1e-6 * 60 * 61) / 2, 6);
    expect(await picture()).not.toBe(fallen);
    await to(0.3);
    expect(await picture()).toBe(fallen);
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("is pulled by the pointer while it runs, and let go", async () => {
    await open("[0 0 0]");
    await client.call("scene", { is_wanted: true });
    await page.getByRole("button", { name: "Run", exact: true }).click();
    await expect.poll(() => instant(page)).toBeGreaterThan(0.1);
    const box = (await view.boundingBox())!, middle = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    await page.mouse.move(middle.x, middle.y);
    await page.mouse.down();
    await page.mouse.move(middle.x, middle.y - 60);
    await page.getByText(/^\d+ N$/).waitFor();
    await expect.poll(height).toBeGreaterThan(0.02);
    await page.mouse.up();
    await page.getByText(/^\d+ N$/).waitFor({ state: "detached" });
    const velocity = async () => {
      const [z, t] = [height(), await instant(page)];
      await page.waitForTimeout(400);
      return (height() - z) / (await instant(page) - t);
    };
    await page.waitForTimeout(200);
    const first = await velocity();
    expect(first).toBeGreaterThan(0);
    expect(Math.abs(await velocity() - first)).toBeLessThan(0.3 * first + 0.02); // nothing accelerates it any more
  });

  test("is turned, zoomed and pushed by keys alone", async () => {
    await open("[0 0 0]");
    await client.call("scene", { is_wanted: true });
    await view.focus();
    const before = await picture();
    await page.keyboard.press("ArrowLeft");
    await page.waitForTimeout(200);
    const turned = await picture();
    expect(turned).not.toBe(before);
    await page.keyboard.press("+");
    await page.waitForTimeout(200);
    expect(await picture()).not.toBe(turned);
    await page.keyboard.press("f");
    await page.keyboard.press("v");
    await view.waitFor({ state: "detached" });
    await page.keyboard.press("v");
    await page.getByRole("button", { name: "One step" }).click();
    await page.getByLabel("Force along y in N").fill("4");
    await page.getByLabel("Force along y in N").press("Tab");
    await page.getByRole("button", { name: "Hold" }).press("Enter");
    await page.getByRole("button", { name: "Let go" }).waitFor();
    await page.waitForTimeout(200);
    await to(1);
    expect(seen.places.get(0)![1]).toBeCloseTo(0.5 * 2, 1); // a = F / m = 2 m/s^2 for nearly a second
    expect(await found_by_axe(page)).toEqual([]);
  });

  test("is a text where the browser has no WebGL", async () => {
    const without = await start(["--disable-3d-apis"]);
    await open("[0 0 0]", without);
    await page.getByText("it has no WebGL").waitFor();
    expect(await found_by_axe(page)).toEqual([]);
    expect(complaints.splice(0).filter((text) => !text.includes("WebGL"))).toEqual([]);
    await without.close();
  });
});
