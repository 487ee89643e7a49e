import { Refusal, type Place } from "./client.ts";

/** The service of bf edit, which serves this page. */
export class Server implements Place {
  private readonly url: string;

  /** `url`: of the WebSocket, with the token. */
  constructor(url: string) { this.url = url; }

  connect(): WebSocket {
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    return socket;
  }
  async data(path: string): Promise<ArrayBuffer> {
    const response = await fetch(path + new URL(this.url).search);
    if (!response.ok) throw new Refusal(await response.text());
    return response.arrayBuffer();
  }
}
