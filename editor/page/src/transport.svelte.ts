import { keep, kept } from "./kept.ts";
import type { Methods, RunState } from "./protocol.ts";

type Command = Methods["run"]["params"];
const fast = 20; // seconds of a recording per second, where no speed is wanted

/** Play, pause, step and speed: of the run, or of a recording, through which the page goes from instant to instant. */
export class Transport {
  pace = $state<number | null>((kept<{ pace: number | null }>("localStorage", "pace") ?? { pace: 1 }).pace); // seconds of the model per second
  private is_playing = $state(false); // a recording
  private readonly run: () => RunState;
  private readonly is_connected: () => boolean;
  private readonly command: (action: Command["action"], given?: Partial<Command>) => Promise<void>;

  constructor(run: Transport["run"], is_connected: Transport["is_connected"], command: Transport["command"]) {
    this.run = run;
    this.is_connected = is_connected;
    this.command = command;
  }

  get is_running(): boolean { return this.run().state === "running" || this.is_playing; }
  async play_or_pause(): Promise<void> {
    if (this.run().recorded && !this.is_playing) return this.play_recorded();
    this.is_playing = false;
    if (this.run().recorded) return;
    return this.run().state === "running" ? this.command("pause") : this.command("start", { factor: this.pace });
  }
  private async play_recorded(): Promise<void> {
    this.is_playing = true;
    if (this.run().time >= this.run().reached) await this.command("to", { time: 0 });
    for (let last = performance.now(); this.is_playing && this.is_connected() && this.run().time < this.run().reached; ) {
      await new Promise(requestAnimationFrame);
      const now = performance.now();
      await this.command("to", { time: this.run().time + ((this.pace ?? fast) * (now - last)) / 1000 });
      last = now;
    }
    this.is_playing = false;
  }
  set_pace(pace: number | null): void {
    this.pace = pace;
    keep("localStorage", "pace", { pace });
    if (this.run().state !== "none" && !this.run().recorded) void this.command("pace", { factor: pace });
  }
  /** One step, or the next instant of a recording. */
  step(): Promise<void> {
    return this.run().recorded ? this.command("to", { time: this.run().time + this.run().step }) : this.command("step");
  }
}
