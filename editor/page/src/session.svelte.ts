import { Attached } from "./attached.svelte.ts";
import { Client, Refusal, type Place } from "./client.ts";
import { anchor_of, fitted, key_of, meets, middle_of, panned, to_screen, wire_line, type Size, type View } from "./geometry.ts";
import { aligned, bends, bent, distributed, grid, movable, on_grid, onto, resized, type Axis, type Edge, type Handle, type Placing } from "./layout.ts";
import {
  connection, end_of, end_of_new, fresh_name, is_block, joined, last_of, may_enter, name_for, only_output, parent_of, removal, splice, through, type Operation, type Side,
} from "./operations.ts";
import {
  protocol, type DocumentState, type Draw, type DrawnSignal, type Drawing, type Element, type Fix, type Kept, type LibraryBlock, type LiveReport, type Method, type Methods, type Notifications, type Recorded,
  type Point, type Port, type RunState, type SignalInfo,
} from "./protocol.ts";
import type { Dialog, End, Target } from "./dialog.ts";
import { Drafts } from "./drafts.ts";
import { save } from "./save.ts";
import { Images } from "./images.svelte.ts";
import { keep, kept } from "./kept.ts";
import { Panels } from "./panels.svelte.ts";
import { Recordings } from "./recordings.svelte.ts";
import { Refinement } from "./refinement.ts";
import { Samples, type Track } from "./samples.ts";
import { Stage } from "./stage.svelte.ts";
import { Theme } from "./theme.svelte.ts";
import { Transport } from "./transport.svelte.ts";
import { Tuning } from "./tuning.svelte.ts";

export type Show = "sizes" | "types" | "rates" | "units";
type Part = "run" | "model";
/** What the run of a model is compared with. */
interface Comparison { file: string; branches: number[]; recordings: string[] }
/** As if the document said so, while something is dragged. */
type Tried = Omit<Draw, "system" | "show" | "marks_open">;
const nothing_tried: Tried = { moved: [], moved_notes: [], bent: [] };

const no_run: RunState = { state: "none", time: 0, step: 0, stop: null, factor: null, reached: 0, is_current: true, message: "",
  branch: 0, branches: [], edit: null, live: null, tuned: [], recorded: "" };
const state_of = (document: DocumentState | null) => `${document?.file} ${document?.revision} ${document?.is_checked}`;

/** What one page knows and shows: the document as the service tells it, and what the person looks at. */
export class Session {
  connection = $state<"connecting" | "open" | "lost">("connecting");
  document = $state.raw<DocumentState | null>(null);
  /** Changes with the model and with what its check found. */
  readonly model_state = $derived(state_of(this.document));
  files = $state.raw<string[]>([]);
  library = $state.raw<LibraryBlock[]>([]);
  version = $state("");
  system = $state("");
  drawing = $state.raw<Drawing | null>(null);
  run = $state.raw<RunState>(no_run);
  readonly attached = new Attached(() => this.run);
  signals = $state.raw<SignalInfo[]>([]);

  selection = $state.raw<ReadonlySet<string>>(new Set());
  focus = $state<string | null>(null); // where arrow keys go on from
  private port = $state.raw<Port | null>(null); // of the one chosen element, as it was drawn when it was chosen
  marks_open = $state(false); // ports without a wire: a run was refused, and nothing was edited since
  hovered = $state<string | null>(null);
  view = $state.raw<View>({ x: 0, y: 0, scale: 1 });
  size = $state.raw<Size>({ width: 1, height: 1 });
  cursor: Point | null = null; // on the drawing
  show = $state.raw<ReadonlySet<Show>>(new Set());
  by_rate = $state(false);    // colours of wires and blocks
  has_map = $state(false);
  has_text = $state(false); // the model's file beside the drawing
  has_code = $state(false); // what is generated of it
  menu = $state.raw<Point | null>(null); // of what is chosen; a point of the canvas
  readonly theme = new Theme();
  dialog = $state.raw<Dialog | null>(null);
  renamed = $state<string | null>(null); // key of the element whose name, or of the note whose text is being edited
  asked = $state<string | null>(null); // path of the field that takes the keyboard once it is shown
  carried = $state.raw<LibraryBlock | null>(null); // out of the search, to where the pointer lets it go
  message = $state.raw<{ text: string; part: Part; can_undo?: boolean } | null>(null);

  /** Sources of wires, "controller.error", whose values stand on the drawing. */
  watched = $state.raw<string[]>([]);
  /** What is watched, and is no signal of the run. */
  unknown = $state.raw<ReadonlySet<string>>(new Set());
  samples = new Samples();
  sampled = $state(0); // grows with what `samples` has
  /** Branches that are shown besides the one that goes on. */
  compared = $state.raw<ReadonlySet<number>>(new Set());

