// The editor of a model's text; loaded with CodeMirror when it is looked at.
import { defaultKeymap, history, redo, redoDepth, undo, undoDepth } from "@codemirror/commands";
import { yaml } from "@codemirror/lang-yaml";
import { HighlightStyle, indentOnInput, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { diff } from "@codemirror/merge";
import { highlightSelectionMatches, searchKeymap } from "@codemirror/search";
import { Annotation, ChangeSet, Compartment, EditorState, StateEffect, StateField, type Extension } from "@codemirror/state";
import { Decoration, EditorView, keymap, lineNumbers, type DecorationSet } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import type { Draft, Drafts } from "./drafts.ts";
import { key_of_place } from "./geometry.ts";
import type { Diagnostic, FileText, Rewritten, TextPlace } from "./protocol.ts";

/** What the editor asks of the page. */
export interface Desk {
  read(): Promise<FileText | null>;
  write(file: string, text: string, before: string): Promise<Rewritten | null>;
  undo(): void;
  redo(): void;
  leave(): void;
  /** The cursor went there. */
  point(place: TextPlace): void;
  /** Of the model in the files. */
  mistakes(): Diagnostic[];
  tell(state: State): void;
  drafts: Drafts;
}
/** What stands in the way of what was typed. */
export type State = { kind: "written" | "typing" | "kept" } | { kind: "wrong"; mistakes: Diagnostic[] } | { kind: "clash"; lines: number[] };

const pause = 400; // ms without a key before what was typed is written

interface Edit { from: number; to: number; insert: string }
/** What turns one text into another, by the letter. */
export const edits_between = (a: string, b: string): Edit[] =>
  a === b ? [] : diff(a, b, { scanLimit: 1000, timeout: 100 }).map(({ fromA, toA, fromB, toB }) => ({ from: fromA, to: toA, insert: b.slice(fromB, toB) }));
const changes = (a: string, edits: Edit[]): ChangeSet => ChangeSet.of(edits, a.length);

/** The edits that change lines which the other ones change, too. */
export function clashing(a: string, edits: Edit[], others: Edit[]): Edit[] {
  const begin = ({ from }: Edit) => a.lastIndexOf("\n", from - 1) + 1;
  const end = ({ to }: Edit) => (a.indexOf("\n", to) + 1 || a.length + 1) - 1;
  return edits.filter((edit) => others.some((other) => begin(edit) <= end(other) && begin(other) <= end(edit)));
}

const from_elsewhere = Annotation.define<boolean>();
export const mark_lines = StateEffect.define<{ from: number; to: number }[]>();
const chosen_line = Decoration.line({ class: "cm-chosen" });
export const chosen_lines = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(lines, transaction) {
    let now = lines.map(transaction.changes);
    for (const effect of transaction.effects)
      if (effect.is(mark_lines)) now = Decoration.set(effect.value.flatMap(({ from, to }) =>
        Array.from({ length: to - from + 1 }, (_, i) => chosen_line.range(transaction.state.doc.line(from + i).from))), true);
    return now;
  },
  provide: (field) => EditorView.decorations.from(field),
});

export const look: Extension = [
  EditorView.theme({
    "&": { height: "100%", color: "var(--text)", backgroundColor: "var(--panel)", fontSize: "12px" },
    "&.cm-focused": { outline: "2px solid var(--accent)", outlineOffset: "-2px" },
    ".cm-scroller": { fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace', lineHeight: "1.5" },
    ".cm-content": { caretColor: "var(--text)" },
    ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--quiet)", border: "0" },
    ".cm-chosen": { backgroundColor: "var(--accent-soft)" },
    ".cm-selectionMatch, .cm-searchMatch": { backgroundColor: "var(--accent-soft)" },
    ".cm-panels, .cm-tooltip": { backgroundColor: "var(--panel)", color: "var(--text)", borderColor: "var(--rule)" },
    ".cm-button, .cm-textfield": { backgroundImage: "none", backgroundColor: "var(--raised)", borderColor: "var(--rule)", color: "var(--text)" },
    ".cm-diagnostic": { whiteSpace: "pre-line", maxWidth: "480px" },
  }),
  syntaxHighlighting(HighlightStyle.define([
    { tag: tags.propertyName, color: "var(--accent)" },
    { tag: [tags.comment, tags.punctuation, tags.separator], color: "var(--quiet)" },
    { tag: [tags.string, tags.special(tags.string), tags.number], color: "var(--label)" },
    { tag: [tags.keyword, tags.typeName], color: "var(--accent)" },
  ])),
];

