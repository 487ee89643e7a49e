import { key_of, neighbour, zoomed } from "./geometry.ts";
import { have_labels, may_enter, with_labels } from "./operations.ts";
import type { Point } from "./protocol.ts";
import { print, save_picture } from "./save.ts";
import type { Target } from "./dialog.ts";
import type { Session } from "./session.svelte.ts";

/** Whatever a person can ask for: keys, the search and the help come from this list. */
export interface Command {
  title: string;
  group: "Edit" | "Look" | "Run";
  keys: string[];
  on?: Target[]; // in whose menus it is
  is_hidden?: boolean; // from the search: it needs a key
  is_everywhere?: boolean; // its key acts while somebody writes, and over every dialog
  can?(session: Session): boolean;
  is_on?(session: Session): boolean; // of what is switched on and off
  run(session: Session): unknown;
}

const has_choice = (s: Session) => s.selection.size > 0;
const several = (count: number) => (s: Session) => s.placed.length >= count;
const has_wires = (s: Session) => s.chosen.some((e) => e.kind === "wire");
const grow = (x: number, y: number) => (s: Session) => s.grow({ x, y });
const has_blocks = (s: Session) => s.chosen_blocks.length > 0;
const has_time = (s: Session) => s.run.live === null;
const is_simulated = (s: Session) => s.run.live === null && !s.run.recorded;
const only = (s: Session) => s.only;
const has_wire = (s: Session) => only(s)?.kind === "wire" && !s.is_chart;
const has_signal = (s: Session) => s.signal !== null;
const has_sources = (s: Session) => s.sources.length > 0;
const is_watched = (s: Session) => s.sources.every((source) => s.watched.includes(source));
const a_signal: Target[] = ["wire", "port", "block"];

function go(direction: Point): (s: Session) => void {
  return (s) => {
    const from = s.find(s.focus), first = s.drawing?.elements.find((e) => e.kind !== "wire");
    const to = from && s.drawing ? neighbour(s.drawing, from, direction) : first;
    if (to) s.select([key_of(to)]);
  };
}
function go_through(by: 1 | -1): (s: Session) => void {
  return (s) => {
    const elements = s.drawing?.elements ?? [];
    const at = elements.findIndex((e) => key_of(e) === s.focus);
    const to = elements[(at + by + elements.length) % elements.length];
    if (to) s.select([key_of(to)]);
  };
}
const zoom = (factor: number) => (s: Session) =>
  (s.view = zoomed(s.view, { x: s.size.width / 2, y: s.size.height / 2 }, factor));
const nudge = (x: number, y: number) => (s: Session) => s.nudge({ x, y });

