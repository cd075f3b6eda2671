/** Streams of the gateway over WebSockets: more of them may be open than a browser grants requests. */

import { address, admitted } from "./gateway.ts";

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
  /** The silence after which a stream that never rests is dead. */
  restless?: number;
}

/** Follows a stream until it is ended, over broken connections too. */
export class Live<T> {
  /** All that are not ended. */
  static readonly #all = new Set<Live<never>>();
  readonly #listener: Listener<T>;
  #socket: WebSocket | undefined;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #watch: ReturnType<typeof setTimeout> | undefined;
  #failures = 0;
  /** Which try to open it counts; one that was left does not. */
  #turn = 0;

  constructor(listener: Listener<T>) {
    this.#listener = listener;
    Live.#all.add(this);
    this.#open();
  }

  /** Open all of them anew: a connection that died without a word looks like one that has nothing to tell. */
  static beginAnew(): void {
    for (const live of Live.#all) live.#reopen();
  }

  end(): void {
    Live.#all.delete(this);
    this.#leave();
  }

  #reopen(): void {
    this.#leave();
    this.#listener.closed?.(false);
    this.#open();
  }

  /** A socket that is left has nothing more to say, however long its end takes. */
  #leave(): void {
    this.#turn++;
    clearTimeout(this.#timer);
    clearTimeout(this.#watch);
    if (!this.#socket) return;
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
    this.#socket = undefined;
  }

  #open(): void {
    const query = this.#listener.query();
    if (!query) return this.#later();
    const turn = ++this.#turn;
    const ifLasts = (then: () => void): void => {
      if (turn === this.#turn) then();
    };
    admitted(query).then(
      (all) => ifLasts(() => this.#connect(all)),
      () => ifLasts(() => this.#failed(false)),
    );
  }

  #connect(query: Record<string, string>): void {
    const { path, subprotocol } = this.#listener;
    const socket = new WebSocket(`${address.replace("http", "ws")}${path}?${new URLSearchParams(query)}`, subprotocol ?? []);
    this.#socket = socket;
    socket.onopen = () => {
      this.#failures = 0;
      this.#listen();
      this.#listener.opened?.();
    };
    socket.onmessage = ({ data }) => {
      this.#listen();
      this.#listener.told(JSON.parse(data as string) as T);
    };
    socket.onclose = ({ code }) => {
      this.#failed(code === CLOSE_INVALID);
    };
  }

  #failed(invalid: boolean): void {
    this.#listener.closed?.(invalid);
    this.#later();
  }

  #listen(): void {
    clearTimeout(this.#watch);
    const { restless } = this.#listener;
    if (restless) this.#watch = setTimeout(() => this.#reopen(), restless);
  }

  #later(): void {
    const pause = PAUSES_MS[Math.min(this.#failures++, PAUSES_MS.length - 1)];
    this.#timer = setTimeout(() => this.#open(), pause);
  }
}
