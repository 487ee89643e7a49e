import type { LiveEntry, LiveReport, RunState, Timing } from "./protocol.ts";

/** The program that is attached, where the run is another program's. */
export class Attached {
  report = $state.raw<LiveReport | null>(null);
  page = $state(0); // the number of this one in the program's log
  private readonly pages = new Set<number>(); // that it had, a new one for each connection
  private readonly run: () => RunState;

  constructor(run: () => RunState) { this.run = run; }
  greet(page: number, report: LiveReport | null): void {
    this.pages.add(page);
    [this.page, this.report] = [page, report];
  }

  get timing(): Timing | null { return this.report?.timing ?? null; }
  get log(): LiveEntry[] { return this.report?.log ?? []; }
  is_own(entry: LiveEntry): boolean { return entry.page !== null && this.pages.has(entry.page); }
  /** Can it be started and stopped? */
  get is_in_control(): boolean { return this.run().live !== null && this.refusal === ""; }
  /** Why nothing of it can be changed; empty: it can, or the run is none of another program. */
  get refusal(): string {
    const { state, live } = this.run();
    return live === null ? "" : live.refusal || (state === "running" ? "" : live.message);
  }
  get waits(): boolean { return this.timing?.state === "waiting"; }
  get word(): string {
    const { state } = this.run();
    return state === "running" ? "live" : state === "none" ? "connecting …" : this.timing?.end ? this.timing.state : "not connected";
  }
}