  private readonly by_path = $derived(new Map(this.signals.map((signal) => [signal.path, signal])));
  private readonly by_parent = $derived(Map.groupBy(this.signals, (signal) => parent_of(signal.path)));
  shows_times = $state(false); // of blocks, over the drawing
  readonly stage: Stage;
  readonly panels = new Panels(() => this.document, (operation) => this.edit(operation));
  readonly recordings: Recordings;
  readonly refinement: Refinement;
  readonly drafts = new Drafts();
  readonly tuning = new Tuning(() => this.run, async (name, values) => {
    const state = await this.ask("tune", { name, values }, "run");
    if (state) this.take_run(state);
  });
  readonly transport = new Transport(() => this.run, () => this.connection === "open", (action, given) => this.command(action, given));
  private asked_panels = "";
  private readonly client: Client;
  private readonly where: Place;
  private views = new Map<string, View>();
  private readonly whole = new WeakSet<View>(); // views of all of a drawing
  private tried = nothing_tried;
  private drawing_under_way: Promise<void> | null = null;
  private is_stale = false;
  private drawn = ""; // what the newest drawing was asked for
  private clipboard = "";
  private edits_under_way = 0;
  private changes = $state(0); // that the service was asked for, and that are not drawn yet
  private has_run = false;

  readonly is_viewer: boolean; // is the page for what stands in space alone?

  /** `recordings` are shown from the beginning. */
  constructor(where: Place, recordings: string[] = [], is_viewer = false) {
    this.where = where;
    this.is_viewer = is_viewer;
    this.client = new Client(where, {
      opened: () => void this.greet().then(() => { for (const file of recordings.splice(0)) void this.recordings.open(file); }),
      lost: () => {
        this.connection = "lost";
        this.recordings.lost();
      },
      told: (name, value) => this.hear(name, value),
      sampled: (frame) => {
        this.samples.take(frame);
        this.stage.take(frame);
        ++this.sampled;
      },
    });
    this.stage = new Stage(this.client);
    this.refinement = new Refinement(this.client, () => this.run);
    this.recordings = new Recordings(this.client, (path) => where.data(path), () => {
      ++this.sampled;
      this.keep_comparison();
    });
  }

  close(): void { this.client.close(); }

  // ---- requests ----

  /** Null, and a message to the person, where the service refuses. */
  private async ask<M extends Method>(method: M, params: Methods[M]["params"], part: Part = "model"): Promise<Methods[M]["result"] | null> {
    try {
      return await this.client.call(method, params);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      this.message = { text: error.message, part };
      return null;
    }
  }
  data = (path: string) => this.where.data(path);
  /** Edits are in no file. */
  get is_published(): boolean { return this.where.edited !== undefined; }
  /** The model with its edits, for the person to keep. */
  async download(): Promise<void> {
    for (const { name, text } of (await this.where.edited?.()) ?? []) save(name, text, "application/yaml");
  }
  readonly image = new Images((path) => this.data(path)).of;
  picture = () => this.client.call("picture", { system: this.system, show: [...this.show], marks_open: false, ...nothing_tried });
  generate = (language: Methods["generate"]["params"]["language"]) => this.client.call("generate", { language });
  parameters = () => this.client.call("parameters", {}).catch(() => null);
  compare_with = (file: string, system: string) => this.ask("compare", { file, system });
  image_files = () => this.client.call("images", { system: this.system }).catch(() => null);
  evaluate = (path: string, name: string, text: string) => this.client.call("evaluate", { path, name, text }).catch(() => null);
  /** As the folder has them now. */
  async look_for_models(): Promise<void> { this.files = (await this.client.call("models", {}).catch(() => null))?.files ?? this.files; }
  look_for = (text: string) => this.client.call("find", { text }).catch(() => null);
  inspect = (path: string) => this.client.call("inspect", { path }).catch(() => null);
  times = (is_wanted: boolean) => this.client.call("times", { is_wanted }).catch(() => null);
  /** The file in which the shown subsystem stands. */
  text_of_file = () => this.client.call("text", { system: this.system }).catch(() => null);
  variables = (system: string) => this.client.call("variables", { system }).catch(() => null);