/**
 * Shows a file of the model and writes what is typed, as soon as it is a model. What others change meanwhile is taken over
 * into what is typed; where both changed the same lines, the person chooses.
 */
export class TextEditor {
  readonly view: EditorView;
  private file = "";
  private base = ""; // what the service has
  private places: TextPlace[] = [];
  private rejected: Diagnostic[] = [];
  private clash: FileText | null = null;
  private kept: Draft | null = null; // what an earlier page left; until it is decided nothing is typed
  private wanted: string | null = null; // key of what is chosen
  private is_stale = false;
  private is_due = false;
  private is_at_work = false;
  private timer = 0;
  private readonly undoing = new Compartment();
  private readonly locking = new Compartment();
  private readonly desk: Desk;

  constructor(parent: HTMLElement, desk: Desk) {
    this.desk = desk;
    this.view = new EditorView({ parent, root: parent.getRootNode() as ShadowRoot, state: this.state("") });
    this.refresh();
  }
  destroy(): void {
    clearTimeout(this.timer);
    this.view.destroy();
  }
  private state(text: string): EditorState {
    const back = () => (undoDepth(this.view.state) > 0 ? undo(this.view) : (this.desk.undo(), true));
    const forth = () => (redoDepth(this.view.state) > 0 ? redo(this.view) : (this.desk.redo(), true));
    return EditorState.create({ doc: text, extensions: [
      EditorState.lineSeparator.of("\n"), lineNumbers(), lintGutter(), yaml(), indentOnInput(), highlightSelectionMatches(), chosen_lines, look,
      this.undoing.of(history()), this.locking.of(EditorState.readOnly.of(this.kept !== null)),
      EditorView.contentAttributes.of({ "aria-label": "Text of the model", tabindex: "0" }),
      keymap.of([{ key: "Mod-z", run: back }, { key: "Mod-y", mac: "Mod-Shift-z", run: forth }, { key: "Mod-Shift-z", run: forth },
        ...searchKeymap, ...lintKeymap, ...defaultKeymap, { key: "Escape", run: () => (this.desk.leave(), true) }]),
      EditorView.updateListener.of((update) => {
        if (update.docChanged && !update.transactions.some((t) => t.annotation(from_elsewhere))) this.typed();
        if (update.transactions.some((t) => t.isUserEvent("select"))) this.point();
      }),
    ] });
  }
  private get text(): string { return this.view.state.doc.toString(); }
  private get is_own(): boolean { return this.text !== this.base; }
  private remember(): void { this.desk.drafts.set(this.file, this.is_own ? { base: this.base, text: this.text } : null); }

  // ---- typing, and what others write ----

