/** Streams of the gateway over WebSockets: more of them may be open than a browser grants requests. */

import { address } from "./gateway.ts";

/** Before each further try to open it; the last one from then on. */
const PAUSES_MS = [200, 500, 1000, 2000] as const;
/** The query has something that this gateway does not know. */
const CLOSE_INVALID = 4400;

/** Of `/events`: each message is an array of all events that are sent at once. */
export const EVENTS = { path: "/events", subprotocol: "cloudevents-batch.json" } as const;

export interface Listener<T> {
  path: string;
  subprotocol?: string;
  /** What to ask for; undefined while that is not known. */
  query: () => Record<string, string> | undefined;
  opened?: () => void;
  closed?: (invalid: boolean) => void;
  told: (message: T) => void;
}

/** Follows a stream until it is ended, over broken connections too. */
export class Live<T> {
  readonly #listener: Listener<T>;
  #socket: WebSocket | undefined;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #failures = 0;
  #ended = false;

  constructor(listener: Listener<T>) {
    this.#listener = listener;
    this.#open();
  }

  end(): void {
    this.#ended = true;
    clearTimeout(this.#timer);
    this.#socket?.close();
  }

  #open(): void {
    const query = this.#listener.query();
    if (!query) return this.#later();
    const { path, subprotocol } = this.#listener;
    const socket = new WebSocket(`${address.replace("http", "ws")}${path}?${new URLSearchParams(query)}`, subprotocol ?? []);
    this.#socket = socket;
    socket.onopen = () => {
      this.#failures = 0;
      this.#listener.opened?.();
    };
    socket.onmessage = ({ data }) => this.#listener.told(JSON.parse(data as string) as T);
    socket.onclose = ({ code }) => {
      if (this.#ended) return;
      this.#listener.closed?.(code === CLOSE_INVALID);
      this.#later();
    };
  }

  #later(): void {
    if (this.#ended) return;
    const pause = PAUSES_MS[Math.min(this.#failures++, PAUSES_MS.length - 1)];
    this.#timer = setTimeout(() => this.#open(), pause);
  }
}
