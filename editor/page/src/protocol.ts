// What the page and the service say to each other: JSON-RPC 2.0 in text frames over one WebSocket, samples in binary
// frames. Made from the service's declarations by scripts/update-reference; a test compares.

export const protocol = 1;

export interface Point { x: number; y: number }
export interface Rectangle { x: number; y: number; width: number; height: number }
export type Style = "body" | "symbol" | "value" | "name" | "port" | "wire" | "branch" | "label" | "note" | "highlight";
export interface Shape {
  kind: "polygon" | "line" | "curve" | "ellipse" | "text";
  style: Style;
  points: Point[];
  text: string;
  size: number;
  align: "start" | "middle" | "end";
}
export interface Port { name: string; is_output: boolean; is_wired: boolean; at: Point; about: string }
export interface Mark { message: string; remedy: string }
export interface Element {
  kind: "block" | "subsystem" | "input" | "output" | "wire" | "note";
  path: string;
  from: string;
  to: string;
  bounds: Rectangle;
  shapes: Shape[];
  ports: Port[];
  title: string;
  description: string;
  marks: Mark[];
  rate: number | null;
}
export interface Drawing { system: string; bounds: Rectangle; elements: Element[]; rates: string[] }

export interface Diagnostic { file: string; line: number; column: number; path: string; message: string; remedy: string }
/** Of the opened document, after each change. */
export interface DocumentState {
  file: string;          // relative to the opened folder
  revision: number;      // counts changes of the document, whoever made them
  can_undo: boolean;
  can_redo: boolean;
  is_checked: boolean;   // whether `diagnostics` are of this revision
  diagnostics: Diagnostic[];
  failure: string;       // why the file is not what is shown: it cannot be read, or not be written
}
export interface LibraryBlock { name: string; group: string; doc: string }
/** What a dialog shows of one setting. `text` is null where the document does not give it. */
export interface SettingField {
  name: string;
  role: "argument" | "parameter" | "property";  // property: period, doc, when, ... of the document
  text: string | null;
  initial: string;       // what holds without it
  value: string;         // evaluated, or empty
  unit: string;
  doc: string;
  choices: string[];
}
export interface Inspection { path: string; title: string; type: string; doc: string; fields: SettingField[] }
export interface VariableField { system: string; name: string; text: string; value: string; unit: string; doc: string; limits: string }
export interface RunState {
  state: "none" | "paused" | "running" | "ended" | "failed";
  time: number;
  stop: number | null;   // s; null: the model names none
  factor: number | null; // seconds of the model per second; null: as fast as possible
  reached: number;       // the latest time that was simulated, up to which one can go back
  message: string;
}
export interface SignalInfo { path: string; names: string[]; unit: string; elements: number }

// Requests: method, parameters, result.
export interface Methods {
  /** First of all; refuses another `protocol`. */
  hello: { params: { protocol: number }; result: { name: string; version: string; files: string[]; file: string } };
  open: { params: { file: string }; result: DocumentState };
  library: { params: Record<string, never>; result: { blocks: LibraryBlock[] } };
  draw: {
    params: {
      system: string;
      show: ("sizes" | "types" | "rates" | "units")[];
      moved: { path: string; to: Point }[];    // as if they stood there, while they are dragged
    };
    result: Drawing;
  };
  inspect: { params: { path: string }; result: Inspection };  // path "": the model itself
  variables: { params: { system: string }; result: { variables: VariableField[] } };
  /** `operation` is the JSON of bf/model/operation.hpp: {"do": "rename", "path": "a.b", "name": "c"}. */
  edit: { params: { operation: object }; result: DocumentState };
  undo: { params: Record<string, never>; result: DocumentState };
  redo: { params: Record<string, never>; result: DocumentState };
  /** What YAML the blocks and wires between them are, for the clipboard; and the way back, which renames what is taken. */
  copy: { params: { system: string; names: string[] }; result: { text: string } };
  paste: { params: { system: string; text: string; at: Point }; result: DocumentState };
  /** Positions for all that is drawn in the subsystem. */
  arrange: { params: { system: string }; result: DocumentState };
  text: { params: Record<string, never>; result: { text: string } };

  run: {
    params: {
      action: "start" | "pause" | "step" | "stop" | "to";  // start goes on where it paused
      time: number | null;                          // of "to": forwards by simulating, back by a checkpoint
      factor: number | null;
    };
    result: RunState;
  };
  signals: { params: Record<string, never>; result: { signals: SignalInfo[] } };
  /** Binary frames bring these from now on, by their place in this list; the last request counts. */
  watch: { params: { paths: string[] }; result: { signals: SignalInfo[] } };
  /** Of a parameter ("controller.pd.K") or a variable ("Gain.Kp") of the run, not of the document. */
  tune: { params: { name: string; values: number[] }; result: RunState };
}
export type Method = keyof Methods;

// Notifications of the service.
export interface Notifications {
  changed: DocumentState;    // by this page, another one, or another program
  run: RunState;
}

// A binary frame: little-endian; per sample u32 index of the watched signal, u32 number of elements n, f64 time [s], n f64 values.
