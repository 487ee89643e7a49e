import { commands, is_possible } from "./commands.ts";
import { end_of_new, fits, fresh_name, is_block, last_of } from "./operations.ts";
import type { LibraryBlock, Point } from "./protocol.ts";
import type { Dialog, End } from "./dialog.ts";
import type { Session } from "./session.svelte.ts";

/** A line of the search; `is_meant`: what is typed is a name for it; `insert` is what can be done under a given name, too. */
export interface Entry {
  key: string; title: string; detail: string; group: string; is_meant?: boolean; keys?: string; block?: LibraryBlock; run(): unknown; insert?(name?: string): unknown;
}

const insertion = (title: string, detail: string, insert: (name?: string) => unknown): Entry =>
  ({ key: title.toLowerCase(), title, detail, group: "structure", run: () => insert(), insert });

function blocks(session: Session, dialog: Extract<Dialog, { kind: "search" | "insert" }>): Entry[] {
  const from = dialog.kind === "insert" ? dialog.from : undefined, into = dialog.kind === "search" ? dialog.into : undefined;
  const insert = (block: LibraryBlock) => (name?: string) => session.add_block(block, dialog.at, from, into, name);
  return session.library
    // Of what has no ports before it has arguments nobody knows whether it fits.
    .filter((block) => !from || end_of_new(block, "", from.port) !== null || block.inputs.length + block.outputs.length === 0)
    .filter((block) => !into || (block.inputs.length > 0 && block.outputs.length > 0))
    .map((block) => ({
      block, key: block.name, title: last_of(block.name.replace("/", ".")), detail: block.doc, group: block.group,
      run: () => insert(block)(), insert: insert(block),
    }));
}

function connections(session: Session): Entry[] {
  const elements = session.drawing?.elements.filter((e) => e.kind !== "wire") ?? [];
  const chosen = elements.filter((e) => session.selection.has(e.path));
  const ends = (list: typeof elements): End[] => list.flatMap((element) => element.ports.map((port) => ({ element, port })));
  const text = (end: End) => (is_block(end.element)
    ? `${last_of(end.element.path)}.${end.port.name}` : last_of(end.element.path));
  const found = new Map<string, Entry>();
  for (const a of ends(chosen.length > 0 ? chosen : elements))
    for (const b of ends(elements)) {
      if (a.element === b.element || !fits(a.port, b.port)) continue;
      const [from, to] = a.port.is_output ? [a, b] : [b, a], title = `${text(from)} → ${text(to)}`;
      found.set(title, { key: title, title, detail: "", group: "connect", run: () => session.connect(from, to) });
    }
  return [...found.values()];
}

function possible_commands(session: Session): Entry[] {
  return commands.filter((command) => !command.is_hidden && is_possible(command, session)).map((command) => ({
    key: `command ${command.title}`, title: command.title, detail: "", keys: command.keys[0], group: command.group, run: () => command.run(session),
  }));
}
const states = (session: Session, at?: Point, from?: End): Entry[] => [insertion("State", "of this state machine", (name) => session.add_state(at, from, name))];
const structure = (session: Session, at?: Point): Entry[] => [
  insertion("Subsystem", "an empty one, to be opened and filled", (name) => session.add_subsystem(at, name)),
  insertion("Input", "of this subsystem", (name) => session.add_port(false, at, name)),
  insertion("Output", "of this subsystem", (name) => session.add_port(true, at, name)),
  { key: "note", title: "Note", detail: "a text on the drawing", group: "structure", run: () => session.add_note(at) },
  { key: "image", title: "Image", detail: "a PNG or SVG file of the folder", group: "structure", run: () => (session.dialog = { kind: "image", at }) },
];

/** With what has the name that is typed behind its kind, "Gain Kp"; a name alone is that of a state, or of a subsystem where nothing else is meant. */
function with_named(session: Session, entries: Entry[], text: string): Entry[] {
  const typed = text.trim(), alone = session.is_chart ? "state" : session.library.length > 0 && ranked(entries, text).length === 0 ? "subsystem" : "";
  const named = entries.flatMap((entry): Entry[] => {
    const kind = `${entry.title} `.toLowerCase(), name = typed.toLowerCase().startsWith(kind) ? typed.slice(kind.length).trim() : entry.key === alone ? typed : "";
    if (!entry.insert || !name || fresh_name(session.drawing!, name) !== name) return [];
    return [{ ...entry, is_meant: true, key: `${entry.key} ${name}`, title: `${entry.title} ${name}`, block: undefined, run: () => entry.insert!(name) }];
  });
  return [...entries, ...named];
}

