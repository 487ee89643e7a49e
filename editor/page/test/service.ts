// Stands for the service where there is none: serves the page's files under the policy of the service, and answers the
// protocol with a drawing that it keeps in memory. `node test/service.ts DIST [PORT]` serves it for development.
import { readFile } from "node:fs/promises";
import { createServer, type Server } from "node:http";
import { extname, join, normalize } from "node:path";
import { WebSocketServer, type WebSocket } from "ws";
import type { DocumentState, DrawnSignal, Drawing, Element, PanelInfo, Port, RunState, Shape, SignalInfo } from "../src/protocol.ts";

const shape = (kind: Shape["kind"], style: Shape["style"], points: [number, number][], more: Partial<Shape> = {}): Shape =>
  ({ kind, style, points: points.map(([x, y]) => ({ x, y })), text: "", size: 0, align: "start", ...more });
const text = (style: Shape["style"], x: number, y: number, words: string, size = 12): Shape =>
  shape("text", style, [[x, y]], { text: words, size, align: "middle" });

/** A box, or a triangle for a gain, with its ports on both sides. */
export function box(path: string, x: number, y: number, inputs: string[], outputs: string[], symbol: string, kind: Element["kind"] = "block"): Element {
  const height = Math.max(40, 24 * Math.max(inputs.length, outputs.length)), width = 60;
  const corners: [number, number][] = symbol === "K" ? [[x, y], [x + width, y + height / 2], [x, y + height]]
    : [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
  const ports = (names: string[], is_output: boolean): Port[] => names.map((name, i) => ({
    name, is_output, is_wired: false, about: "scalar double", signal: -1,
    at: { x: is_output ? x + width : x, y: y + ((i + 0.5) * height) / names.length },
  }));
  return {
    kind, path, from: "", to: "", corners: [], as_labels: false, signal: -1, bounds: { x, y, width, height },
    shapes: [shape("polygon", "body", corners), text("value", x + (symbol === "K" ? 22 : 30), y + height / 2 + 4, symbol),
      text("name", x + 30, y + height + 15, path.slice(path.lastIndexOf(".") + 1), 11)],
    ports: [...ports(inputs, false), ...ports(outputs, true)], title: `${path}, ${symbol}`, description: "", marks: [], rate: null, state: null, has_inside: false, image: "",
  };
}

const source = (elements: Element[], end: string, is_output: boolean): Port => {
  const [block, port] = end.split(".");
  const found = elements.find((e) => e.kind !== "wire" && e.path === block)!.ports.filter((p) => p.is_output === is_output);
  return (port ? found.find((p) => p.name === port) : found[0])!;
};
export function wire(elements: Element[], from: string, to: string): Element {
  const a = source(elements, from, true), b = source(elements, to, false);
  a.is_wired = b.is_wired = true;
  b.signal = a.signal;
  const middle = (a.at.x + b.at.x) / 2, line: [number, number][] = [[a.at.x, a.at.y], [middle, a.at.y], [middle, b.at.y], [b.at.x, b.at.y]];
  const xs = line.map(([x]) => x), ys = line.map(([, y]) => y);
  return {
    kind: "wire", path: to.includes(".") ? to : `${to}.${b.name}`, from, to, corners: line.map(([x, y]) => ({ x, y })), as_labels: false, signal: a.signal,
    bounds: { x: Math.min(...xs), y: Math.min(...ys), width: Math.max(...xs) - Math.min(...xs) + 6, height: Math.max(...ys) - Math.min(...ys) },
    shapes: [shape("line", "wire", line), shape("polygon", "wire", [[b.at.x, b.at.y], [b.at.x - 8, b.at.y - 4], [b.at.x - 8, b.at.y + 4]])],
    ports: [], title: `from ${from} to ${to}`, description: "", marks: [], rate: 0, state: null, has_inside: false, image: "",
  };
}

interface Block { name: string; x: number; y: number; inputs: string[]; outputs: string[]; symbol: string; kind?: Element["kind"] }
const known: Record<string, [string[], string[], string]> = {
  Gain: [["u"], ["y"], "K"], Sum: [["u1", "u2"], ["y"], "+ −"], DiscreteIntegrator: [["u"], ["y"], "1/s"], Step: [[], ["y"], "step"],
};

/** A document with no file. */
export class Model {
  blocks: Block[] = [
    { name: "reference", x: 40, y: 60, inputs: [], outputs: ["y"], symbol: "step" },
    { name: "error", x: 160, y: 56, inputs: ["u1", "u2"], outputs: ["y"], symbol: "+ −" },
    { name: "gain", x: 280, y: 60, inputs: ["u"], outputs: ["y"], symbol: "K" },
    { name: "motor", x: 400, y: 56, inputs: ["voltage"], outputs: ["omega"], symbol: "", kind: "subsystem" },
    { name: "scope", x: 540, y: 60, inputs: ["u"], outputs: [], symbol: "∿" },
  ];
  wires: [string, string][] = [["reference", "error.u1"], ["error", "gain"], ["gain", "motor"], ["motor", "error.u2"]];
  notes: { name: string; text: string; at: { x: number; y: number } }[] = [];
  revision = 1;
  operations: object[] = [];
  panels: PanelInfo[] = [];
  names: Record<string, string> = {}; // of signals, by their source
  record: string[] = [];
  plots: Record<string, string[]> = {};
  refusal = ""; // of edits
  failure = "";
  mistake = ""; // of the variable

  state(): DocumentState {
    const open = !this.wires.some(([, to]) => to.startsWith("scope"));
    return {
      file: "motor.yaml", revision: this.revision, can_undo: this.operations.length > 0, can_redo: false, is_checked: true, is_saved: true, failure: this.failure, collision: "", panels: this.panels, plots: Object.keys(this.plots),
      diagnostics: open ? [{ file: "motor.yaml", line: 9, column: 3, path: "scope", message: "input 'u' is not connected", remedy: "connect it", is_open: false, fixes: [
        { title: "Connect 'motor' to 'scope'", operation: '{"do":"connect","system":"","from":"motor","to":"scope"}' }] }] : [],
    };
  }
  draw(system: string, moved: { path: string; to: { x: number; y: number } }[]): Drawing {
    const bounds = { x: 0, y: 0, width: 640, height: 160 };
    if (system) return { system, bounds, elements: [box(`${system}.voltage`, 40, 60, [], ["y"], "1", "input")], signals: [], rates: [], active: "" };
    const solid = this.blocks.map((b) => {
      const to = moved.find((m) => m.path === b.name)?.to ?? b;
      return box(b.name, to.x, to.y, b.inputs, b.outputs, b.symbol, b.kind);
    });
    const signals: DrawnSignal[] = [];
    for (const { path, ports } of solid) for (const port of ports.filter((one) => one.is_output)) {
      const name = this.names[path] ?? "", kept = (plot: string, list: string[]) => list.filter((entry) => [path, name].includes(entry)).map((entry) => ({ plot, entry }));
      port.signal = signals.length;
      signals.push({ path, name, kept: [...kept("", this.record), ...Object.entries(this.plots).flatMap(([plot, list]) => kept(plot, list))] });
    }
    for (const mistake of this.state().diagnostics)
      solid.find((e) => e.path === mistake.path)?.marks.push({ message: mistake.message, remedy: mistake.remedy, fixes: mistake.fixes });
    const notes = this.notes.map(({ name, text: words, at }): Element => ({
      kind: "note", path: name, from: "", to: "", corners: [], as_labels: false, signal: -1, bounds: { ...at, width: 80, height: 16 }, ports: [], title: `note: ${words}`,
      shapes: [text("note", at.x + 40, at.y + 12, words)], description: "", marks: [], rate: null, state: null, has_inside: false, image: "" }));
    return { system, bounds, elements: [...this.wires.map(([from, to]) => wire(solid, from, to)), ...solid, ...notes], signals, rates: ["continuous"], active: "" };
  }
  edit(operation: any): void {
    ++this.revision;
    this.operations.push(operation);
    const block = this.blocks.find((b) => b.name === operation.path);
    if (operation.do === "watch") {
      const { name, display } = operation, panel = display && { name: display.name, shows: display.shows, signals: display.signals.map((s: any) => s.path), is_kept: true };
      this.panels = this.panels.some((p) => p.name === name)
        ? this.panels.flatMap((p) => (p.name !== name ? [p] : panel ? [panel] : [])) : panel ? [...this.panels, panel] : this.panels;
    }
    if (operation.do === "record") {
      const list = operation.plot ? (this.plots[operation.plot] ??= []) : this.record;
      if (operation.is_recorded ?? true) list.push(operation.path);
      else list.splice(list.indexOf(operation.path), 1);
    }
    if (operation.do === "name_signal") this.names[operation.from] = operation.name;
    if (operation.do === "batch") operation.operations.forEach((o: object) => this.edit(o));
    else if (operation.do === "move" && block) Object.assign(block, operation.to);
    else if (operation.do === "annotate") {
      this.notes = this.notes.filter((note) => note.name !== operation.name).concat(operation.note ?? []);
    } else if (operation.do === "rename" && block) block.name = operation.name;
    else if (operation.do === "connect") this.wires.push([operation.from, operation.to]);
    else if (operation.do === "disconnect") this.wires = this.wires.filter(([, to]) => to !== operation.to);
    else if (operation.do === "remove") {
      this.blocks = this.blocks.filter((b) => b !== block);
      this.wires = this.wires.filter((ends) => ends.every((end) => end.split(".")[0] !== operation.path));
    } else if (operation.do === "add") {
      const [inputs, outputs, symbol] = known[operation.block.type] ?? [[], [], "?"];
      this.blocks.push({ name: operation.block.name, ...operation.at, inputs, outputs, symbol });
    }
  }
}

/** A frame of one sample of each signal. */
export function frame(samples: { index: number; branch?: number; time: number; values: number[] }[]): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(samples.reduce((sum, s) => sum + 20 + 8 * s.values.length, 0)));
  let at = 0;
  for (const { index, branch = 0, time, values } of samples) {
    view.setUint32(at, index, true);
    view.setUint32(at + 4, branch, true);
    view.setUint32(at + 8, values.length, true);
    view.setFloat64(at + 12, time, true);
    values.forEach((value, i) => view.setFloat64(at + 20 + 8 * i, value, true));
    at += 20 + 8 * values.length;
  }
  return view.buffer;
}

