import type { DrawnSignal, Drawing, Element, LibraryBlock, PanelInfo, Point, Port, VariableField } from "./protocol.ts";

export type Side = "left" | "right" | "top" | "bottom";
/** What is not given is not declared. */
export interface Variable { value: string; unit?: string; doc?: string; minimum?: string; above?: string; maximum?: string }
/** The operations of bf/model/operation.hpp that the page asks for. */
export type Operation =
  | { do: "add"; system: string; block: { name: string; type?: string; system?: object }; at?: Point }
  | { do: "remove"; path: string }
  | { do: "rename"; path: string; name: string }
  | { do: "connect"; system: string; from: string; to: string }
  | { do: "disconnect"; system: string; from?: string; to: string }
  | { do: "name_signal"; system: string; from: string; name: string }
  | { do: "set"; path: string; name: string; value?: string | null }
  | { do: "add_port"; system: string; port: { name: string }; is_output: boolean }
  | { do: "set_variable"; system: string; name: string; variable?: Variable | null }
  | { do: "rename_variable"; system: string; name: string; to: string }
  | { do: "move"; path: string; to: Point }
  | { do: "resize"; path: string; size?: Point | null }
  | { do: "flip"; path: string }
  | { do: "rotate"; path: string }
  | { do: "place_port"; path: string; port: string; side?: Side | null }
  | { do: "bend"; path: string; points?: Point[] }
  | { do: "label"; path: string; is_there?: boolean }
  | { do: "annotate"; name: string; note?: { name: string; text: string; image?: string; system: string; at: Point; size?: Point } | null }
  | { do: "group"; system: string; blocks: string[]; name: string }
  | { do: "dissolve"; path: string }
  | { do: "record"; path: string; is_recorded?: boolean; plot?: string }
  | { do: "watch"; name: string; display?: { name: string; shows: PanelInfo["shows"]; signals: { path: string }[] } | null }
  | { do: "batch"; operations: Operation[] };

export const have_labels = (elements: Element[]): boolean => elements.some((e) => e.as_labels);
/** Labels at both ends instead of the wires among these, or wires again. */
export const with_labels = (elements: Element[]): Operation => ({
  do: "batch",
  operations: elements.filter((e) => e.kind === "wire").map(({ path }): Operation => ({ do: "label", path, is_there: !have_labels(elements) })),
});

/** What stands on the drawing, is resized and entered, and has ports by name. */
export const is_block = ({ kind }: Element): boolean => kind === "block" || kind === "subsystem" || kind === "chart";
export const may_enter = ({ kind, has_inside }: Element): boolean => kind === "subsystem" || kind === "chart" || has_inside;

export const joined = (system: string, name: string): string => (system ? `${system}.${name}` : name);
export const parent_of = (path: string): string => path.slice(0, Math.max(path.lastIndexOf("."), 0));
export const last_of = (path: string): string => path.slice(path.lastIndexOf(".") + 1);

/** Something of it as given, and all else that is declared of the variable as it was. */
export function redeclared(field: VariableField, change: Partial<Variable>): Operation {
  const { unit, doc, minimum, above, maximum } = field;
  const declared = Object.entries({ unit, doc, minimum, above, maximum, ...change }).filter(([, text]) => text);
  return { do: "set_variable", system: field.system, name: field.name, variable: { value: field.text, ...Object.fromEntries(declared) } };
}

/** A name that nothing in the drawing has: gain, gain2, gain3. */
export function fresh_name(drawing: Drawing, wanted: string): string {
  const taken = new Set(drawing.elements.filter((e) => e.kind !== "wire").map((e) => last_of(e.path)));
  for (let n = 1; ; ++n) {
    const name = n === 1 ? wanted : wanted + n;
    if (!taken.has(name)) return name;
  }
}

