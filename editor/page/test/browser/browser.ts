import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { createInterface } from "node:readline";
import { chromium, type Browser, type BrowserContextOptions, type Locator, type Page } from "playwright-core";
import { expect } from "vitest";
import { fitted, to_screen, zoomed } from "../../src/geometry.ts";
import type { Drawing, Point } from "../../src/protocol.ts";

const executable = process.env.BF_CHROMIUM ?? "/usr/bin/chromium";
export const is_there = existsSync(executable);
if (!is_there) console.log(`chromium is missing: there is no ${executable}; apt install chromium, or set BF_CHROMIUM`);

/** Without a graphics card, and without asking anything of the network. */
export const start = (more: string[] = []): Promise<Browser> => chromium.launch({
  executablePath: executable,
  args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-gpu", ...more],
});

/** A bf edit of that model, or a bf view of a recording, too, and how to end it. */
export async function edited(command: string, file: string, verb = "edit"): Promise<{ address: string; end(): void }> {
  const program = spawn(command, [verb, "--no-browser", file], { stdio: ["ignore", "pipe", "inherit"] });
  const end = () => void program.kill("SIGINT");
  for await (const line of createInterface(program.stdout)) {
    const address = /http:\S+/.exec(line)?.[0];
    if (address) return { address, end };
  }
  throw new Error(`bf ${verb} ${file} has ended`);
}

/** A page, and all that it complains of. */
export async function opened(browser: Browser, address: string, options: BrowserContextOptions = {}): Promise<{ page: Page; complaints: string[] }> {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, ...options }), complaints: string[] = [];
  page.setDefaultTimeout(8000);
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error" && !message.text().includes("WebSocket connection")) complaints.push(message.text());
  });
  page.on("request", (request) => {
    if (new URL(request.url()).origin !== new URL(address).origin) complaints.push(`asks ${request.url()}`);
  });
  await page.goto(address);
  await (address.endsWith("#view") ? page.getByRole("group", { name: "Run" }) : page.getByRole("status").filter({ hasText: "saved" })).waitFor();
  await page.waitForTimeout(100);
  return { page, complaints };
}

/** Works on what is drawn as a person does, by the pointer, after "Fit all". */
export class Hand {
  readonly page: Page;
  zoom = 0; // how often what is fitted is enlarged, or reduced
  private readonly drawing: () => Promise<Drawing>;

  constructor(page: Page, drawing: () => Promise<Drawing>) {
    this.page = page;
    this.drawing = drawing;
  }
  async at(p: Point): Promise<Point> {
    await this.page.locator("canvas").first().evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await this.page.locator("[role=listbox][aria-label^=Elements][aria-busy=false]").waitFor({ state: "attached" }); // edits are drawn
    await this.page.keyboard.press("f");
    for (let i = 0; i < Math.abs(this.zoom); ++i) await this.page.keyboard.press(this.zoom > 0 ? "+" : "-");
    const box = (await this.page.locator("canvas").first().boundingBox())!;
    const { bounds } = await this.drawing();
    const fit = fitted(bounds, { width: box.width, height: box.height }), middle = { x: box.width / 2, y: box.height / 2 };
    const on = to_screen(zoomed(fit, middle, this.zoom > 0 ? 1.25 ** this.zoom : 0.8 ** -this.zoom), p);
    return { x: box.x + on.x, y: box.y + on.y };
  }
  async element(path: string) { return (await this.drawing()).elements.find((e) => e.kind !== "wire" && e.path === path)!; }
  async middle(path: string): Promise<Point> {
    const { bounds } = await this.element(path);
    return this.at({ x: bounds.x + bounds.width / 2, y: bounds.y + bounds.height / 2 });
  }
  /** On the border of an element, as parts of its width and height. */
  async border(path: string, x: number, y: number): Promise<Point> {
    const { bounds } = await this.element(path);
    return this.at({ x: bounds.x + x * bounds.width, y: bounds.y + y * bounds.height });
  }
  async port(path: string, name: string): Promise<Point> {
    return this.at((await this.element(path)).ports.find((port) => port.name === name)!.at);
  }
  async drag(from: Point, to: Point): Promise<void> {
    await this.page.mouse.move(from.x, from.y);
    await this.page.mouse.down();
    for (let i = 1; i <= 5; ++i) await this.page.mouse.move(from.x + ((to.x - from.x) * i) / 5, from.y + ((to.y - from.y) * i) / 5);
    await this.page.mouse.up();
  }
}

/** Where something stands that may just be drawn anew. */
export async function place_of(what: Locator): Promise<{ x: number; y: number; width: number; height: number }> {
  let box: Awaited<ReturnType<Locator["boundingBox"]>> = null;
  await expect.poll(async () => (box = await what.boundingBox())).not.toBeNull();
  return box!;
}
