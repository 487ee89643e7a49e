// What the page and the service say to each other: JSON-RPC 2.0 in text frames over one WebSocket, samples in
// binary frames. editor/page/src/protocol.ts is made from these declarations.
//
// The address is ws://127.0.0.1:PORT/socket?token=TOKEN, with port and token of the address that `bf edit`
// prints; a browser must come from that address. A request is {"jsonrpc": "2.0", "id": 1, "method": "hello",
// "params": {"protocol": 5}}, with all or some members of its parameters. The answer has the same id and a
// `result`, or an `error` with a `message` for people and a `code`: -32000 the request is refused, -32602 its
// parameters are wrong, -32601 there is no such method, -32600 and -32700 it is no request. A notification
// has a method, parameters and no id; it goes to all pages.
//
// A binary frame has one piece per sample, little-endian: uint32 index of the signal, uint32 index of the
// branch, uint32 number of elements n, float64 time [s], n float64. Samples of a branch before it begins are
// those of the branch that it comes from. They may come in any order of time, and several times.
// Index 2^31 + i is world i of the scene: x y z qw qx qy qz of each body, x y z of a point and of the force
// of the floor there for each foot (zeros where it does not touch), and x y z of the centre of mass; in m and
// N, world axes. The meshes of a world come by HTTP from /meshes/SCENE/WORLD?token=TOKEN, each as uint32
// number of vertices v, uint32 number of triangles t, 3v float32 positions, 3v float32 normals, 3t uint32
// vertices.
//
// Written by scripts/update-reference from editor/service/include/bf/service/protocol.hpp.

export const protocol = 5;

export interface Bent {
  /** of the input that the wire leads to */
  path: string;
  points: Point[];
}

/** What a block took of the run since this is asked for. */
export interface BlockTime {
  /** of a block, or of what is not one block */
  path: string;
  seconds: number;
  calls: number;
}

export interface BlockType {
  type: string;
}

/** What was simulated from one change or edit on. */
export interface BranchInfo {
  index: number;
  /** the branch that it comes from; -1: it begins at 0 */
  parent: number;
  /** where it leaves that one, s */
  from: number;
  /** latest time that was simulated, s */
  reached: number;
  /** "Gain.Kp = 0.2", "edit"; of a branch from 0: nothing */
  cause: string;
}

/** Lines that a block became; from 1. */
export interface CodePlace {
  path: string;
  file: string;
  first: number;
  last: number;
}

/** What differs from an earlier model, and a subsystem of both, side by side. */
export interface Compare {
  /** relative to the opened folder; empty: the model in the last commit of git */
  file: string;
  /** in the opened model, or else in the earlier one */
  system: string;
}

export interface Copy {
  system: string;
  /** of its blocks */
  names: string[];
}

/** One mistake, with the text of `bf check`. */
export interface Diagnostic {
  /** relative to the opened folder */
  file: string;
  line: number;
  column: number;
  path: string;
  message: string;
  remedy: string;
  fixes: Fix[];
  /** a port that has no wire yet */
  is_open: boolean;
}

export interface Difference {
  /** as in model::Distinction */
  path: string;
  /** as in model::Distinction */
  system: string;
  /** "~ controller.pd: setting K: 2 -> 3" */
  text: string;
}

/** Of the opened model, after each change. */
export interface DocumentState {
  /** relative to the opened folder */
  file: string;
  /** counts changes, whoever made them */
  revision: number;
  can_undo: boolean;
  can_redo: boolean;
  /** are `diagnostics` those of this revision? */
  is_checked: boolean;
  /** is it on the disk? */
  is_saved: boolean;
  diagnostics: Diagnostic[];
  /** why files and page differ: a file cannot be read, or not be written */
  failure: string;
  /** which edit does not fit what another program wrote at the same time */
  collision: string;
  panels: PanelInfo[];
  /** titles of the model's own */
  plots: string[];
}

export interface Draw {
  system: string;
  show: ("sizes" | "types" | "rates" | "units")[];
  /** as if they stood there, while they are dragged */
  moved: Moved[];
  /** as if they stood there, while they are dragged */
  moved_notes: Moved[];
  bent: Bent[];
  /** are ports without a wire marked as mistakes? */
  marks_open: boolean;
}

export interface Drawing {
  /** path of the subsystem or state machine, empty for the model itself */
  system: string;
  /** of all elements */
  bounds: Rectangle;
  /** from the back to the front: wires, blocks, notes */
  elements: Element[];
  signals: DrawnSignal[];
  /** "constant", "continuous", "every 10 ms" */
  rates: string[];
  /** of a chart: the signal of its active states */
  active: string;
}