  private typed(): void {
    this.remember();
    this.desk.tell(this.clash ? this.clash_state : { kind: "typing" });
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      this.is_due = true;
      void this.work();
    }, pause);
  }
  /** The document has changed, or another file is to be shown. */
  refresh(): void {
    this.is_stale = true;
    void this.work();
  }
  /** One request after the other, so that `base` is what the service has. */
  private async work(): Promise<void> {
    if (this.is_at_work) return;
    this.is_at_work = true;
    while (this.is_due || this.is_stale) {
      if (this.is_due) {
        this.is_due = false;
        await this.write();
      } else {
        this.is_stale = false;
        const found = await this.desk.read();
        if (found) this.take(found);
      }
    }
    this.is_at_work = false;
  }
  private async write(): Promise<void> {
    const text = this.text, before = this.base;
    if (this.clash) return;
    if (text !== before) {
      const answer = await this.desk.write(this.file, text, before);
      if (!answer) return; // without a connection; the document comes again with it
      if (answer.is_outdated) {
        const found = await this.desk.read();
        if (found) this.take(found);
        this.is_due = this.is_own;
        return;
      }
      this.rejected = answer.diagnostics;
      if (this.rejected.length === 0) this.written(text);
    } else {
      this.rejected = [];
    }
    this.remember();
    this.show();
  }
  /** From here on the document's undo takes it back. */
  private written(text: string): void {
    this.base = text;
    if (this.is_own) return;
    this.view.dispatch({ effects: this.undoing.reconfigure([]) });
    this.view.dispatch({ effects: this.undoing.reconfigure(history()) });
  }
  private take(found: FileText): void {
    if (found.file !== this.file) {
      const draft = this.desk.drafts.get(found.file), own = draft?.is_own ? draft : null;
      this.kept = draft && !own && draft.text !== found.text ? draft : null;
      this.file = found.file;
      this.base = own?.base ?? found.text;
      this.clash = null;
      this.view.setState(this.state(own?.text ?? found.text));
      this.is_due = own !== null;
    }
    const theirs = edits_between(this.base, found.text), mine = edits_between(this.base, this.text);
    if (this.text !== found.text && clashing(this.base, theirs, mine).length > 0) {
      this.clash = found;
    } else {
      this.clash = null;
      this.put(this.text === found.text ? [] : theirs, mine, found.text);
      if (this.is_own) this.is_due = true;
      else this.rejected = found.diagnostics;
    }
    this.places = found.places;
    this.show();
  }
  private put(theirs: Edit[], mine: Edit[], base: string): void {
    const set = changes(this.base, theirs).map(changes(this.base, mine));
    this.base = base;
    if (!set.empty) this.view.dispatch({ changes: set, annotations: from_elsewhere.of(true) });
  }
  /** What an earlier page left is typed again, or thrown away. */
  take_up(is_wanted: boolean): void {
    const draft = this.kept;
    if (!draft) return;
    this.kept = null;
    if (is_wanted) {
      this.base = draft.base;
      this.view.setState(this.state(draft.text));
    } else this.view.dispatch({ effects: this.locking.reconfigure(EditorState.readOnly.of(false)) });
    this.remember();
    this.view.focus();
    this.refresh();
  }
  /** Ends a clash: what others wrote stays elsewhere, and in the lines that both changed on demand. */
  decide(is_mine: boolean): void {
    const found = this.clash;
    if (!found) return;
    this.clash = null;
    const theirs = edits_between(this.base, found.text), mine = edits_between(this.base, this.text);
    if (is_mine) {
      const clash = new Set(clashing(this.base, theirs, mine));
      this.put(theirs.filter((edit) => !clash.has(edit)), mine, found.text);
    } else {
      this.base = this.text;
      this.put(edits_between(this.text, found.text), [], found.text);
    }
    this.remember();
    this.is_due = true;
    void this.work();
  }

  // ---- what is shown ----

  private get clash_state(): State {
    const edits = edits_between(this.base, this.text);
    const theirs = edits_between(this.base, this.clash!.text), mine = changes(this.base, edits);
    const lines = clashing(this.base, edits, theirs).map(({ from }) => this.view.state.doc.lineAt(mine.mapPos(from, -1)).number);
    return { kind: "clash", lines: [...new Set(lines)] };
  }
  /** Marks mistakes: of what is typed, or of the model where it is that. */
  show(): void {
    const { doc } = this.view.state;
    const mistakes = (this.is_own || this.rejected.length > 0 ? this.rejected : this.desk.mistakes())
      .filter((mistake) => mistake.file === this.file && mistake.line >= 1 && mistake.line <= doc.lines);
    this.view.dispatch(setDiagnostics(this.view.state, mistakes.map(({ line, column, path, message, remedy }) => {
      const at = doc.line(line), from = Math.min(at.from + Math.max(column - 1, 0), at.to);
      return { from, to: at.to, severity: "error", message: `${path ? `${path}: ` : ""}${message}${remedy ? `; ${remedy}` : ""}` };
    })));
    this.desk.tell(this.kept ? { kind: "kept" } : this.clash ? this.clash_state : this.rejected.length > 0 ? { kind: "wrong", mistakes: this.rejected }
      : { kind: this.is_own ? "typing" : "written" });
    this.choose(this.wanted, false);
  }
  /** Marks the lines of what is chosen, and brings them into view. */
  choose(key: string | null, is_shown = true): void {
    this.wanted = key;
    const place = key === null || this.is_own ? undefined : this.places.find((one) => key_of_place(one) === key);
    const { doc } = this.view.state, lines = place && place.last <= doc.lines ? [{ from: place.line, to: place.last }] : [];
    this.view.dispatch({ effects: [mark_lines.of(lines),
      ...(is_shown && lines[0] ? [EditorView.scrollIntoView(doc.line(lines[0].from).from, { y: "nearest", yMargin: 60 })] : [])] });
  }
  private point(): void {
    if (this.is_own) return;
    const { doc, selection } = this.view.state, at = doc.lineAt(selection.main.head), column = selection.main.head - at.from + 1;
    const place = this.places.findLast(({ line, column: first, last }) =>
      (line < at.number || (line === at.number && first <= column)) && at.number <= last);
    if (place && key_of_place(place) !== this.wanted) this.desk.point(place);
  }
}
