import type { Client } from "./client.ts";
import type { Scene, SceneWorld } from "./protocol.ts";

const first_world = 2 ** 31; // index in binary frames
const nothing: Scene = { number: 0, worlds: [], failure: "" };

/** The robot or object that a body belongs to: robots that share a world have links "robot/link". */
export const thing_of = (world: SceneWorld, body: string): string =>
  (world.bodies.some((other) => other.includes("/")) ? body.split("/")[0]! : world.path);
export const things_of = (world: SceneWorld): string[] => [...new Set(world.bodies.map((body) => thing_of(world, body)))];

/** What stands in space in the run, and where it is now. */
export class Stage {
  scene = $state.raw<Scene>(nothing);
  /** Whether it is shown; null: as soon as there is a world. */
  is_open = $state<boolean | null>(null);
  placed = $state(0); // grows with what `places` has
  places = new Map<number, Float64Array>();

  private readonly client: Client;
  private is_asking = false;
  private is_stale = false;

  constructor(client: Client) { this.client = client; }

  get is_shown(): boolean { return this.is_open ?? this.scene.worlds.length > 0; }
  get is_possible(): boolean { return this.scene.worlds.length > 0 || this.scene.failure !== ""; }

  open(is_open: boolean): void {
    this.is_open = is_open;
    void this.ask();
  }
  /** Another model, or another run of it. One request at a time. */
  async ask(): Promise<void> {
    this.is_stale = true;
    if (this.is_asking) return;
    this.is_asking = true;
    while (this.is_stale) {
      this.is_stale = false;
      const scene = await this.client.call("scene", { is_wanted: this.is_open !== false }).catch(() => null);
      if (!scene || this.is_open === false || scene.number === this.scene.number) continue;
      this.places.clear();
      this.scene = scene;
    }
    this.is_asking = false;
  }
  /** A binary frame may tell of worlds, too. */
  take(frame: ArrayBuffer): void {
    const view = new DataView(frame);
    for (let at = 0; at + 20 <= frame.byteLength; ) {
      const index = view.getUint32(at, true), n = view.getUint32(at + 8, true);
      if (at + 20 + 8 * n > frame.byteLength) return;
      if (index >= first_world) {
        this.places.set(index - first_world, new Float64Array(frame.slice(at + 20, at + 20 + 8 * n)));
        ++this.placed;
      }
      at += 20 + 8 * n;
    }
  }
}