/** The plots of the model, each with or without the chosen signal, and a new one of the title that is typed. */
function plots(session: Session, text: string): Entry[] {
  const signal = session.signal, titles = session.document?.plots ?? [], title = text.trim() || last_of(signal?.name || signal?.path || "");
  return [
    ...titles.map((plot) => ({ key: `plot ${plot}`, title: plot, detail: session.kept_in(plot) ? "take the signal off" : "add the signal", group: "plot",
      run: () => session.keep_signal(plot) })),
    ...(titles.includes(title) ? [] : [{ key: "new", title: `New plot: ${title}`, detail: "of the signal", group: "plot", run: () => session.keep_signal(title) }]),
  ];
}

export function entries_for(session: Session, dialog: Dialog, text: string): Entry[] {
  switch (dialog.kind) {
    case "help": case "find": case "image": case "compare": return []; // what is found comes from the service
    case "open":
      return session.files.map((file) => ({ key: file, title: file, detail: "", group: "model", run: () => session.open(file) }));
    case "recording":
      return session.recordings.files.map((file) => ({ key: file, title: file, detail: "", group: "recording", run: () => session.recordings.open(file) }));
    case "earlier": return [
      { key: "", title: "Last commit", detail: "of git", group: "version", run: () => (session.dialog = { kind: "compare", file: "" }) },
      ...session.files.filter((file) => file !== session.document?.file).map((file) => (
        { key: file, title: file, detail: "", group: "model", run: () => (session.dialog = { kind: "compare", file }) })),
    ];
    case "fix": return session.mendable.map(({ path, message, fix }, i) => (
      { key: `${i}`, title: fix.title, detail: `${path}: ${message}`, group: "fix", run: () => session.mend(fix) }));
    case "connect": return connections(session);
    case "plots": return plots(session, text);
    case "insert": return with_named(session, session.is_chart ? states(session, dialog.at, dialog.from) : blocks(session, dialog), text);
    case "search": {
      const found = session.is_chart ? states(session, dialog.at) : dialog.into ? blocks(session, dialog) : [...blocks(session, dialog), ...structure(session, dialog.at)];
      return with_named(session, [...found, ...possible_commands(session)], text);
    }
  }
}

type Answer = Pick<Entry, "title" | "detail" | "group" | "is_meant">;
/** How well a line answers: its name first, where words begin next, names among its words, then anywhere, then its letters in order. */
export function score(entry: Answer, wanted: string): number {
  const text = wanted.trim().toLowerCase(), title = entry.title.toLowerCase();
  if (!text) return 1;
  if (title === text) return 100;
  if (entry.is_meant) return 95;
  if (title.startsWith(text)) return 90 - title.length / 100;
  const words = text.split(/\s+/);
  if (words.length > 1 && words.every((word) => title.includes(word)))
    return 80 + (are_in_order(words, title) ? 2 : 0) + (are_names_in(words, title) ? 1 : 0);
  if (initials(entry.title).startsWith(text)) return 75;
  if (title.includes(text)) return 70 - title.length / 100;
  if (`${entry.detail} ${entry.group}`.toLowerCase().includes(text)) return 40;
  let at = -1;
  for (const letter of text) if ((at = title.indexOf(letter, at + 1)) < 0) return 0;
  return 10;
}
const are_in_order = (words: string[], title: string): boolean =>
  words.every((word, i) => i === 0 || title.indexOf(words[i - 1]!) <= title.indexOf(word));
/** "motor.y p" are of "motor.y → p" and of "motor.y → plant.p", "p" is none of "motor.y → plant.u". */
const are_names_in = (words: string[], title: string): boolean => {
  const names = new Set(title.split(/\s+/).flatMap((path) => [path, ...path.split(".")]));
  return words.every((word) => names.has(word));
};
const initials = (title: string): string => (title.match(/[A-Z]|(?<=[_. ])[a-z]|^[a-z]/g) ?? []).join("").toLowerCase();

export function ranked<T extends Answer>(entries: T[], wanted: string): T[] {
  return entries.map((entry, i) => ({ entry, i, score: score(entry, wanted) })).filter((found) => found.score > 0)
    .sort((a, b) => b.score - a.score || a.i - b.i).map((found) => found.entry);
}
