import type { RunState } from "./protocol.ts";

/** Values of the run that are not those of the model. */
export class Tuning {
  private wished = $state.raw<ReadonlyMap<string, number[]>>(new Map()); // values that are asked for
  private is_under_way = false;
  private readonly run: () => RunState;
  private readonly tune: (name: string, values: number[]) => Promise<void>;

  constructor(run: Tuning["run"], tune: Tuning["tune"]) {
    this.run = run;
    this.tune = tune;
  }

  /** What the run has otherwise than the model, and what a slider is being drawn to. */
  readonly values: ReadonlyMap<string, number[]> = $derived.by(() =>
    new Map([...this.run().tuned.map(({ name, values }) => [name, values] as const), ...this.wished]));
  /** The newest values of each name win; one request at a time. */
  async set(name: string, values: number[]): Promise<void> {
    this.wished = new Map([...this.wished, [name, values]]);
    if (this.is_under_way) return;
    this.is_under_way = true;
    while (this.wished.size > 0) {
      const [next, wanted] = this.wished.entries().next().value!;
      await this.tune(next, wanted);
      if (this.wished.get(next) === wanted) this.wished = new Map([...this.wished].filter(([other]) => other !== next));
    }
    this.is_under_way = false;
  }
}