  private async greet(): Promise<void> {
    const welcome = await this.ask("hello", { protocol });
    if (!welcome) return;
    const is_again = this.connection === "lost";
    this.connection = "open";
    [this.version, this.files] = [welcome.version, welcome.files];
    const before = this.document?.file;
    this.document = welcome.document;
    this.take_run(welcome.run); // at once, as newer states may be on their way
    this.attached.greet(welcome.page, welcome.live);
    this.drawn = ""; // another program may have come
    if (!is_again || before !== welcome.document.file) this.look_at("");
    await this.redraw();
    if (!is_again) this.fit();
    this.library = (await this.ask("library", {}))?.blocks ?? this.library;
    const compared = kept<Comparison>("sessionStorage", "comparison");
    if (!is_again && compared?.file === welcome.document.file) {
      if (welcome.run.state !== "none") this.compared = new Set(compared.branches);
      for (const file of compared.recordings) void this.recordings.open(file);
    }
    await this.rewatch();
    await this.stage.ask();
  }

  private hear<N extends keyof Notifications>(name: N, value: Notifications[N]): void {
    if (name === "run") return this.take_run(value as RunState);
    if (name === "live") return void (this.attached.report = value as LiveReport);
    if (name === "recorded") return this.recordings.hear(value as Recorded);
    const state = value as DocumentState, other = state.file !== this.document?.file, before = this.model_state;
    this.document = state;
    if (before === this.model_state) return; // files were written
    if (other) {
      this.look_at("");
      void this.redraw().then(() => this.fit());
    } else {
      void this.redraw();
    }
    if (state.is_checked && this.run.state === "none") void this.stage.ask();
    if (this.run.state !== "none" && this.panels.signals.join("\n") !== this.asked_panels) void this.rewatch();
  }

  /** One request at a time; resolves when what is shown is as new as the call. */
  redraw(tried = this.tried): Promise<void> {
    this.tried = tried;
    this.is_stale = true;
    this.drawing_under_way ??= this.draw_while_stale().finally(() => (this.drawing_under_way = null));
    return this.drawing_under_way;
  }
  private async draw_while_stale(): Promise<void> {
    while (this.is_stale) {
      this.is_stale = false;
      const system = this.system, asked = { system, show: [...this.show], marks_open: this.marks_open, ...this.tried };
      const wanted = this.model_state + JSON.stringify(asked);
      if (wanted === this.drawn) continue;
      this.drawn = wanted;
      try {
        const drawing = await this.client.call("draw", asked);
        if (system === this.system) this.take_drawing(drawing);
      } catch (error) {
        this.drawn = "";
        if (!(error instanceof Refusal)) throw error;
        if (this.connection !== "open" || !system) return void (this.message = { text: error.message, part: "model" });
        this.look_at(parent_of(system)); // it was removed or renamed
        this.is_stale = true;
      }
    }
  }
  private take_drawing(drawing: Drawing): void {
    const is_other_chart = drawing.active !== "" && drawing.active !== this.drawing?.active;
    this.drawing = drawing;
    if (is_other_chart && this.run.state !== "none") void this.rewatch();
    const keys = new Set(drawing.elements.map(key_of));
    if ([...this.selection].some((key) => !keys.has(key))) this.select([...this.selection].filter((key) => keys.has(key)));
    if (this.focus && !keys.has(this.focus)) this.focus = null;
  }

  async edit(operation: Operation): Promise<boolean> {
    if (operation.do === "batch" && operation.operations.length === 0) return false;
    const single = operation.do === "batch" && operation.operations.length === 1 ? operation.operations[0]! : operation;
    ++this.edits_under_way;
    return this.settle(this.ask("edit", { operation: single }).finally(() => --this.edits_under_way));
  }
  /** Resolves when it is drawn: to false, and a message, where the service refused. */
  private async settle(asked: Promise<DocumentState | null>): Promise<boolean> {
    await null; // a field that goes sets its value while the page is drawn anew, when no state may change
    ++this.changes;
    try {
      const state = await asked;
      if (state) {
        if (state.revision !== this.document?.revision || state.file !== this.document.file) this.document = state; // else it was heard
        this.message = null;
        this.marks_open = false;
      }
      await this.redraw(nothing_tried);
      return state !== null;
    } finally {
      --this.changes;
    }
  }
  /** Is the drawing about to change, as the person asked? */
  get is_changing(): boolean { return this.changes > 0; }
  mend(fix: Fix): Promise<boolean> { return this.edit(JSON.parse(fix.operation) as Operation); }
  async rewrite(file: string, text: string, before: string): Promise<Methods["rewrite"]["result"] | null> {
    const answer = this.ask("rewrite", { file, text, before });
    await this.settle(answer.then((its) => its?.document ?? null));
    return answer;
  }
  /** Also what is under way, as the service takes one request after the other. */
  get can_undo(): boolean { return this.edits_under_way > 0 || (this.document?.can_undo ?? false); }
  async undo(): Promise<void> { if (this.can_undo) await this.settle(this.ask("undo", {})); }
  async redo(): Promise<void> { if (this.document?.can_redo) await this.settle(this.ask("redo", {})); }
  async arrange(): Promise<void> {
    if (await this.settle(this.ask("arrange", { system: this.system }))) this.fit();
  }
  async open(file: string): Promise<void> {
    const opened = this.ask("open", { file }).then((state) => {
      if (state) this.look_at("");
      return state;
    });
    if (await this.settle(opened)) this.fit();
  }