const no_run: RunState = { state: "none", time: 0, step: 0, stop: null, factor: null, reached: 0, is_current: true, message: "", branch: 0, branches: [], edit: null, live: null, tuned: [], recorded: "" };
const signals: SignalInfo[] = [
  { index: 3, path: "error.y", elements: 1, names: [], unit: "rad/s", rows: 1, is_continuous: false, values: [] },
  { index: 4, path: "motor.x", elements: 2, names: ["i", "omega"], unit: "A", rows: 2, is_continuous: false, values: [] },
  { index: 5, path: "law.J", elements: 6, names: [], unit: "", rows: 2, is_continuous: false, values: [] },
  { index: 6, path: "phases.state", elements: 1, names: [], unit: "", rows: 1, is_continuous: false, values: [{ value: 1, name: "rest" }, { value: 2, name: "walk" }] },
];

class Speaker {
  run: RunState = { ...no_run, stop: 1.2, factor: 1 };
  timer: NodeJS.Timeout | undefined;

  readonly model: Model;
  readonly socket: WebSocket;

  constructor(model: Model, socket: WebSocket) {
    this.model = model;
    this.socket = socket;
    socket.on("message", (data) => this.hear(JSON.parse(String(data))));
    socket.on("close", () => clearInterval(this.timer));
  }
  tell(method: string, params: unknown): void { this.socket.send(JSON.stringify({ jsonrpc: "2.0", method, params })); }
  private hear({ id, method, params }: { id: number; method: string; params: any }): void {
    try {
      this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, result: this.answer(method, params) }));
    } catch (error) {
      this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, error: { code: -32000, message: String((error as Error).message) } }));
    }
  }
  private answer(method: string, params: any): unknown {
    const { model } = this;
    switch (method) {
      case "hello": return { version: "test", files: ["motor.yaml"], page: 1, document: model.state(), run: no_run, live: null };
      case "library": return { blocks: Object.entries(known).map(([name, [inputs, outputs]]) => ({
        name, group: "standard", doc: `A ${name}.`, inputs: inputs.map((n) => ({ name: n, doc: "" })), outputs: outputs.map((n) => ({ name: n, doc: "" })) })) };
      case "draw": return model.draw(params.system, params.moved);
      case "preview": {
        const [inputs, outputs, symbol] = known[params.type]!;
        return box("new", 0, 0, inputs, outputs, symbol);
      }
      case "inspect": if (params.path === "phases") return { path: "phases", title: "phases", type: "StateMachine", doc: "", fields: [
        { name: "transitions", role: "argument", text: "[1 2 0 0.6; 2 1 1 0]", initial: "", value: "", unit: "", doc: "", choices: [], names: [], least: null, greatest: null }] };
        return { path: params.path, title: params.path || "motor", type: "Gain", doc: "Multiplies by a constant.", fields: [
        { name: "K", role: "parameter", text: "Gain.Kp", initial: "1", value: "0.1", unit: "V*s/rad", doc: "factor", choices: [], names: [], least: null, greatest: null },
        { name: "period", role: "property", text: null, initial: "", value: "", unit: "s", doc: "", choices: [], names: [], least: null, greatest: null }] };
      case "variables": return { variables: [{ system: "", name: "supply", text: "24", value: "24", unit: "V", doc: "", limits: "", minimum: "0", above: null, maximum: null, least: 0, greatest: null, mistake: model.mistake }] };
      case "evaluate": return params.text.includes("nothing") ? { value: "", error: "unknown variable 'nothing'" } : { value: "0.2", error: "" };
      case "find": return { hits: model.blocks.filter((b) => b.name.includes(params.text)).map((b) => ({ path: b.name, what: "name", text: b.symbol })) };
      case "edit":
        if (model.refusal) throw new Error(model.refusal);
        model.edit(params.operation);
        this.tell("changed", model.state());
        return model.state();
      case "signals": case "watch": return { signals, plots: [], unknown: [] };
      case "run": return this.act(params.action);
      case "tune":
        if (params.values.some((value: number) => value > 50)) throw new Error(`'${params.name}' is at most 50`);
        return (this.run = { ...this.run, tuned: [{ name: params.name, values: params.values }] });
      case "generate":
        if (params.language === "c") throw new Error("no C code can be generated for 'motor', because these rules are more than arithmetic:\n  motor (Subsystem)");
        return { files: [{ name: "motor.cpp", text: "void step() {\n    // gain (Gain)\n    gain = 2 * error;\n    // motor.law (Gain)\n    law = 3;\n    more = 4;\n}\n" },
          { name: "motor.hpp", text: "class Motor;\n" }], places: [{ path: "gain", file: "motor.cpp", first: 3, last: 3 }, { path: "motor.law", file: "motor.cpp", first: 5, last: 6 }] };
      case "times": return { blocks: params.is_wanted ? [{ path: "gain", seconds: 3e-3, calls: 1000 }, { path: "motor.law", seconds: 1e-3, calls: 1000 }] : [] };
      default: throw new Error(`there is no method '${method}'`);
    }
  }
  private act(action: string): RunState {
    this.run = { ...this.run, state: action === "start" ? "running" : "paused", time: action === "stop" ? 0 : this.run.time,
      branches: [{ index: 0, parent: -1, from: 0, reached: 0, cause: "" }] };
    clearInterval(this.timer);
    if (action === "start") this.timer = setInterval(() => {
      const time = this.run.time + 0.02, is_over = time >= 1.2;
      this.run = { ...this.run, time, reached: Math.max(time, this.run.reached), state: is_over ? "ended" : "running" };
      if (is_over) clearInterval(this.timer);
      this.socket.send(frame([
        { index: 3, time, values: [200 * Math.exp(-3 * time) * Math.cos(12 * time)] }, { index: 4, time, values: [time, -time] },
        { index: 5, time, values: [1, 2, 3, -4, 5, 6] }, { index: 6, time, values: [time < 0.6 ? 1 : 2] }]));
      this.tell("run", this.run);
    }, 20);
    return this.run;
  }
}

