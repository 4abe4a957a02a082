/// The way to the server: commands with their answers, events, frames; comes back after a lost connection.
import { signal } from "@preact/signals";
import type { Diagnostic } from "./steer_wire";

export type Message = Record<string, unknown> & { type: string };
export interface ErrorObject {
  code: string;
  message: string;
  help?: string;
  diagnostics?: Diagnostic[];
  [key: string]: unknown;
}
export class CommandError extends Error {
  constructor(readonly error: ErrorObject) {
    super(error.message);
  }
}

interface Pending {
  id: number;
  text: string;
  sent: boolean;
  resolve: (result: never) => void;
  reject: (error: CommandError) => void;
}

export interface Listener {
  onMessage(message: Message): void;
  onFrame(bytes: ArrayBuffer): void;
}

export type Status = "connecting" | "open" | "lost" | "ended" | "gone";

const silenceLimit = 20000; // then a ping asks whether the server is there [ms]
const answerLimit = 10000;
const manyTries = 6; // some ten seconds without an answer

export class Connection {
  readonly status = signal<Status>("connecting");
  /// Nobody has answered for a while: there may be no server any more.
  readonly unanswered = signal(false);
  private socket: WebSocket | undefined;
  private readonly pending = new Map<number, Pending>();
  private nextId = 1;
  private resume = "";
  private seq = 0;
  private tries = 0;
  private greeted = false;
  private lastHeard = 0;
  private retry: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly address: string, private readonly listener: Listener) {
    this.open();
    setInterval(() => this.watch(), 2000);
    const comeBack = (): void => {
      if (document.visibilityState === "visible" && this.status.value === "lost") this.open();
    };
    addEventListener("online", comeBack);
    document.addEventListener("visibilitychange", comeBack);
  }

  /// Sent as soon as there is a connection. Rejects with a CommandError.
  command<R = Record<string, unknown>>(command: string, keys: Record<string, unknown> = {}): Promise<R> {
    return new Promise<R>((resolve, reject) => {
      const id = this.nextId++;
      const one: Pending = { id, text: JSON.stringify({ id, command, ...keys }), sent: false, resolve: resolve as (r: never) => void, reject };
      this.pending.set(id, one);
      if (this.greeted) this.send(one);
    });
  }

  private send(one: Pending): void {
    one.sent = true;
    this.socket?.send(one.text);
  }

  private open(): void {
    clearTimeout(this.retry);
    if (this.isOver()) return;
    this.socket?.close();
    const socket = new WebSocket(this.resume === "" ? this.address : `${this.address}?resume=${this.resume}&seq=${this.seq}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.greeted = false;
    this.lastHeard = performance.now();
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      if (this.socket !== socket) return;
      this.lastHeard = performance.now();
      if (typeof event.data === "string") this.receive(JSON.parse(event.data) as Message);
      else this.listener.onFrame(event.data);
    };
    socket.onclose = () => {
      if (this.socket === socket) this.lose();
    };
  }

  private lose(): void {
    this.socket = undefined;
    this.greeted = false;
    if (this.isOver()) return;
    this.status.value = "lost";
    clearTimeout(this.retry);
    this.retry = setTimeout(() => this.open(), Math.min(4000, 250 * 2 ** this.tries++));
    if (this.tries > 1) void this.askWhetherItIsKnown();
    this.unanswered.value = this.tries >= manyTries;
  }

  private isOver(): boolean {
    return this.status.value === "ended" || this.status.value === "gone";
  }

  /// Another server at the same address does not know this page's token: the one that did will not come back.
  private async askWhetherItIsKnown(): Promise<void> {
    const answer = await fetch("api/server").catch(() => undefined);
    if (answer?.status !== 403 || this.status.value !== "lost") return;
    clearTimeout(this.retry);
    this.status.value = "gone";
  }

  private watch(): void {
    if (this.status.value !== "open" || this.socket === undefined) return;
    const silent = performance.now() - this.lastHeard;
    // A machine that slept hears nothing although the socket looks open.
    if (silent > silenceLimit + answerLimit) {
      const old = this.socket;
      this.lose();
      old.close();
    } else if (silent > silenceLimit) this.command("ping").catch(() => undefined);
  }

  private receive(message: Message): void {
    if (typeof message["seq"] === "number" && message.type !== "resumed") this.seq = Math.max(message.type === "hello" ? 0 : this.seq, message["seq"]);
    switch (message.type) {
      case "ack":
      case "error": {
        const one = this.pending.get(message["id"] as number);
        if (one === undefined) return;
        this.pending.delete(one.id);
        if (message.type === "ack") one.resolve(message["result"] as never);
        else one.reject(new CommandError(message["error"] as ErrorObject));
        return;
      }
      case "hello":
      case "resumed":
        this.tries = 0;
        this.unanswered.value = false;
        if (message.type === "hello") {
          this.resume = String(message["resume"] ?? "");
          this.seq = Number(message["seq"] ?? 0);
          // A new connection does not know what was sent on the old one.
          if (!this.greeted)
            for (const one of [...this.pending.values()])
              if (one.sent) {
                this.pending.delete(one.id);
                one.reject(new CommandError({ code: "lost", message: "The connection was lost before the server answered. What you see is its present state." }));
              }
        }
        if (!this.greeted) {
          this.greeted = true;
          this.listener.onMessage(message);
          for (const one of [...this.pending.values()]) this.send(one);
          this.status.value = "open";
          return;
        }
        break;
      case "bye":
        if (message["session"] === undefined || message["session"] === null) this.status.value = "ended";
        break;
    }
    this.listener.onMessage(message);
  }

  /// For tests and for a page that goes to sleep.
  drop(): void {
    this.socket?.close();
  }
}