/** "WholeBodyToolbox/MassMatrix" is called massMatrix. */
export function name_for(type: string): string {
  const name = type.slice(type.lastIndexOf("/") + 1).replace(/[^A-Za-z0-9_]/g, "");
  return /^[A-Z]+$/.test(name) ? name.toLowerCase() : name.charAt(0).toLowerCase() + name.slice(1);
}

/** How the document writes an end of a wire: shortly where the block has one such port. */
export function end_of(element: Element, port: Port): string {
  const name = last_of(element.path);
  if (!is_block(element)) return name;
  return element.ports.filter((other) => other.is_output === port.is_output).length === 1 ? name : `${name}.${port.name}`;
}

/** Whether a wire may lead between two ports: from an output to an input that has no wire yet. */
export const fits = (a: Port, b: Port): boolean => a.is_output !== b.is_output && !(a.is_output ? b : a).is_wired;

export function connection(system: string, a: { element: Element; port: Port }, b: { element: Element; port: Port }): Operation {
  const [from, to] = a.port.is_output ? [a, b] : [b, a];
  return { do: "connect", system, from: end_of(from.element, from.port), to: end_of(to.element, to.port) };
}

/** Which port of a new block takes a wire that comes from `port`; null: none does. */
export function end_of_new(block: LibraryBlock, name: string, port: Port): string | null {
  const ends = port.is_output ? block.inputs : block.outputs;
  if (!ends[0]) return null;
  return ends.length === 1 ? name : `${name}.${ends[0].name}`;
}

/** The ports by which a block goes into a wire: its first input and output that are free; null: it has none. */
export function through(element: Element): { input: Port; output: Port } | null {
  if (element.kind === "state") return null;
  const free = element.ports.filter((port) => !port.is_wired);
  const input = free.find((port) => !port.is_output), output = free.find((port) => port.is_output);
  return input && output ? { input, output } : null;
}

/** Puts something into a wire that begins and ends at `ends`. */
export function splice(system: string, wire: Element, ends: { input: string; output: string }): Operation[] {
  return [
    { do: "disconnect", system, from: wire.from, to: wire.to },
    { do: "connect", system, from: wire.from, to: ends.input },
    { do: "connect", system, from: ends.output, to: wire.to },
  ];
}

/** Removes what is chosen; wires go with their blocks by themselves. */
export function removal(system: string, elements: Element[]): Operation {
  const gone = new Set(elements.filter((e) => e.kind !== "wire" && e.kind !== "note").map((e) => last_of(e.path)));
  const block = (end: string) => end.split(".")[0]!;
  const operations: Operation[] = elements.flatMap((element): Operation[] => {
    if (element.kind === "note") return [{ do: "annotate", name: last_of(element.path) }];
    if (element.kind !== "wire") return [];
    return gone.has(block(element.from)) || gone.has(block(element.to))
      ? [] : [{ do: "disconnect", system, from: element.from, to: element.to }];
  });
  for (const element of elements)
    if (element.kind !== "wire" && element.kind !== "note") operations.push({ do: "remove", path: element.path });
  return { do: "batch", operations };
}

/** The numbers of a text such as "0.1" or "[1 2; 3 4]", column by column; none where it is anything else. */
export function numbers_of(text: string): number[] {
  const inner = /^\s*\[(.*)\]\s*$/s.exec(text)?.[1] ?? text;
  const rows = inner.trim().split(/[;\n]/).map((row) => row.trim().split(/[\s,]+/).map((word) => (word === "" ? NaN : Number(word))));
  if (rows.some((row) => row.length !== rows[0]!.length || !row.every(Number.isFinite))) return [];
  return rows[0]!.flatMap((_, column) => rows.map((row) => row[column]!));
}
/** What comes out of an element that has one output. */
export function only_output(element: Element, drawing: Drawing): DrawnSignal | undefined {
  const outputs = element.ports.filter((port) => port.is_output);
  return outputs.length === 1 ? drawing.signals[outputs[0]!.signal] : undefined;
}