/** What wires and ports carry. */
export interface DrawnSignal {
  /** that `record` and `plots` may call it by: "controller.pd" */
  path: string;
  /** that the model gives it, with its path: "controller.error" */
  name: string;
  kept: Kept[];
}

export interface Edit {
  operation: object;
}

/** Something that is chosen, moved or read as one. */
export interface Element {
  /** block: of a library; subsystem: or the file it stands in; chart: a state machine, which has states inside; input: of the drawn subsystem, seen from inside; wire: from one output to one input; in a chart, a transition */
  kind: "block" | "subsystem" | "chart" | "state" | "input" | "output" | "wire" | "note";
  /** "controller.pd"; of a wire that of the input it leads to: "controller.pd.q", of a transition the state that it leads to and the number of its row: "machine.lift.4". */
  path: string;
  /** of a wire, as the document writes its ends: "error", "pd.q" */
  from: string;
  to: string;
  /** of a wire: from its output to its input, with both; none of labels */
  corners: Point[];
  /** of a wire: a label at each end stands for it */
  as_labels: boolean;
  /** of a wire, its number in `Drawing::signals` */
  signal: number;
  bounds: Rectangle;
  /** from the back to the front */
  shapes: Shape[];
  ports: Port[];
  /** what it is, in words: "pd, Gain, K = Gain.Kp" */
  title: string;
  /** what the model or the library says of it */
  description: string;
  /** of a note, the file of its image as the document writes it */
  image: string;
  marks: Mark[];
  /** its number in `Drawing::rates` */
  rate: number | null;
  /** of a state its number, of a transition that of the state it leaves */
  state: number | null;
  /** of a state: are there states inside, which are drawn by its path? */
  has_inside: boolean;
}

export interface Evaluate {
  /** of a setting, which is not changed */
  path: string;
  /** of a setting, which is not changed */
  name: string;
  /** that it would have */
  text: string;
}

export interface Evaluated {
  /** both empty where a text is no expression */
  value: string;
  /** both empty where a text is no expression */
  error: string;
}

export interface FileList {
  /** relative to the opened folder, images to the file of a subsystem */
  files: string[];
}

/** The file in which a subsystem stands. */
export interface FileText {
  file: string;
  text: string;
  /** from the beginning to the end, what stands around another first */
  places: TextPlace[];
  /** of what another program wrote and is no model */
  diagnostics: Diagnostic[];
}

export interface Find {
  /** in any letter case */
  text: string;
}

export interface Fix {
  title: string;
  operation: string;
}

export interface Generate {
  language: "cpp" | "c";
}

/** What `bf generate` writes of the model as it is now, without the headers that all models share. */
export interface GeneratedCode {
  /** that with the most blocks first */
  files: TextFile[];
  places: CodePlace[];
}

export interface Hello {
  protocol: number;
}

/** Where it stands: in a name, a type, a setting, a variable or a text. */
export interface Hit {
  /** of the block or subsystem */
  path: string;
  what: string;
  text: string;
}

export interface Hits {
  /** the first 200 */
  hits: Hit[];
}

export interface InSystem {
  system: string;
}

export interface Inspect {
  /** of a block; empty: the model itself */
  path: string;
}

export interface Inspection {
  path: string;
  title: string;
  type: string;
  doc: string;
  fields: SettingField[];
}

/** An entry of `record`, or of a plot, by which a signal is kept. */
export interface Kept {
  /** its title; empty: `record` */
  plot: string;
  /** as the document has it, "pd.y"; empty: a pattern or `all` means this signal, too */
  entry: string;
}

export interface LibraryBlock {
  name: string;
  group: string;
  doc: string;
  /** with default arguments */
  inputs: LibraryPort[];
  /** with default arguments */
  outputs: LibraryPort[];
}

export interface LibraryList {
  blocks: LibraryBlock[];
}

export interface LibraryPort {
  name: string;
  doc: string;
}

/** What was done to a run, as the program that runs it has noted it. */
export interface LiveEntry {
  /** counts entries; one that comes again replaces the one before */
  number: number;
  /** s since 1970 */
  clock: number;
  /** of the model, s */
  time: number;
  who: string;
  what: string;
  /** of this service that did it; none: somebody else */
  page: number | null;
}

/** A run of another program. */
export interface LiveProgram {
  /** of its model */
  name: string;
  /** why it can be watched alone; empty: it can be tuned, started and stopped */
  refusal: string;
  /** Why edits change the file alone; empty: the run goes on with the edited model. */
  edit_refusal: string;
  /** why there is no connection: how the program ended, where that is known */
  message: string;
}