  // ---- looking ----

  /** Is what is shown the chart of a state machine? */
  get is_chart(): boolean { return (this.drawing?.active ?? "") !== ""; }
  /** Have its states states inside? */
  get has_levels(): boolean { return last_of(this.drawing?.active ?? "") === "active"; }
  /** The numbers of its active states at the shown instant. */
  readonly active: ReadonlySet<number> = $derived.by(() => {
    void this.sampled;
    const signal = this.signal_of(this.drawing?.active ?? ""), now = signal && this.track_of(signal)?.at(this.run.time);
    if (!signal || !now) return new Set<number>();
    return new Set(signal.names.length > 0 ? now.flatMap((is_active, i) => (is_active ? [i + 1] : [])) : now);
  });

  private look_at(system: string): void {
    if (this.drawing) this.views.set(this.drawing.system, this.view);
    this.system = system;
    this.tried = nothing_tried;
    this.select([]);
    this.focus = this.hovered = this.renamed = null;
  }
  async enter(system: string): Promise<void> {
    const from = this.system;
    this.look_at(system);
    await this.redraw();
    const view = this.views.get(this.system);
    if (view && !this.whole.has(view)) this.view = view;
    else this.fit();
    const inner = this.drawing?.elements.find((e) => e.path === from && may_enter(e));
    if (inner) this.select([key_of(inner)]);
  }
  async leave(): Promise<void> { if (this.system) await this.enter(parent_of(this.system)); }
  fit(): void {
    if (!this.drawing || this.drawing.elements.length === 0) return;
    this.view = fitted(this.drawing.bounds, this.size);
    this.whole.add(this.view);
  }
  /** Whoever sees all of the drawing goes on to see all of it; else its middle stays in the middle. */
  resize_canvas(size: Size): void {
    const { view, size: before } = this;
    this.size = size;
    if (before.width <= 1 || this.whole.has(view)) this.fit();
    else this.view = panned(view, (size.width - before.width) / 2, (size.height - before.height) / 2);
  }
  toggle_show(what: Show): void {
    const show = new Set(this.show);
    if (!show.delete(what)) show.add(what);
    this.show = show;
    void this.redraw();
  }

  select(keys: Iterable<string>): void {
    this.selection = new Set(keys);
    this.port = null;
    if (this.selection.size === 1) this.focus = [...this.selection][0]!;
  }
  toggle(key: string): void {
    const keys = new Set(this.selection);
    if (!keys.delete(key)) keys.add(key);
    this.select(keys);
  }
  choose_port({ element, port }: End): void {
    this.select([key_of(element)]);
    this.port = port;
  }
  get only(): Element | null { return this.chosen.length === 1 ? this.chosen[0]! : null; }
  /** The port that is chosen alone, else the only one that a signal comes from, or goes to. */
  get chosen_port(): Port | null {
    const ports = this.only?.ports ?? [], { port } = this, outputs = ports.filter((one) => one.is_output);
    if (port) return ports.find((one) => one.name === port.name && one.is_output === port.is_output) ?? null;
    return outputs.length === 1 ? outputs[0]! : ports.length === 1 ? ports[0]! : null;
  }
  /** What the one chosen wire, port or block carries. */
  get signal(): DrawnSignal | null {
    const number = this.only?.kind === "wire" ? this.only.signal : this.chosen_port?.signal;
    return (number !== undefined && this.drawing?.signals[number]) || null;
  }
  /** The name by which it is watched. */
  get source(): string | null { return this.only?.kind === "wire" ? this.source_of(this.only) : this.signal?.path ?? null; }
  /** Of all that is chosen. */
  get sources(): string[] {
    if (this.source !== null) return [this.source];
    return [...new Set(this.chosen.flatMap((e) => (e.kind === "wire" ? this.source_of(e) : only_output(e, this.drawing!)?.path) ?? []))];
  }
  /** The entry of a plot of the model by which it is kept, or of its record (no title). */
  kept_in(plot: string): Kept | null { return this.signal?.kept.find((kept) => kept.plot === plot) ?? null; }

