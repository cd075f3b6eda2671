/** What is known of the plant, and how old that is. Nothing here asks a controller anything. */

import {
  type AnyMove,
  type Body,
  type Event,
  type Group,
  type Identity,
  type Line,
  Refused,
  type Robot,
  type Scara,
  type Schemas,
  type Target,
  gateway,
} from "./gateway.ts";
import { addressOf, leases } from "./leases.svelte.ts";
import { Live } from "./live.ts";

/** How often what is known is read again where nothing happens. */
const PERIOD_MS = 2000;
/** Events that come together are followed by one reading. */
const SETTLE_MS = 150;
/** What is older than this is not fresh. */
const STALE_MS = 5000;
const KEPT_EVENTS = 1000;
const PAGE = 1000;
const PAGES = 10;
const ENDS = ["succeeded", "failed", "stopped", "lost", "unknown"];
const MOVES_ENDED = ENDS.flatMap((end) => [`body.move.${end}`, `robot.move.${end}`, `scara.move.${end}`]).join(",");

class Plant {
  lines = $state.raw<Line[]>([]);
  bodies = $state.raw<Body[]>([]);
  groups = $state.raw<Group[]>([]);
  robots = $state.raw<Robot[]>([]);
  scaras = $state.raw<Scara[]>([]);
  /** The alarms that stand; undefined where the gateway keeps none. */
  alarms = $state.raw<Schemas["Alarm"][]>();
  identity = $state.raw<Identity>();
  /** The newest move of each body, unit and SCARA robot, by address. */
  moves = $state.raw<Record<string, AnyMove>>({});
  /** The newest events, newest first. */
  events = $state.raw<Event[]>([]);
  /** When the gateway last told anything; 0 before it did. */
  heardAt = $state(0);
  /** When an event came last, or the stream was opened. */
  eventAt = $state(0);
  streaming = $state(false);
  signedOut = $state(false);
  now = $state(Date.now());

  #cursor = "";
  #settling: ReturnType<typeof setTimeout> | undefined;
  #knowsEnds = false;
  #reading = false;
  #again = false;

  /** Whether what is shown is what is known now. */
  readonly fresh = $derived(this.streaming && this.now - this.heardAt < STALE_MS);

  start(): void {
    leases.start();
    setInterval(() => (this.now = Date.now()), 500);
    setInterval(() => this.readSoon(), PERIOD_MS);
    void this.read();
    new Live({
      query: () => this.identity && { ...this.mine(), ...(this.#cursor && { after: this.#cursor }) },
      opened: () => {
        this.streaming = true;
        this.eventAt = Date.now();
        void this.read();
      },
      closed: () => (this.streaming = false),
      event: (event) => this.#take(event),
    });
  }

  /** The part of a query that asks for what this key may see. */
  mine(): { bodies?: string } {
    if (!this.identity?.scope) return {};
    return { bodies: [...this.bodies, ...this.robots, ...this.scaras].map(addressOf).join(",") };
  }

  body(address: string): Body | undefined {
    return this.bodies.find((body) => body.body_id === address);
  }

  robot(address: string): Robot | undefined {
    return this.robots.find((robot) => robot.robot_id === address);
  }

  scara(address: string): Scara | undefined {
    return this.scaras.find((scara) => scara.scara_id === address);
  }

  target(address: string): Target | undefined {
    return this.body(address) ?? this.robot(address) ?? this.scara(address);
  }

  line(id: string): Line | undefined {
    return this.lines.find((line) => line.line_id === id);
  }

  readSoon(): void {
    this.#settling ??= setTimeout(() => {
      this.#settling = undefined;
      void this.read();
    }, SETTLE_MS);
  }

  async read(): Promise<void> {
    this.#again = this.#reading;
    if (this.#reading) return;
    this.#reading = true;
    try {
      await this.#read();
      this.signedOut = false;
    } catch (error) {
      if (error instanceof Refused && error.status === 401) this.signedOut = true;
    } finally {
      this.#reading = false;
      if (this.#again) this.readSoon();
    }
  }

  async #read(): Promise<void> {
    const { http } = gateway;
    this.identity ??= (await http.GET("/system/identity")).data;
    const [bodies, lines, groups, robots, scaras] = await Promise.all([
      http.GET("/bodies"),
      http.GET("/lines"),
      http.GET("/groups"),
      http.GET("/robots"),
      http.GET("/scaras"),
    ]);
    this.bodies = bodies.data?.bodies ?? [];
    this.lines = lines.data?.lines ?? [];
    this.groups = groups.data?.groups ?? [];
    this.robots = robots.data?.robots ?? [];
    this.scaras = scaras.data?.scaras ?? [];
    this.alarms = await optional(async () => (await http.GET("/alarms", { params: { query: { standing: true } } })).data?.alarms);
    await optional(() => leases.read());
    this.now = this.heardAt = Date.now();
    await this.#readMoves();
    if (!this.#knowsEnds) await this.#readEnds();
  }

  /** How the last moves have ended, as far as the gateway still has it. */
  async #readEnds(): Promise<void> {
    this.#knowsEnds = true;
    let after: string | undefined;
    for (let page = 0; page < PAGES; page++) {
      const query = { ...this.mine(), types: MOVES_ENDED, limit: PAGE, after };
      const { data } = await gateway.http.GET("/events", { params: { query } });
      for (const event of data?.events ?? []) this.#note(moveOf(event));
      if (!data || data.events.length < PAGE) return;
      after = data.cursor;
    }
  }

  /** Moves that began before this page was opened. */
  async #readMoves(): Promise<void> {
    const { http } = gateway;
    for (const { body_id, move_id } of this.bodies) {
      if (!move_id || this.moves[body_id]?.id === move_id) continue;
      const path = { body_id, move_id };
      const { data } = await http.GET("/bodies/{body_id}/moves/{move_id}", { params: { path } });
      this.#note(data);
    }
    for (const { robot_id, number, move_id } of this.robots.flatMap((robot) => robot.units)) {
      if (!move_id || this.moves[`${robot_id}/units/${number}`]?.id === move_id) continue;
      const path = { robot_id, unit: number, move_id };
      const { data } = await http.GET("/robots/{robot_id}/units/{unit}/moves/{move_id}", { params: { path } });
      this.#note(data);
    }
    for (const { scara_id, move_id } of this.scaras) {
      if (!move_id || this.moves[scara_id]?.id === move_id) continue;
      const path = { scara_id, move_id };
      const { data } = await http.GET("/scaras/{scara_id}/moves/{move_id}", { params: { path } });
      this.#note(data);
    }
  }

  #take(event: Event): void {
    this.now = this.heardAt = this.eventAt = Date.now();
    this.#cursor = event.cursor;
    this.events = [event, ...this.events].slice(0, KEPT_EVENTS);
    this.#note(moveOf(event));
    if (event.type === "stream.gap") this.moves = {};
    this.readSoon();
  }

  #note(move: AnyMove | undefined): void {
    if (!move) return;
    const known = this.moves[move.body_id];
    if (known && known.created_at > move.created_at) return;
    this.moves = { ...this.moves, [move.body_id]: move };
  }
}

/** Read what an older gateway does not have. */
async function optional<T>(read: () => Promise<T>): Promise<T | undefined> {
  try {
    return await read();
  } catch (error) {
    if (error instanceof Refused && error.status === 404) return undefined;
    throw error;
  }
}

function moveOf({ data }: Event): AnyMove | undefined {
  return "event_cursor" in data ? (data as AnyMove) : undefined;
}

export const plant = new Plant();
