import type { Method, Methods, Notifications } from "./protocol.ts";

/** A request that the service refused, with its reason; or one that was under way when the connection broke. */
export class Refusal extends Error {}

export interface Listener {
  /** The connection is there, again or for the first time. */
  opened(): void;
  lost(): void;
  told<N extends keyof Notifications>(name: N, value: Notifications[N]): void;
  sampled(frame: ArrayBuffer): void;
}

/** What is needed of a WebSocket. */
export interface Socket {
  readonly readyState: number;
  onopen: ((event: Event) => void) | null;
  onmessage: ((event: MessageEvent) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  send(text: string): void;
  close(): void;
}

/** Where the service is. */
export interface Place {
  connect(): Socket;
  /** What it has besides: "meshes/1/0", "recordings/2/3". */
  data(path: string): Promise<ArrayBuffer>;
  /** The model with its edits, where they are in no file. */
  edited?(): Promise<{ name: string; text: string }[]>;
}

interface Pending { resolve(value: unknown): void; reject(error: Error): void }

/** JSON-RPC over one connection, which is opened again whenever it breaks. */
export class Client {
  private socket: Socket | null = null;
  private pending = new Map<number, Pending>();
  private number = 0;
  private wait = 250; // ms until the next attempt
  private is_closed = false;

  private readonly place: Place;
  private readonly listener: Listener;

  constructor(place: Place, listener: Listener) {
    this.place = place;
    this.listener = listener;
    this.connect();
  }

  call<M extends Method>(method: M, params: Methods[M]["params"]): Promise<Methods[M]["result"]> {
    const socket = this.socket;
    if (socket?.readyState !== WebSocket.OPEN) return Promise.reject(new Refusal("there is no connection to bf edit"));
    const id = ++this.number;
    return new Promise((resolve, reject) => {
      this.pending.set(id, { resolve: resolve as (value: unknown) => void, reject });
      socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, params }));
    });
  }

  close(): void {
    this.is_closed = true;
    this.socket?.close();
  }

  private connect(): void {
    const socket = this.place.connect();
    socket.onopen = () => {
      this.wait = 250;
      this.listener.opened();
    };
    socket.onmessage = (event) => this.receive(event.data as string | ArrayBuffer);
    socket.onclose = () => {
      for (const { reject } of this.pending.values()) reject(new Refusal("the connection to bf edit is lost"));
      this.pending.clear();
      if (this.is_closed) return;
      this.listener.lost();
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(2 * this.wait, 4000);
    };
    this.socket = socket;
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== "string") return this.listener.sampled(data);
    const message = JSON.parse(data);
    if (message.method) return this.listener.told(message.method, message.params);
    const pending = this.pending.get(message.id);
    this.pending.delete(message.id);
    if (message.error) pending?.reject(new Refusal(message.error.message));
    else pending?.resolve(message.result);
  }
}
