import { Refusal, type Place, type Socket } from "./client.ts";

/** What bf publish writes beside the page: the service in WebAssembly, and the files of the model. */
export interface Published {
  engine: { script: string; wasm: string }; // of a worker; gzip in base64
  /** Files as gzip in base64; of a model that does not run here also one of these files, which was recorded, and what its plugins declare. */
  model: { file: string; files: Record<string, string>; recording?: string; plugins?: Record<string, string> };
}
type Told = string | ArrayBuffer | { is_open: true } | { wrong: string } | { id: number; value: unknown };

const bytes_of = (base64: string): Uint8Array<ArrayBuffer> => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
const unpacked = (gzip: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> =>
  new Response(new Blob([gzip]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();

/** The service in a worker of the page: nothing is asked of any network, and edits live as long as the page. */
export class Engine implements Place {
  private readonly worker: Worker;
  private readonly socket: Socket & { readyState: number };
  private waiting = new Map<number, (value: unknown) => void>();
  private number = 0;

  /** `failed` is told why there is no service, or none any more. */
  constructor({ engine, model }: Published, failed: (reason: string) => void) {
    const address = URL.createObjectURL(new Blob([engine.script], { type: "text/javascript" }));
    const worker = (this.worker = new Worker(address));
    this.socket = { readyState: WebSocket.CONNECTING, onopen: null, onmessage: null, onclose: null,
      send: (text) => worker.postMessage(text), close: () => worker.terminate() };
    worker.onerror = (event) => failed(`${event.message || "the browser does not run it"}; load the page again`);
    worker.onmessage = ({ data }: MessageEvent<Told>) => {
      if (typeof data === "string" || data instanceof ArrayBuffer) this.socket.onmessage?.(new MessageEvent("message", { data }));
      else if ("id" in data) this.settle(data.id, data.value);
      else if ("wrong" in data) failed(data.wrong);
      else {
        this.socket.readyState = WebSocket.OPEN;
        this.socket.onopen?.(new Event("open"));
      }
    };
    const unpack = (files: Record<string, string> = {}) => Promise.all(Object.entries(files).map(async ([name, gzip]) => [name, new Uint8Array(await unpacked(bytes_of(gzip)))]));
    const { file, recording } = model;
    Promise.all([unpacked(bytes_of(engine.wasm)), unpack(model.files), unpack(model.plugins)]).then(
      ([wasm, files, plugins]) => worker.postMessage({ wasm, file, files, recording, plugins }, [wasm]),
      (error: Error) => failed(error.message));
  }

  connect(): Socket { return this.socket; }
  async data(path: string): Promise<ArrayBuffer> {
    const data = await this.ask<ArrayBuffer | null>({ data: path });
    if (!data) throw new Refusal("there is no such recording any more");
    return data;
  }
  edited(): Promise<{ name: string; text: string }[]> { return this.ask({}); }

  private ask<T>(what: object): Promise<T> {
    const id = ++this.number;
    this.worker.postMessage({ ...what, id });
    return new Promise((resolve) => this.waiting.set(id, resolve as (value: unknown) => void));
  }
  private settle(id: number, value: unknown): void {
    this.waiting.get(id)?.(value);
    this.waiting.delete(id);
  }
}