  get target(): Target {
    if (this.port) return "port";
    const kind = this.chosen[0]?.kind;
    return kind === undefined ? "empty" : this.chosen.length > 1 ? "block" : kind === "wire" || kind === "note" ? kind : "block";
  }
  /** At a point of the canvas, else at what is chosen. */
  open_menu(at?: Point): void {
    const focus = this.find(this.focus) ?? this.chosen[0];
    this.menu = at ?? (focus ? to_screen(this.view, anchor_of(focus)) : { x: this.size.width / 2, y: this.size.height / 2 });
  }

  find(key: string | null): Element | null { return this.drawing?.elements.find((e) => key_of(e) === key) ?? null; }
  get chosen(): Element[] { return this.drawing?.elements.filter((e) => this.selection.has(key_of(e))) ?? []; }
  /** Those of what is chosen, else all: what is wrong, with what would mend it. */
  get mendable(): { path: string; message: string; fix: Fix }[] {
    const marks = this.chosen.flatMap((e) => e.marks.map((mark) => ({ path: e.path, ...mark })));
    const all = marks.length > 0 ? marks : this.document?.diagnostics ?? [];
    return all.flatMap(({ path, message, fixes }) => fixes.map((fix) => ({ path, message, fix })));
  }
  get chosen_blocks(): Element[] { return this.chosen.filter((e) => is_block(e) || e.kind === "state"); }

  /** Shows what a path names, whichever subsystem it stands in. */
  async reveal(path: string): Promise<void> {
    for (let at = path; ; at = parent_of(at)) {
      if (parent_of(at) !== this.system) await this.enter(parent_of(at));
      const named = this.drawing?.elements.filter((e) => e.path === at), found = named?.find((e) => e.kind !== "wire") ?? named?.[0];
      if (found && this.system === parent_of(at)) return this.select([key_of(found)]);
      if (!at) return;
    }
  }

  // ---- edits ----