/** How a run of another program goes, a few times a second. */
export interface LiveReport {
  timing: Timing | null;
  /** the last hundred */
  log: LiveEntry[];
}

export interface Look {
  /** does this page get the poses, or the times? */
  is_wanted: boolean;
}

/** What is wrong, with the text of `bf check`. */
export interface Mark {
  message: string;
  remedy: string;
  fixes: Fix[];
}

export interface ModelComparison {
  differences: Difference[];
  drawing: Drawing;
}

export interface Moved {
  /** of a block or port; the name of a note */
  path: string;
  to: Point;
  /** of a block; none: as it is */
  size: Point | null;
}

/** What a value of a signal means to people. */
export interface NamedValue {
  value: number;
  name: string;
}

export interface Open {
  /** relative to the opened folder */
  file: string;
}

/** A panel in which runs are watched: a plot of the model's own, or what its layout has. */
export interface PanelInfo {
  name: string;
  shows: "lines" | "xy" | "bars" | "heat_map" | "numbers" | "states";
  /** paths */
  signals: string[];
  /** stands in the layout */
  is_kept: boolean;
}

/** All parameters of the model: what each block, subsystem and the model itself (no path) has. */
export interface Parameters {
  blocks: Inspection[];
}

export interface Paste {
  system: string;
  text: string;
  /** of their upper left corner */
  at: Point;
}

/** What the model plots: a title and paths of signals. */
export interface PlotPanel {
  title: string;
  signals: string[];
}

export interface Point {
  x: number;
  y: number;
}

/** Where a wire may end. */
export interface Port {
  /** as the block calls it: "u1" */
  name: string;
  is_output: boolean;
  is_wired: boolean;
  at: Point;
  /** what is known: "3x1 double, rad, every 10 ms" */
  about: string;
  /** its number in `Drawing::signals`; -1: it has no wire and is no source */
  signal: number;
}

/** What has been read of a recording of the opened folder. */
export interface Recorded {
  /** its samples come by HTTP from /recordings/NUMBER/INDEX?token=TOKEN, as a binary frame */
  number: number;
  file: string;
  signals: SignalInfo[];
  /** what is wrong with the file, which is readable up to there */
  defect: string;
  /** of its latest sample, s */
  end: number;
  /** why it has nothing */
  failure: string;
}

export interface RecordingNumber {
  number: number;
}

