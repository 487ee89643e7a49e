// Generated code; loaded with CodeMirror when it is looked at.
import { defaultKeymap } from "@codemirror/commands";
import { cpp } from "@codemirror/lang-cpp";
import { search, searchKeymap } from "@codemirror/search";
import { EditorState } from "@codemirror/state";
import { EditorView, keymap, lineNumbers } from "@codemirror/view";
import { chosen_lines, look, mark_lines } from "./text.ts";

export interface Lines { from: number; to: number }

/** Shows a file, or some lines of it; nothing is typed there. */
export class CodeViewer {
  private readonly view: EditorView;
  private numbers: number[] = []; // of the lines that are shown

  constructor(parent: HTMLElement, leave: () => void, point: (line: number) => void) {
    const state = EditorState.create({ extensions: [
      EditorState.readOnly.of(true), lineNumbers({ formatNumber: (line) => String(this.numbers[line - 1] ?? line) }), cpp(), search(), chosen_lines, look,
      EditorView.contentAttributes.of({ "aria-label": "Generated code", tabindex: "0" }),
      keymap.of([...searchKeymap, ...defaultKeymap, { key: "Escape", run: () => (leave(), true) }]),
      EditorView.updateListener.of((update) => {
        if (!update.transactions.some((t) => t.isUserEvent("select"))) return;
        const line = this.numbers[update.state.doc.lineAt(update.state.selection.main.head).number - 1];
        if (line !== undefined) point(line);
      }),
    ] });
    this.view = new EditorView({ parent, root: parent.getRootNode() as ShadowRoot, state });
  }
  destroy(): void { this.view.destroy(); }

  /** With the chosen lines marked, or these alone with the comments above them. */
  show(text: string, chosen: Lines[], are_alone: boolean): void {
    const all = text.split("\n"), marked = new Set(chosen.flatMap(({ from, to }) => Array.from({ length: to - from + 1 }, (_, i) => from + i)));
    const heads = new Set(chosen.map(({ from }) => from - 1));
    this.numbers = all.map((_, i) => i + 1).filter((line) => !are_alone || marked.has(line) || heads.has(line));
    const { state } = this.view, shown = this.numbers.map((line) => all[line - 1]).join("\n");
    if (state.doc.toString() !== shown) this.view.dispatch({ changes: { from: 0, to: state.doc.length, insert: shown } });
    const places = this.numbers.flatMap((line, i) => (marked.has(line) ? [{ from: i + 1, to: i + 1 }] : []));
    this.view.dispatch({ effects: [mark_lines.of(places),
      ...(places[0] ? [EditorView.scrollIntoView(this.view.state.doc.line(places[0].from).from, { y: "nearest", yMargin: 60 })] : [])] });
  }
}
