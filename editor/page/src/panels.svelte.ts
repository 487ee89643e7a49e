import type { Operation } from "./operations.ts";
import type { DocumentState, PanelInfo } from "./protocol.ts";

export type Shows = PanelInfo["shows"];
export const kinds: [Shows, string][] = [
  ["lines", "Over time"], ["xy", "One against another"], ["bars", "Bars"], ["heat_map", "Heat map"], ["numbers", "Numbers"], ["states", "States"],
];

/** The panels in which runs are watched: the model's own plots, and what a person arranges, which its layout keeps. */
export class Panels {
  /** What all of them show of the time; null: all of it. */
  range = $state.raw<{ from: number; to: number } | null>(null);
  /** The instant under the pointer, in whichever of them it is; null: none. */
  pointed = $state<number | null>(null);
  /** The signal that a pointer carries from the drawing, and where to; null: none. */
  carried = $state.raw<{ source: string; over: string | null; x: number; y: number } | null>(null);

  private readonly document: () => DocumentState | null;
  private readonly edit: (operation: Operation) => Promise<boolean>;

  constructor(document: () => DocumentState | null, edit: (operation: Operation) => Promise<boolean>) {
    this.document = document;
    this.edit = edit;
  }

  get list(): PanelInfo[] { return this.document()?.panels ?? []; }
  get signals(): string[] { return [...new Set(this.list.flatMap((panel) => panel.signals))]; }

  private kept(name: string, panel: { name?: string; shows: Shows; signals: string[] }): Operation {
    return { do: "watch", name, display: { name: panel.name ?? name, shows: panel.shows, signals: panel.signals.map((path) => ({ path })) } };
  }
  private keep(...panel: Parameters<Panels["kept"]>): Promise<boolean> { return this.edit(this.kept(...panel)); }
  add(name: string, signal: string): Promise<boolean> | undefined {
    const panel = this.list.find((other) => other.name === name);
    if (panel && !panel.signals.includes(signal)) return this.keep(name, { ...panel, signals: [...panel.signals, signal] });
  }
  take_off(panel: PanelInfo, signal: string): Promise<boolean> {
    return this.keep(panel.name, { ...panel, signals: panel.signals.filter((other) => other !== signal) });
  }
  show(panel: PanelInfo, shows: Shows): Promise<boolean> { return this.keep(panel.name, { ...panel, shows }); }
  rename(panel: PanelInfo, name: string): Promise<boolean> { return this.keep(panel.name, { ...panel, name }); }
  /** One for each list of signals. */
  create(...lists: string[][]): Promise<boolean> {
    const taken = new Set(this.list.map((panel) => panel.name));
    let n = 0;
    return this.edit({ do: "batch", operations: lists.map((signals) => {
      do ++n; while (taken.has(`panel ${n}`));
      return this.kept(`panel ${n}`, { shows: "lines", signals });
    }) });
  }
  remove(panel: PanelInfo): Promise<boolean> { return this.edit({ do: "watch", name: panel.name }); }

  zoom(factor: number, by: number, all: { from: number; to: number }): void {
    const { from, to } = this.range ?? all, middle = (from + to) / 2 + by * (to - from), half = ((to - from) / 2) * factor;
    const next = { from: Math.max(all.from, middle - half), to: Math.min(all.to, middle + half) };
    this.range = next.from <= all.from && next.to >= all.to ? null : next;
  }
}
