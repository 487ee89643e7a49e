import type { Client } from "./client.ts";
import type { RunState } from "./protocol.ts";

/** Asks for samples of a run that were left out, since it was too fast for all of them, where somebody looks. */
export class Refinement {
  private readonly client: Client;
  private readonly run: () => RunState;
  private readonly asked = new Set<string>();

  constructor(client: Client, run: () => RunState) {
    this.client = client;
    this.run = run;
  }

  /** At a span of time, or at an instant. */
  look(from: number, to = from): void {
    const { state, live, recorded, step, branch, reached } = this.run();
    if (state === "none" || live || recorded) return;
    const number = (time: number) => Math.floor(time / step + 1e-6); // of the step that has it
    const wanted = `${branch} ${state === "running" ? "" : reached} ${number(from)} ${number(to)}`;
    if (this.asked.has(wanted)) return;
    this.asked.add(wanted);
    void this.client.call("refine", { from: Math.max(from, 0), to }).catch(() => this.asked.delete(wanted));
  }
  /** Other signals are watched, or another run. */
  forget(): void { this.asked.clear(); }
}