export const commands: Command[] = [
  { title: "Search and insert", group: "Edit", keys: ["Ctrl+K"], on: ["empty", "wire"], is_hidden: true,
    run: (s) => (s.dialog = has_wire(s) ? { kind: "search", into: only(s)! } : { kind: "search" }) },
  { title: "Connect", group: "Edit", keys: ["C"], on: ["block", "port"], can: (s) => s.drawing !== null, run: (s) => (s.dialog = { kind: "connect" }) },
  { title: "Rename; name the signal of a wire", group: "Edit", keys: ["F2"], on: ["block", "wire", "note"],
    can: (s) => only(s) !== null && (only(s)!.kind !== "wire" || has_wire(s)), run: (s) => (s.renamed = key_of(only(s)!)) },
  { title: "Mend a mistake", group: "Edit", keys: ["Ctrl+."], on: ["block", "wire"], can: (s) => s.mendable.length > 0, run: (s) => (s.dialog = { kind: "fix" }) },
  { title: "Record the signal", group: "Edit", keys: ["L"], on: a_signal, can: has_signal, is_on: (s) => s.kept_in("") !== null, run: (s) => s.keep_signal("") },
  { title: "Add the signal to a plot of the model", group: "Edit", keys: ["Shift+L"], on: a_signal, can: has_signal, run: (s) => (s.dialog = { kind: "plots" }) },
  { title: "Remove", group: "Edit", keys: ["Delete", "Backspace"], on: ["block", "wire", "note"], can: has_choice, run: (s) => s.remove() },
  { title: "Flip", group: "Edit", keys: ["R"], on: ["block"], can: has_blocks, run: (s) => s.flip() },
  { title: "Rotate by a quarter", group: "Edit", keys: ["Shift+R"], on: ["block"], can: has_blocks, run: (s) => s.rotate() },
  { title: "Group into a subsystem", group: "Edit", keys: ["Ctrl+G"], on: ["block"], can: has_blocks, run: (s) => s.group() },
  { title: "Dissolve the subsystem", group: "Edit", keys: ["Ctrl+Shift+G"], on: ["block"], can: (s) => s.chosen.some((e) => e.kind === "subsystem"),
    run: (s) => s.dissolve() },
  { title: "Arrange all", group: "Edit", keys: ["Ctrl+Shift+A"], on: ["empty"], run: (s) => s.arrange() },
  { title: "Undo", group: "Edit", keys: ["Ctrl+Z"], on: ["empty"], can: (s) => s.can_undo, run: (s) => s.undo() },
  { title: "Redo", group: "Edit", keys: ["Ctrl+Y", "Ctrl+Shift+Z"], on: ["empty"], can: (s) => s.document?.can_redo ?? false, run: (s) => s.redo() },
  { title: "Cut", group: "Edit", keys: ["Ctrl+X"], on: ["block"], can: has_blocks, run: (s) => s.cut() },
  { title: "Copy", group: "Edit", keys: ["Ctrl+C"], on: ["block"], can: has_blocks, run: (s) => s.copy() },
  { title: "Paste", group: "Edit", keys: ["Ctrl+V"], on: ["empty"], run: (s) => s.paste() },
  { title: "Duplicate", group: "Edit", keys: ["Ctrl+D"], on: ["block"], can: has_blocks, run: (s) => s.duplicate() },
  { title: "Select all", group: "Edit", keys: ["Ctrl+A"], on: ["empty"], run: (s) => s.select(s.drawing?.elements.map(key_of) ?? []) },
  { title: "Move left", group: "Edit", keys: ["Shift+ArrowLeft"], is_hidden: true, can: has_choice, run: nudge(-10, 0) },
  { title: "Move right", group: "Edit", keys: ["Shift+ArrowRight"], is_hidden: true, can: has_choice, run: nudge(10, 0) },
  { title: "Move up", group: "Edit", keys: ["Shift+ArrowUp"], is_hidden: true, can: has_choice, run: nudge(0, -10) },
  { title: "Move down", group: "Edit", keys: ["Shift+ArrowDown"], is_hidden: true, can: has_choice, run: nudge(0, 10) },
  ...([["left edges", "left", "Alt+ArrowLeft"], ["right edges", "right", "Alt+ArrowRight"], ["upper edges", "top", "Alt+ArrowUp"],
    ["lower edges", "bottom", "Alt+ArrowDown"], ["one above the other", "centre", "Alt+C"], ["side by side", "middle", "Alt+M"]] as const)
    .map(([what, edge, key]): Command => (
      { title: `Align ${what}`, group: "Edit", keys: [key], can: several(2), run: (s) => s.align(edge) })),
  { title: "Distribute horizontally", group: "Edit", keys: ["Alt+H"], can: several(3), run: (s) => s.distribute("x") },
  { title: "Distribute vertically", group: "Edit", keys: ["Alt+V"], can: several(3), run: (s) => s.distribute("y") },
  { title: "Narrower", group: "Edit", keys: ["Alt+Shift+ArrowLeft"], is_hidden: true, can: has_blocks, run: grow(-10, 0) },
  { title: "Wider", group: "Edit", keys: ["Alt+Shift+ArrowRight"], is_hidden: true, can: has_blocks, run: grow(10, 0) },
  { title: "Lower", group: "Edit", keys: ["Alt+Shift+ArrowUp"], is_hidden: true, can: has_blocks, run: grow(0, -10) },
  { title: "Taller", group: "Edit", keys: ["Alt+Shift+ArrowDown"], is_hidden: true, can: has_blocks, run: grow(0, 10) },
  { title: "Labels instead of the wire", group: "Edit", keys: ["Alt+L"], on: ["wire"], can: (s) => has_wires(s) && !s.is_chart, is_on: (s) => have_labels(s.chosen), run: (s) => s.edit(with_labels(s.chosen)) },
  { title: "Let the wire find its way", group: "Edit", keys: ["Alt+W"], on: ["wire"], can: has_wires, run: (s) => s.straighten() },

  { title: "Fit all", group: "Look", keys: ["F"], on: ["empty"], run: (s) => s.fit() },
  { title: "Enlarge", group: "Look", keys: ["+", "Shift++"], run: zoom(1.25) },
  { title: "Reduce", group: "Look", keys: ["-"], run: zoom(0.8) },
  { title: "Open the subsystem, state machine or state", group: "Look", keys: ["Enter"], on: ["block"], can: (s) => only(s) !== null && may_enter(only(s)!), run: (s) => s.enter(only(s)!.path) },
  { title: "Leave the subsystem, choose nothing", group: "Look", keys: ["Escape"], is_hidden: true,
    run: (s) => (has_choice(s) ? s.select([]) : s.leave()) },
  { title: "Block on the left", group: "Look", keys: ["ArrowLeft"], is_hidden: true, run: go({ x: -1, y: 0 }) },
  { title: "Block on the right", group: "Look", keys: ["ArrowRight"], is_hidden: true, run: go({ x: 1, y: 0 }) },
  { title: "Block above", group: "Look", keys: ["ArrowUp"], is_hidden: true, run: go({ x: 0, y: -1 }) },
  { title: "Block beneath", group: "Look", keys: ["ArrowDown"], is_hidden: true, run: go({ x: 0, y: 1 }) },
  { title: "Next wire or block", group: "Look", keys: ["."], is_hidden: true, run: go_through(1) },
  { title: "Wire or block before", group: "Look", keys: [","], is_hidden: true, run: go_through(-1) },
  { title: "Find in the model", group: "Look", keys: ["Ctrl+F"], on: ["empty"], run: (s) => (s.dialog = { kind: "find" }) },
  { title: "Map of the drawing", group: "Look", keys: ["M"], run: (s) => (s.has_map = !s.has_map) },
  { title: "Text of the model", group: "Look", keys: ["Y"], on: ["empty", "block"], is_on: (s) => s.has_text, run: (s) => (s.has_text = !s.has_text) },
  { title: "Code that is generated of the model", group: "Look", keys: ["G"], on: ["empty", "block"], is_on: (s) => s.has_code, run: (s) => (s.has_code = !s.has_code) },
  { title: "Menu of what is chosen", group: "Look", keys: ["Shift+F10", "ContextMenu"], is_hidden: true, run: (s) => s.open_menu() },
  { title: "Colours by sample rate", group: "Look", keys: ["Shift+C"], run: (s) => (s.by_rate = !s.by_rate) },
  { title: "Sizes of signals", group: "Look", keys: [], run: (s) => s.toggle_show("sizes") },
  { title: "Types of signals", group: "Look", keys: [], run: (s) => s.toggle_show("types") },
  { title: "Rates of signals", group: "Look", keys: [], run: (s) => s.toggle_show("rates") },
  { title: "Units of signals", group: "Look", keys: [], run: (s) => s.toggle_show("units") },
  { title: "The robot in three dimensions", group: "Look", keys: ["V"], can: (s) => s.stage.is_possible || s.stage.is_shown,
    run: (s) => s.stage.open(!s.stage.is_shown) },
  { title: "Time of blocks", group: "Look", keys: ["T"], run: (s) => (s.shows_times = !s.shows_times) },
  { title: "Light or dark", group: "Look", keys: [], run: (s) => s.theme.next() },
  { title: "Print the drawing", group: "Look", keys: ["Ctrl+P"], on: ["empty"], can: (s) => s.drawing !== null, run: print },
  { title: "Save the drawing as SVG", group: "Look", keys: ["Ctrl+Shift+S"], on: ["empty"], can: (s) => s.drawing !== null, run: save_picture },
  { title: "Open another model", group: "Look", keys: ["Ctrl+O"], run: (s) => (s.dialog = { kind: "open" }) },
  { title: "Compare with an earlier version", group: "Look", keys: ["Shift+D"], run: (s) => (s.dialog = { kind: "earlier" }) },
  { title: "Keys", group: "Look", keys: ["Shift+?", "?"], run: (s) => (s.dialog = { kind: "help" }) },

  { title: "Run or pause", group: "Run", keys: ["P"], can: has_time, run: (s) => s.transport.play_or_pause() },
  { title: "Sliders of variables and parameters", group: "Run", keys: [], can: (s) => is_simulated(s) && s.run.state === "none", run: (s) => s.command("to", { time: 0 }) },
  { title: "One step", group: "Run", keys: ["S"], can: has_time, run: (s) => s.transport.step() },
  { title: "Back to the beginning", group: "Run", keys: ["Home"], can: (s) => is_simulated(s) && s.run.state !== "none", run: (s) => s.command("stop") },
  { title: "Start the program", group: "Run", keys: [], can: (s) => s.attached.is_in_control && s.attached.waits, run: (s) => s.command("start") },
  { title: "Stop the program in order", group: "Run", keys: [], can: (s) => s.attached.is_in_control, run: (s) => s.command("stop") },
  { title: "Emergency stop", group: "Run", keys: ["Shift+Escape"], is_everywhere: true, can: (s) => s.attached.is_in_control, run: (s) => s.command("emergency_stop") },
  { title: "Watch the value of the signal", group: "Run", keys: ["W"], on: a_signal, can: has_sources, is_on: is_watched, run: (s) => (is_watched(s) ? s.unwatch(...s.sources) : s.watch(...s.sources)) },
  { title: "Show the signal in a panel of its own", group: "Run", keys: ["Shift+W"], on: a_signal, can: has_sources, run: (s) => s.plot(s.sources) },
];

/** "Ctrl+Shift+G": Ctrl is also the command key of other keyboards. */
export function chord_of(event: KeyboardEvent): string {
  const key = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  return (event.ctrlKey || event.metaKey ? "Ctrl+" : "") + (event.altKey ? "Alt+" : "") + (event.shiftKey ? "Shift+" : "") + key;
}
const signs: Record<string, string> = { ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", Escape: "Esc" };
/** As it is written for people: "Alt+←". */
export const key_text = (chord: string): string => chord.split("+").map((key) => signs[key] ?? key).join("+");

/** Letters are for who writes. */
export const is_typing = (event: Event): boolean => (event.target as HTMLElement).closest("input, select, textarea, [data-typing]") !== null;
const by_key = new Map(commands.flatMap((command) => command.keys.map((key) => [key, command] as const)));
export const command_of = (event: KeyboardEvent): Command | undefined => by_key.get(chord_of(event));
export const is_possible = (command: Command, session: Session): boolean => command.can?.(session) ?? true;
