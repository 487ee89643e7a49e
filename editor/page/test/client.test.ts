import { afterEach, describe, expect, test } from "vitest";
import { Client, Refusal } from "../src/client.ts";
import { Server } from "../src/server.ts";
import { serve } from "./service.ts";

const open: (() => void)[] = [];
afterEach(() => open.splice(0).forEach((close) => close()));

async function started() {
  const service = await serve("dist");
  const events: string[] = [], waiting: (() => void)[] = [];
  const note = (event: string) => {
    events.push(event);
    waiting.splice(0).forEach((wake) => wake());
  };
  const client = new Client(new Server(`ws://127.0.0.1:${service.port}/socket?token=x`), {
    opened: () => note("opened"), lost: () => note("lost"), told: (name) => note(`told ${name}`), sampled: (f) => note(`sampled ${f.byteLength}`),
  });
  open.push(() => {
    client.close();
    service.drop();
    service.server.close();
  });
  const until = async (event: string) => {
    while (!events.includes(event)) await new Promise<void>((wake) => waiting.push(wake));
  };
  await until("opened");
  return { service, client, events, until };
}

describe("the client", () => {
  test("gives each request its own answer", async () => {
    const { client } = await started();
    const [drawing, library] = await Promise.all([client.call("draw", { system: "", show: [], moved: [], moved_notes: [], bent: [], marks_open: false }), client.call("library", {})]);
    expect(drawing.elements.length).toBeGreaterThan(5);
    expect(library.blocks.map((b) => b.name)).toContain("Gain");
  });
  test("passes refusals on with their reason", async () => {
    const { client } = await started();
    await expect(client.call("recordings", {})).rejects.toThrow("there is no method 'recordings'");
  });
  test("brings notifications and samples", async () => {
    const { client, until } = await started();
    await client.call("edit", { operation: { do: "move", path: "gain", to: { x: 1, y: 2 } } });
    await until("told changed");
    await client.call("run", { action: "start", time: null, factor: 1, branch: null, event: "" });
    await until("sampled 160");
    await until("told run");
  });
  test("connects again by itself, and does not leave requests waiting", async () => {
    const { client, service, events, until } = await started();
    const cut = client.call("library", {});
    service.drop();
    await cut.catch((error) => expect(error).toBeInstanceOf(Refusal));
    await until("lost");
    await expect(client.call("library", {})).rejects.toThrow("there is no connection to bf edit");
    events.length = 0;
    await until("opened");
    expect((await client.call("library", {})).blocks.length).toBeGreaterThan(0);
  });
});