export interface Rectangle {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** A span of the run, of which a page looks at more than it has samples of. */
export interface Refine {
  /** s; both the same: the values at an instant */
  from: number;
  /** s; both the same: the values at an instant */
  to: number;
}

export interface Rewrite {
  file: string;
  text: string;
  /** that the file held for whoever changed it */
  before: string;
}

/** A text that is no model, or not of what the file holds now, is not taken. */
export interface Rewritten {
  document: DocumentState;
  is_outdated: boolean;
  diagnostics: Diagnostic[];
}

export interface RunCommand {
  /** start: from the beginning, or on from where it is; step: a base step; to: forwards by simulating, back by a checkpoint; until: on to an event, or to the end; branch: the run goes on on another one; adopt: the edit that waits; emergency_stop: Of a run of another program, as its start, if it waits to be started, and its stop in order: see bf::realtime::Control. */
  action: "start" | "pause" | "step" | "stop" | "to" | "pace" | "until" | "branch" | "adopt" | "emergency_stop";
  /** of `to`, s */
  time: number | null;
  /** of `start`, `pace` and `until`, as in RunState */
  factor: number | null;
  branch: number | null;
  /** Of `until`: "controller.x > 0.3", as for `bf run --until`; a signal alone: until it changes. */
  event: string;
}

/** An edit that waits, since what it would lose is said before. */
export interface RunEdit {
  /** why the edited model cannot go on from here */
  refusal: string;
  /** states that it cannot take over, with the reason */
  lost: string[];
  /** its states that begin with their initial values */
  begun: string[];
  /** whose states these are, and what is taken for true */
  unclear: string[];
}

export interface RunState {
  state: "none" | "paused" | "running" | "ended" | "failed";
  /** s; of the samples that are shown: as `bf run --record` has them */
  time: number;
  /** s, between instants; 0: nothing runs, or another program's run */
  step: number;
  /** s; none: the model names none */
  stop: number | null;
  /** seconds of the model per second; none: as fast as possible */
  factor: number | null;
  /** latest time that was simulated on this branch, s */
  reached: number;
  /** is it a run of the model as it is now? */
  is_current: boolean;
  /** why it failed, or how the run of another program ended */
  message: string;
  /** the one that is shown and goes on */
  branch: number;
  /** in the order in which they began; the oldest are forgotten */
  branches: BranchInfo[];
  edit: RunEdit | null;
  live: LiveProgram | null;
  /** what the run has otherwise than the model as it is now */
  tuned: Tune[];
  /** why this is what was recorded, and nothing runs; empty: it is a run */
  recorded: string;
}

/** Of the run, or of the model where nothing runs. */
export interface Scene {
  /** counts scenes */
  number: number;
  worlds: SceneWorld[];
  /** why there are none */
  failure: string;
}

/** A visible part of a body. */
export interface SceneShape {
  kind: "mesh" | "sphere" | "box" | "cylinder" | "capsule" | "ellipsoid";
  /** numbers in the lists of the world */
  body: number;
  /** numbers in the lists of the world */
  mesh: number;
  /** in the body: x y z [m] qw qx qy qz */
  pose: number[];
  /** radius; half-sizes; radius and half-length along z; half-axes [m] */
  size: number[];
  /** red, green, blue, opacity, 0 to 1 */
  colour: number[];
}

export interface SceneWorld {
  /** of the block */
  path: string;
  /** names of their links */
  bodies: string[];
  shapes: SceneShape[];
  feet: string[];
  has_floor: boolean;
  /** values of a binary frame before the first step */
  start: number[];
  /** parameter with a body's number (from 1), a point in it and a force */
  disturbance: string;
}

/** What a dialog shows of one setting of a block, or of the model. */
export interface SettingField {
  name: string;
  /** argument: fixed when the block is made; parameter: may change in a run; property: of the document: period, doc, when, ... */
  role: "argument" | "parameter" | "property";
  /** as the document has it, where it has */
  text: string | null;
  /** what holds without it */
  initial: string;
  /** what the expression comes to, where that is known */
  value: string;
  /** with limits */
  unit: string;
  /** with limits */
  doc: string;
  choices: string[];
  /** of the choices, besides which other values may be given */
  names: string[];
  /** of each element */
  least: number | null;
  /** of each element */
  greatest: number | null;
  /** may elements be whole numbers alone? */
  is_whole: boolean;
}

export interface Shape {
  /** polygon: closed; line: open, straight from point to point; curve: cubic Bézier: a point, then three for each piece; ellipse: in the rectangle of two corners; text: one line at a point: of its base line, by `align` its start, middle or end; image: as large as fits into the rectangle of two corners; its text is the path of the file */
  kind: "polygon" | "line" | "curve" | "ellipse" | "text" | "image";
  /** body: a block's outline, filled; symbol: a line inside of a block; value: text inside of a block; name: a block's name, beneath it; port: the name of a port inside of a subsystem's block, or a line of its sketch; open: a port without a wire; wire: a line of a connection; branch: the dot where a connection divides; label: name, size, type, rate or unit beside a wire; note: a text of the document's layout; highlight: what is wrong: around a block, along a wire; added: in a comparison, around or along what the earlier model lacks; removed: what the later model lacks */
  style: "body" | "symbol" | "value" | "name" | "port" | "open" | "wire" | "branch" | "label" | "note" | "highlight" | "added" | "removed" | "changed";
  points: Point[];
  text: string;
  /** height of letters, of a text */
  size: number;
  align: "start" | "middle" | "end";
}

/** A signal of the run. Its index is that of binary frames. */
export interface SignalInfo {
  index: number;
  path: string;
  elements: number;
  /** of its elements, where they have some */
  names: string[];
  unit: string;
  /** its elements come column by column */
  rows: number;
  /** does it go on between samples, rather than keep its value? */
  is_continuous: boolean;
  /** that have names */
  values: NamedValue[];
}

export interface Signals {
  signals: SignalInfo[];
  plots: PlotPanel[];
  /** paths that were asked for, and are no signals of the run */
  unknown: string[];
}

export interface Text {
  text: string;
}

export interface TextFile {
  name: string;
  text: string;
}

/** The lines in which a block, an own port or a wire stands. */
export interface TextPlace {
  /** as in drawings */
  system: string;
  /** as in drawings */
  path: string;
  /** of a wire, as in drawings */
  from: string;
  /** it begins there, and ends in the last line; from 1 */
  line: number;
  /** it begins there, and ends in the last line; from 1 */
  column: number;
  /** it begins there, and ends in the last line; from 1 */
  last: number;
}

export interface Times {
  /** slowest first */
  blocks: BlockTime[];
}

/** How a loop against the clock keeps its period, since it began. */
export interface Timing {
  /** "waiting", "running", "stopping", "emergency stop"; "ended" or "failed" at last */
  state: string;
  /** how it ended, a sentence; empty before */
  end: string;
  /** of the model, s */
  time: number;
  /** on the clock */
  period_us: number;
  steps: number;
  /** from the release of a step to its beginning */
  wake_up_us: TimingSummary;
  /** from its beginning to its end */
  step_us: TimingSummary;
  /** from the release to the end; above the period: the deadline was missed */
  response_us: TimingSummary;
  /** of the time between two beginnings, its size */
  deviation_us: TimingSummary;
  /** to both sides */
  deviation_of_the_period: TimingRow[];
  missed: number;
  missed_by_cause: TimingMisses;
  skipped: number;
  degraded: number;
}

/** Why steps ended after their deadlines: see docs/how-to/real-time.md. */
export interface TimingMisses {
  computation: number;
  interruption: number;
  wakeup: number;
  backlog: number;
}

/** Durations in a row of a histogram, from `from_us` on; the outermost rows are open. */
export interface TimingRow {
  from_us: number;
  to_us: number;
  count: number;
  /** count per us of width */
  per_us: number;
}

export interface TimingSummary {
  /** us */
  p50: number;
  /** us */
  p99: number;
  /** us */
  p99_9: number;
  /** us */
  p99_99: number;
  /** us */
  worst: number;
  rows: TimingRow[];
}

/** A value of a parameter ("controller.pd.K") or of a variable ("Gain.Kp"). */
export interface Tune {
  name: string;
  values: number[];
}

export interface VariableField {
  /** path of the subsystem that declares it */
  system: string;
  /** "Gain.Kp": a field of a struct */
  name: string;
  text: string;
  value: string;
  unit: string;
  doc: string;
  limits: string;
  /** as the document has them */
  minimum: string | null;
  /** as the document has them */
  above: string | null;
  /** as the document has them */
  maximum: string | null;
  /** what they come to */
  least: number | null;
  /** what they come to */
  greatest: number | null;
  /** what is wrong with its value */
  mistake: string;
  /** what names it: paths of blocks, subsystems and variables */
  used_by: string[];
}

export interface Variables {
  /** that expressions of the subsystem see, its own first */
  variables: VariableField[];
}

export interface Watch {
  /** all that this page wants to have samples of */
  paths: string[];
  /** of these, besides the one that is shown */
  branches: number[];
}

export interface Welcome {
  /** of BlockFactory */
  version: string;
  /** models of the opened folder, relative to it */
  files: string[];
  /** number of this page */
  page: number;
  document: DocumentState;
  /** that another page may have started */
  run: RunState;
  live: LiveReport | null;
}

export const cause_texts: Record<keyof TimingMisses, string> = {
  computation: "own computation too long",
  interruption: "interrupted or waiting inside the step",
  wakeup: "woken too late",
  backlog: "behind after an earlier miss",
};

export interface Methods {
  hello: { params: Hello; result: Welcome };
  open: { params: Open; result: DocumentState };
  library: { params: Record<string, never>; result: LibraryList };
  draw: { params: Draw; result: Drawing };
  inspect: { params: Inspect; result: Inspection };
  find: { params: Find; result: Hits };
  evaluate: { params: Evaluate; result: Evaluated };
  variables: { params: InSystem; result: Variables };
  edit: { params: Edit; result: DocumentState };
  undo: { params: Record<string, never>; result: DocumentState };
  redo: { params: Record<string, never>; result: DocumentState };
  arrange: { params: InSystem; result: DocumentState };
  copy: { params: Copy; result: Text };
  paste: { params: Paste; result: DocumentState };
  text: { params: InSystem; result: FileText };
  rewrite: { params: Rewrite; result: Rewritten };
  preview: { params: BlockType; result: Element };
  run: { params: RunCommand; result: RunState };
  signals: { params: Record<string, never>; result: Signals };
  scene: { params: Look; result: Scene };
  times: { params: Look; result: Times };
  recordings: { params: Record<string, never>; result: FileList };
  read: { params: Open; result: RecordingNumber };
  watch: { params: Watch; result: Signals };
  tune: { params: Tune; result: RunState };
  images: { params: InSystem; result: FileList };
  compare: { params: Compare; result: ModelComparison };
  parameters: { params: Record<string, never>; result: Parameters };
  generate: { params: Generate; result: GeneratedCode };
  models: { params: Record<string, never>; result: FileList };
  picture: { params: Draw; result: TextFile };
  refine: { params: Refine; result: Record<string, never> };
  close: { params: RecordingNumber; result: Record<string, never> };
}
export type Method = keyof Methods;

export interface Notifications {
  changed: DocumentState; // by a page, or by another program
  run: RunState;
  live: LiveReport; // of the program that is attached
  recorded: Recorded; // what was asked for by `read`
}