  /** Where the person points at, else beside what is chosen, else in the middle: a place that is free. */
  private spot(at?: Point): Point {
    const beside = this.find(this.focus)?.bounds;
    const middle = { x: this.view.x + this.size.width / 2 / this.view.scale, y: this.view.y + this.size.height / 2 / this.view.scale };
    const wanted = on_grid(at ?? this.cursor ?? (beside ? { x: beside.x + beside.width + 60, y: beside.y } : middle));
    const taken = this.drawing?.elements.filter((e) => e.kind !== "wire") ?? [];
    while (taken.some((e) => meets(e.bounds, { ...wanted, width: 80, height: 60 }))) wanted.y += 4 * grid;
    return wanted;
  }
  private async insert(operations: Operation[], name: string): Promise<void> {
    if (await this.edit({ do: "batch", operations })) this.select([joined(this.system, name)]);
  }
  async add_block(block: LibraryBlock, at?: Point, from?: End, into?: Element, wanted = name_for(block.name)): Promise<void> {
    const name = fresh_name(this.drawing!, wanted), system = this.system;
    const shape = into ? await this.ask("preview", { type: block.name }) : null, ports = shape && through(shape);
    if (into && shape && ports) {
      const made = { ...shape, path: name };
      return this.insert([{ do: "add", system, block: { name, type: block.name }, at: onto(into, at ?? middle_of(wire_line(into)), shape, ports.input) },
        ...splice(system, into, { input: end_of(made, ports.input), output: end_of(made, ports.output) })], name);
    }
    const operations: Operation[] = [{ do: "add", system, block: { name, type: block.name }, at: this.spot(at) }];
    const end = from ? end_of_new(block, name, from.port) : null;
    if (from && end !== null) {
      const port = { ...from.port, is_output: !from.port.is_output, name: last_of(end) };
      const wire = connection(system, from, { element: from.element, port }) as Extract<Operation, { do: "connect" }>;
      operations.push({ ...wire, [from.port.is_output ? "to" : "from"]: end });
    }
    await this.insert(operations, name);
  }
  async add_subsystem(at?: Point, wanted = "subsystem"): Promise<void> {
    const name = fresh_name(this.drawing!, wanted);
    await this.insert([{ do: "add", system: this.system, block: { name, system: {} }, at: this.spot(at) }], name);
  }
  async add_state(at?: Point, from?: End, wanted = "state"): Promise<void> {
    const name = fresh_name(this.drawing!, wanted), system = this.system, other = from && last_of(from.element.path);
    const transition: Operation[] = !other ? [] : [{ do: "connect", system, ...(from!.port.is_output ? { from: other, to: name } : { from: name, to: other }) }];
    await this.insert([{ do: "add", system, block: { name }, at: this.spot(at) }, ...transition], name);
  }
  async add_port(is_output: boolean, at?: Point, wanted = is_output ? "output" : "input"): Promise<void> {
    const name = fresh_name(this.drawing!, wanted), path = joined(this.system, name);
    await this.insert([{ do: "add_port", system: this.system, port: { name }, is_output }, { do: "move", path, to: this.spot(at) }], name);
  }
  async add_image(file: string, at?: Point): Promise<void> {
    const name = fresh_name(this.drawing!, "image"), note = { name, text: file, image: file, system: this.system, at: this.spot(at) };
    if (await this.edit({ do: "annotate", name, note }))
      this.select([`note ${name}`]);
  }
  resize_image(note: Element, size: Point): Promise<boolean> { return this.edit(this.note(note, { size })); }
  async add_note(at?: Point): Promise<void> {
    const name = fresh_name(this.drawing!, "note"), text = "note";
    if (!(await this.edit({ do: "annotate", name, note: { name, text, system: this.system, at: this.spot(at) } }))) return;
    this.select([`note ${name}`]);
    this.renamed = `note ${name}`;
  }
  text_of(note: Element): string { return note.title.slice(note.title.indexOf(": ") + 2); }
  private note(note: Element, change: { text?: string; at?: Point; size?: Point }): Operation {
    const { path, bounds, image } = note, size = { x: bounds.width, y: bounds.height };
    return { do: "annotate", name: path, note: {
      name: path, text: this.text_of(note), system: this.system, at: { x: bounds.x, y: bounds.y }, ...(image ? { image, size } : {}), ...change } };
  }
  /** A transition is chosen once it is there, and asked for its condition. */
  async connect(a: End, b: End): Promise<boolean> {
    const before = new Set(this.drawing?.elements.map(key_of));
    if (!(await this.edit(connection(this.system, a, b)))) return false;
    if (this.is_chart) {
      const [added] = this.drawing!.elements.filter((e) => !before.has(key_of(e)));
      if (added) this.select([key_of(added)]);
      if (added) this.asked = joined(added.path, this.has_levels ? "if" : "condition");
    }
    return true;
  }
  reconnect(off: Operation, a: End, b: End): Promise<boolean> {
    return this.edit({ do: "batch", operations: [off, connection(this.system, a, b)] });
  }
  remove(): Promise<boolean> { return this.edit(removal(this.system, this.chosen)); }
  /** Into the record of the model or one of its plots, or out of it. */
  keep_signal(plot: string): Promise<boolean> {
    const signal = this.signal!, kept = this.kept_in(plot);
    return this.edit({ do: "record", path: kept?.entry || signal.name || signal.path, ...(kept ? { is_recorded: false } : {}), ...(plot ? { plot } : {}) });
  }
  private name_signal(wire: Element, name: string): Promise<boolean> {
    const old = this.drawing?.signals[wire.signal]?.name ?? "";
    if (!name) return this.edit({ do: "remove", path: old });
    return this.edit(old ? { do: "rename", path: old, name } : { do: "name_signal", system: this.system, from: wire.from, name });
  }
  /** As it is edited. */
  name_of(element: Element): string {
    return last_of(element.kind === "wire" ? this.drawing?.signals[element.signal]?.name ?? "" : element.path);
  }
  async rename(key: string, name: string): Promise<void> {
    const element = this.find(key);
    this.renamed = null;
    if (element?.kind === "wire") return void (name !== this.name_of(element) && (await this.name_signal(element, name)));
    if (element?.kind === "note") {
      if (!name && !element.image) await this.edit({ do: "annotate", name: element.path });
      else if (name !== this.text_of(element)) await this.edit(this.note(element, { text: name }));
      return;
    }
    if (!element || !name || name === last_of(element.path)) return;
    if (await this.edit({ do: "rename", path: element.path, name })) this.select([joined(this.system, name)]);
  }
  flip(): Promise<boolean> {
    return this.edit({ do: "batch", operations: this.chosen_blocks.map((e) => ({ do: "flip", path: e.path })) });
  }
  rotate(): Promise<boolean> {
    return this.edit({ do: "batch", operations: this.chosen_blocks.map((e) => ({ do: "rotate", path: e.path })) });
  }
  place_port(block: Element, port: Port, side: Side): Promise<boolean> {
    return this.edit({ do: "place_port", path: block.path, port: port.name, side });
  }
  async group(): Promise<void> {
    const blocks = this.chosen_blocks.map((e) => last_of(e.path));
    if (blocks.length === 0) return;
    await this.insert([{ do: "group", system: this.system, blocks, name: fresh_name(this.drawing!, "subsystem") }],
      fresh_name(this.drawing!, "subsystem"));
  }
  dissolve(): Promise<boolean> {
    const operations: Operation[] = this.chosen.filter((e) => e.kind === "subsystem").map((e) => ({ do: "dissolve", path: e.path }));
    return this.edit({ do: "batch", operations });
  }
  /** As if the chosen elements stood elsewhere, until `drop`. */
  moves(delta: Point): Tried {
    const to = ({ bounds }: Element) => ({ x: bounds.x + delta.x, y: bounds.y + delta.y });
    const moved = (is_note: boolean) =>
      this.dragged.filter((e) => (e.kind === "note") === is_note).map((e) => ({ path: e.path, to: to(e), size: null }));
    return { ...nothing_tried, moved: moved(false), moved_notes: moved(true) };
  }
  dragged: Element[] = []; // as they were when it began
  begin_drag(): void { this.dragged = this.chosen.filter((e) => e.kind !== "wire"); }
  /** `into`: a wire that the one dragged block comes to lie on. */
  drop(delta: Point, into: Element | null = null): Promise<boolean> {
    const { moved, moved_notes } = this.moves(delta), block = this.dragged[0]!, ports = into && through(block);
    return this.edit({ do: "batch", operations: [
      ...moved.map(({ path, to }): Operation => ({ do: "move", path, to })),
      ...moved_notes.map(({ path, to }) => this.note(this.dragged.find((e) => e.kind === "note" && e.path === path)!, { at: to })),
      ...(into && ports ? splice(this.system, into, { input: end_of(block, ports.input), output: end_of(block, ports.output) }) : []),
    ] });
  }
  /** Wires alone have nothing to move but their longest piece across that direction. */
  async nudge(delta: Point): Promise<void> {
    const wires = this.chosen.filter((e) => e.kind === "wire");
    this.begin_drag();
    if (this.dragged.length > 0) await this.drop(delta);
    else await this.bend(wires.flatMap((wire) => {
      const piece = movable(wire.corners, delta.x !== 0 ? "x" : "y");
      return piece === null ? [] : [{ path: wire.path, points: bent(wire.corners, piece, delta.x || delta.y).slice(1, -1) }];
    }));
  }
  private place(placings: Placing[]): Promise<boolean> {
    return this.edit({ do: "batch", operations: placings.map(({ path, to }) => ({ do: "move", path, to })) });
  }
  get placed(): Element[] { return this.chosen.filter((e) => e.kind !== "wire" && e.kind !== "note"); }
  align(edge: Edge): Promise<boolean> { return this.place(aligned(this.placed, edge)); }
  distribute(axis: Axis): Promise<boolean> { return this.place(distributed(this.placed, axis)); }

