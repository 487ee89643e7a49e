import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { expect } from "vitest";
import { Client, type Listener } from "../../src/client.ts";
import type { Drawing } from "../../src/protocol.ts";
import { Server } from "../../src/server.ts";
import { edited, Hand, opened } from "./browser.ts";

/** Asks a bf edit as its pages do. */
export function connected(address: string, listener: Partial<Listener> = {}): Promise<Client> {
  return new Promise((resolve) => {
    const client: Client = new Client(new Server(address.replace("http:", "ws:").replace("/?", "/socket?").replace(/#.*/, "")),
      { opened: () => resolve(client), lost() {}, told() {}, sampled() {}, ...listener });
  });
}

/** The shown instant of a run, s. */
export const instant = async (page: Page): Promise<number> => Number(await page.getByLabel("Instant in s").inputValue());
export async function go_to(page: Page, time: number): Promise<void> {
  await page.getByLabel("Instant in s").fill(String(time));
  await page.getByLabel("Instant in s").press("Enter");
  await expect.poll(() => instant(page), { timeout: 8000 }).toBe(time);
  await page.getByLabel("Instant in s").blur();
}

/** A model that is worked on: files in a folder of their own, the first of them open in a bf edit with one page. */
export class Desk {
  readonly folder: string;
  readonly file: string;
  readonly address: string;
  readonly page: Page;
  readonly client: Client; // beside the page: tells what is drawn where, and nothing else
  readonly hand: Hand;
  system = ""; // in which the hand works
  private readonly end: () => void;
  private readonly complaints: string[];

  private constructor(folder: string, file: string, bf: { address: string; end(): void }, client: Client, page: Page, complaints: string[]) {
    this.folder = folder;
    this.file = file;
    this.address = bf.address;
    this.end = bf.end;
    this.client = client;
    this.page = page;
    this.complaints = complaints;
    this.hand = new Hand(page, () => this.drawing());
  }
  static async open(browser: Browser, files: Record<string, string>): Promise<Desk> {
    const folder = await mkdtemp(join(tmpdir(), "bf-page-"));
    for (const [name, text] of Object.entries(files)) await writeFile(join(folder, name), text);
    const file = join(folder, Object.keys(files)[0]!), bf = await edited(process.env.BF_COMMAND!, file);
    const client = await connected(bf.address), { page, complaints } = await opened(browser, bf.address);
    return new Desk(folder, file, bf, client, page, complaints);
  }
  drawing(): Promise<Drawing> {
    return this.client.call("draw", { system: this.system, show: [], moved: [], moved_notes: [], bent: [], marks_open: false });
  }
  text(): Promise<string> { return readFile(this.file, "utf8"); }
  async close(): Promise<void> {
    await this.page.close();
    this.client.close();
    this.end();
    await rm(this.folder, { recursive: true, maxRetries: 5 }); // a last file may come in between
    expect(this.complaints).toEqual([]);
  }
}