const types: Record<string, string> = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };
export const policy = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; base-uri 'none'";

export async function serve(dist: string, port = 0, model = new Model()): Promise<{ server: Server; port: number; model: Model; drop(): void; edit_beside(operation: object): void }> {
  const server = createServer(async (request, response) => {
    const path = normalize(new URL(request.url!, "http://here").pathname);
    try {
      const body = await readFile(join(dist, path === "/" ? "index.html" : path));
      response.writeHead(200, { "Content-Type": types[extname(path) || ".html"] ?? "application/octet-stream", "Content-Security-Policy": policy });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  const sockets = new WebSocketServer({ server, path: "/socket" });
  const speakers: Speaker[] = [];
  sockets.on("connection", (socket) => speakers.push(new Speaker(model, socket)));
  await new Promise<void>((resolve) => server.listen(port, "127.0.0.1", resolve));
  const address = server.address() as { port: number };
  return { server, port: address.port, model, drop: () => sockets.clients.forEach((socket) => socket.terminate()),
    edit_beside(operation) { // as another page does
      model.edit(operation);
      for (const speaker of speakers) speaker.tell("changed", model.state());
    } };
}

if (process.argv[1] === import.meta.filename) {
  const { port } = await serve(process.argv[2] ?? "dist", Number(process.argv[3] ?? 8000));
  console.log(`http://127.0.0.1:${port}/?token=none`);
}