  bend(all: { path: string; points: Point[] }[]): Promise<boolean> {
    return this.edit({ do: "batch", operations: all.map((one) => ({ do: "bend", ...one })) });
  }
  /** As if the piece of the wire from corner `k` on ran elsewhere. */
  try_bend(before: Drawing, wire: Element, k: number, by: number): Tried["bent"] {
    const tried = bends(before.elements, wire, k, by);
    void this.redraw({ ...nothing_tried, bent: tried });
    return tried;
  }
  straighten(): Promise<boolean> {
    return this.bend(this.chosen.filter((e) => e.kind === "wire").map(({ path }) => ({ path, points: [] })));
  }
  try_size(block: Element, handle: Handle, by: Point): Tried["moved"][number] {
    const { x, y, width, height } = resized(block.bounds, handle, by);
    const tried = { path: block.path, to: { x, y }, size: { x: width, y: height } };
    void this.redraw({ ...nothing_tried, moved: [tried] });
    return tried;
  }
  resize({ path, to, size }: Tried["moved"][number]): Promise<boolean> {
    return this.edit({ do: "batch", operations: [{ do: "move", path, to }, { do: "resize", path, size }] });
  }
  grow(by: Point): Promise<boolean> {
    return this.edit({ do: "batch", operations: this.chosen_blocks.map(({ path, bounds }) => {
      const { width, height } = resized(bounds, { x: 1, y: 1 }, by);
      return { do: "resize", path, size: { x: width, y: height } };
    }) });
  }
  let_go(): void { void this.redraw(nothing_tried); }

