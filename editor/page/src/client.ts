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

interface Pending { resolve(value: unknown): void; reject(error: Error): void }

/** JSON-RPC over one WebSocket, which is opened again whenever it breaks. */
export class Client {
  private socket: WebSocket | null = null;
  private pending = new Map<number, Pending>();
  private number = 0;
  private wait = 250; // ms until the next attempt
  private is_closed = false;

  private readonly url: string;
  private readonly listener: Listener;

  constructor(url: string, listener: Listener) {
    this.url = url;
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
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
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
