// What the page and the service say to each other. Written by scripts/update-reference from
// editor/service/include/bf/service/protocol.hpp, which says what everything means.

export const protocol = 1;

export interface Bent {
  path: string;
  points: Point[];
}

export interface Copy {
  system: string;
  names: string[];
}

export interface Diagnostic {
  file: string;
  line: number;
  column: number;
  path: string;
  message: string;
  remedy: string;
}

export interface DocumentState {
  file: string;
  revision: number;
  can_undo: boolean;
  can_redo: boolean;
  is_checked: boolean;
  diagnostics: Diagnostic[];
  failure: string;
}

export interface Draw {
  system: string;
  show: ("sizes" | "types" | "rates" | "units")[];
  moved: Moved[];
  moved_notes: Moved[];
  bent: Bent[];
}

export interface Drawing {
  system: string;
  bounds: Rectangle;
  elements: Element[];
  rates: string[];
}

export interface Edit {
  operation: object;
}

export interface Element {
  kind: "block" | "subsystem" | "input" | "output" | "wire" | "note";
  path: string;
  from: string;
  to: string;
  corners: Point[];
  bounds: Rectangle;
  shapes: Shape[];
  ports: Port[];
  title: string;
  description: string;
  marks: Mark[];
  rate: number | null;
}

export interface Hello {
  protocol: number;
}

export interface InSystem {
  system: string;
}

export interface Inspect {
  path: string;
}

export interface Inspection {
  path: string;
  title: string;
  type: string;
  doc: string;
  fields: SettingField[];
}

export interface LibraryBlock {
  name: string;
  group: string;
  doc: string;
  inputs: LibraryPort[];
  outputs: LibraryPort[];
}

export interface LibraryList {
  blocks: LibraryBlock[];
}

export interface LibraryPort {
  name: string;
  doc: string;
}

export interface Look {
  is_wanted: boolean;
}

export interface Mark {
  message: string;
  remedy: string;
}

export interface Moved {
  path: string;
  to: Point;
  size: Point | null;
}

export interface Open {
  file: string;
}

export interface Paste {
  system: string;
  text: string;
  at: Point;
}

export interface PlotPanel {
  title: string;
  signals: string[];
}

export interface Point {
  x: number;
  y: number;
}

export interface Port {
  name: string;
  is_output: boolean;
  is_wired: boolean;
  at: Point;
  about: string;
}

export interface Rectangle {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface RunCommand {
  action: "start" | "pause" | "step" | "stop" | "to" | "pace";
  time: number | null;
  factor: number | null;
}

export interface RunState {
  state: "none" | "paused" | "running" | "ended" | "failed";
  time: number;
  stop: number | null;
  factor: number | null;
  reached: number;
  is_current: boolean;
  message: string;
}

export interface Scene {
  number: number;
  worlds: SceneWorld[];
  failure: string;
}

export interface SceneShape {
  kind: "mesh" | "sphere" | "box" | "cylinder" | "capsule" | "ellipsoid";
  body: number;
  mesh: number;
  pose: number[];
  size: number[];
  colour: number[];
}

export interface SceneWorld {
  path: string;
  bodies: string[];
  shapes: SceneShape[];
  feet: string[];
  has_floor: boolean;
  start: number[];
  disturbance: string;
}

export interface SettingField {
  name: string;
  role: "argument" | "parameter" | "property";
  text: string | null;
  initial: string;
  value: string;
  unit: string;
  doc: string;
  choices: string[];
}

export interface Shape {
  kind: "polygon" | "line" | "curve" | "ellipse" | "text";
  style: "body" | "symbol" | "value" | "name" | "port" | "wire" | "branch" | "label" | "note" | "highlight" | "added" | "removed" | "changed";
  points: Point[];
  text: string;
  size: number;
  align: "start" | "middle" | "end";
}

export interface SignalInfo {
  index: number;
  path: string;
  elements: number;
  names: string[];
  unit: string;
}

export interface Signals {
  signals: SignalInfo[];
  plots: PlotPanel[];
}

export interface Text {
  text: string;
}

export interface Tune {
  name: string;
  values: number[];
}

export interface VariableField {
  system: string;
  name: string;
  text: string;
  value: string;
  unit: string;
  doc: string;
  limits: string;
  minimum: string | null;
  above: string | null;
  maximum: string | null;
}

export interface Variables {
  variables: VariableField[];
}

export interface Watch {
  paths: string[];
}

export interface Welcome {
  version: string;
  files: string[];
  document: DocumentState;
  run: RunState;
}

export interface Methods {
  hello: { params: Hello; result: Welcome };
  open: { params: Open; result: DocumentState };
  library: { params: Record<string, never>; result: LibraryList };
  draw: { params: Draw; result: Drawing };
  inspect: { params: Inspect; result: Inspection };
  variables: { params: InSystem; result: Variables };
  edit: { params: Edit; result: DocumentState };
  undo: { params: Record<string, never>; result: DocumentState };
  redo: { params: Record<string, never>; result: DocumentState };
  arrange: { params: InSystem; result: DocumentState };
  copy: { params: Copy; result: Text };
  paste: { params: Paste; result: DocumentState };
  text: { params: Record<string, never>; result: Text };
  run: { params: RunCommand; result: RunState };
  signals: { params: Record<string, never>; result: Signals };
  scene: { params: Look; result: Scene };
  watch: { params: Watch; result: Signals };
  tune: { params: Tune; result: RunState };
}
export type Method = keyof Methods;

export interface Notifications {
  changed: DocumentState; // by a page, or by another program
  run: RunState;
}