  async copy(): Promise<boolean> {
    const names = this.chosen_blocks.map((e) => last_of(e.path));
    if (names.length === 0) return false;
    const copied = await this.ask("copy", { system: this.system, names });
    if (!copied) return false;
    this.clipboard = copied.text;
    await navigator.clipboard?.writeText(copied.text).catch(() => {}); // other pages; this one remembers it itself
    return true;
  }
  async cut(): Promise<void> { if (await this.copy()) await this.remove(); }
  async paste(text = this.clipboard, at = this.spot()): Promise<void> {
    if (!text) return;
    const before = new Set(this.drawing?.elements.map(key_of));
    if (await this.settle(this.ask("paste", { system: this.system, text, at })))
      this.select(this.drawing!.elements.filter((e) => e.kind !== "wire" && !before.has(key_of(e))).map(key_of));
  }
  async duplicate(): Promise<void> {
    const blocks = this.chosen_blocks;
    const copied = await this.ask("copy", { system: this.system, names: blocks.map((e) => last_of(e.path)) });
    const [left, top] = [Math.min(...blocks.map((e) => e.bounds.x)), Math.min(...blocks.map((e) => e.bounds.y))];
    if (copied) await this.paste(copied.text, { x: left + 4 * grid, y: top + 4 * grid });
  }

  // ---- the run ----

  private take_run(state: RunState): void {
    const is_again = state.live !== null && this.run.state !== "running" && state.state === "running"; // another program
    const is_other = is_again || (this.run.state === "none" && state.state !== "none");
    if (state.state === "none") this.signals = [];
    const is_other_branch = this.run.branch !== state.branch || this.run.branches.length !== state.branches.length;
    this.run = state;
    if (is_other) {
      this.samples = new Samples();
      void this.stage.ask();
    }
    this.samples.keep(state.branches);
    if (is_other || (state.state !== "none" && is_other_branch)) void this.rewatch();
  }
  async command(action: Methods["run"]["params"]["action"],
    { time = null, factor = null, branch = null, event = "" }: Partial<Methods["run"]["params"]> = {}): Promise<void> {
    const state = await this.ask("run", { action, time, factor, branch, event }, "run");
    if (!state) {
      this.marks_open = true;
      return this.redraw();
    }
    this.message = null;
    this.take_run(state);
  }
  /**
   * Wires are drawn before anything runs; which signals of a run they are is known once it is there. The first run shows
   * what the panels show, unless a person has chosen.
   */
  private async rewatch(): Promise<void> {
    if (this.connection !== "open") return;
    const found = await this.ask("signals", {}, "run");
    if (found) this.signals = found.signals;
    const is_first_run = this.run.state !== "none" && !this.has_run;
    if (is_first_run && this.watched.length === 0) this.watched = this.panels.signals;
    this.has_run ||= is_first_run;
    const wanted = new Set([...this.watched, ...this.panels.signals, ...(this.is_chart ? [this.drawing!.active] : [])]);
    const paths = [...wanted].map((source) => this.signal_of(source)?.path ?? source);
    this.asked_panels = this.panels.signals.join("\n");
    const watched = await this.ask("watch", { paths, branches: [...this.compared].filter((index) => this.run.branches.some((b) => b.index === index)) }, "run");
    if (watched) this.unknown = new Set(watched.unknown);
    this.refinement.forget();
  }
  compare(branch: number, is_compared: boolean): void {
    this.compared = new Set([...this.compared].filter((other) => other !== branch).concat(is_compared ? [branch] : []));
    this.keep_comparison();
    void this.rewatch();
  }
  /** For this page when it is loaded again. */
  private keep_comparison(): void {
    const comparison: Comparison = { file: this.document?.file ?? "", branches: [...this.compared], recordings: this.recordings.opened.map((one) => one.file) };
    keep("sessionStorage", "comparison", comparison);
  }
  /** What is known of a signal on the branch that goes on, or on another one. */
  track_of(signal: SignalInfo, branch = this.run.branch): Track | undefined { return this.samples.along(branch, signal.index); }
  /** "controller.error" is the signal "controller.error.y" where that is its only output. */
  signal_of(source: string): SignalInfo | null {
    const exact = this.by_path.get(source), under = this.by_parent.get(source);
    return exact ?? (under?.length === 1 ? under[0]! : null);
  }
  watch(...sources: string[]): void {
    this.watched = [...new Set([...this.watched, ...sources])];
    void this.rewatch();
  }
  unwatch(...sources: string[]): void {
    this.watched = this.watched.filter((other) => !sources.includes(other));
    void this.rewatch();
  }
  /** Each in a panel of its own, unless there is one: what people draw over each other they drag together. */
  async plot(sources: string[]): Promise<void> {
    const shown = this.panels.signals, signals = sources.map((source) => this.signal_of(source)?.path ?? source);
    await this.panels.create(...signals.filter((signal) => !shown.includes(signal)).map((signal) => [signal]));
    this.watch(...sources);
  }
  source_of(wire: Element): string { return joined(this.system, wire.from); }
}
