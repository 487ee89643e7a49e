import type { Client } from "./client.ts";
import { last_of, parent_of } from "./operations.ts";
import type { Recorded } from "./protocol.ts";
import { Samples, type Track } from "./samples.ts";

/** As the run finds its signals: the one of that path, or the only output of the block or subsystem of that path. */
function signal_in(recorded: Recorded, path: string) {
  const under = recorded.signals.filter((other) => parent_of(other.path) === path);
  return recorded.signals.find((other) => other.path === path) ?? (under.length === 1 ? under[0] : undefined);
}

/** Recordings that are compared with the run, and as much of them as panels show. */
export class Recordings {
  files = $state.raw<string[]>([]);
  opened = $state.raw<Recorded[]>([]);
  /** What has been asked for, and is not there yet. */
  reading = $state.raw<{ number: number; file: string }[]>([]);
  wrong = $state("");
  private loaded = $state(0);

  private readonly client: Client;
  private readonly fetch_data: (path: string) => Promise<ArrayBuffer>;
  private readonly changed: () => void;
  private tracks = new Map<string, Track | null>(); // by number and index; null: on its way

  constructor(client: Client, fetch_data: (path: string) => Promise<ArrayBuffer>, changed: () => void) {
    this.client = client;
    this.fetch_data = fetch_data;
    this.changed = changed;
  }

  async look(): Promise<void> {
    this.files = (await this.client.call("recordings", {}).catch(() => null))?.files ?? [];
  }
  async open(file: string): Promise<void> {
    this.wrong = "";
    try {
      const { number } = await this.client.call("read", { file });
      this.reading = [...this.reading, { number, file }];
    } catch (error) {
      this.wrong = (error as Error).message;
    }
  }
  /** Of this page or another. */
  hear(recorded: Recorded): void {
    const { number, file, failure } = recorded, waiting = this.reading.length;
    this.reading = this.reading.filter((other) => other.number !== number);
    if (this.reading.length === waiting) return;
    this.wrong = failure;
    if (failure) return;
    for (const other of this.opened.filter((one) => one.file === file)) this.close(other.number);
    this.opened = [...this.opened, recorded];
    this.changed();
  }
  lost(): void {
    if (this.reading.length > 0) this.wrong = `the connection was lost while ${this.reading.map(({ file }) => file).join(", ")} was read`;
    this.reading = [];
  }
  close(number: number): void {
    this.reading = this.reading.filter((other) => other.number !== number);
    this.opened = this.opened.filter((other) => other.number !== number);
    for (const key of this.tracks.keys()) if (key.startsWith(`${number}/`)) this.tracks.delete(key);
    void this.client.call("close", { number }).catch(() => null);
    this.changed();
  }

  /** What each recording has of a signal, by its path or that of its block; what is not there yet comes. */
  tracks_of(path: string): { name: string; track: Track | null; until: number }[] {
    void this.loaded;
    return this.opened.map((recorded) => {
      const signal = signal_in(recorded, path);
      const name = last_of(recorded.file.replace(/\.mcap$/, "").replace(/\//g, "."));
      return { name, track: signal ? this.track(recorded, signal.index) : null, until: recorded.end };
    });
  }
  /** The files that do not have a signal. */
  without(path: string): string[] {
    return this.opened.filter((recorded) => !signal_in(recorded, path)).map((recorded) => recorded.file);
  }
  private track(recorded: Recorded, index: number): Track | null {
    const key = `${recorded.number}/${index}`, known = this.tracks.get(key);
    if (known !== undefined) return known;
    this.tracks.set(key, null);
    void this.fetch_data(`recordings/${key}`).then((data) => {
      const samples = new Samples();
      samples.take(data);
      const track = samples.along(0, index);
      if (!track || !this.opened.includes(recorded)) return;
      this.tracks.set(key, track);
      ++this.loaded;
      this.changed();
    }).catch((error: Error) => (this.wrong = error.message));
    return null;
  }
}
