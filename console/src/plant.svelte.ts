/** What is known of the plant, and how old that is. Nothing here asks a controller anything. */

import { extensionOf, extensions } from "./extensions.ts";
import {
  type AnyMove,
  type Body,
  type Event,
  GatewayError,
  type Group,
  type Identity,
  type Line,
  type Made,
  NoAnswer,
  Refused,
  type Robot,
  type Schemas,
  type Target,
  type Unit,
  epochs,
  gateway,
} from "./gateway.ts";
import { addressOf, leases } from "./leases.svelte.ts";
import { EVENTS, Live } from "./live.ts";

/** How often what is known is read again where nothing happens. */
const PERIOD_MS = 2000;
/** Events that come together are followed by one reading. */
const SETTLE_MS = 250;
/** What was asked for longer ago than this is not fresh. */
const STALE_MS = 6000;
/** A value that is older than this is shown with its age. */
const OLD_MS = 3000;
/** The same of what stands still: on a line of 120 bodies at 9600 baud its turn comes every six seconds. */
const OLD_AT_REST_MS = 10_000;
const TICK_MS = 500;
/** An event may come so many readings after what it tells of. */
const LATE_READINGS = 3;
const KEPT_EVENTS = 1000;
const PAGE = 1000;
const PAGES = 10;
const ENDS = ["succeeded", "failed", "stopped", "lost", "unknown"];

type Part = "bodies" | "lines" | "groups" | "robots" | "made" | "alarms" | "leases";
const ALL: readonly Part[] = ["bodies", "lines", "groups", "robots", "made", "alarms", "leases"];
const CONCERNED: Record<string, readonly Part[]> = {
  body: ["bodies", "made"],
  line: ["lines"],
  group: ["groups"],
  robot: ["robots"],
  alarm: ["alarms"],
};

class Plant {
  lines = $state.raw<Line[]>([]);
  bodies = $state.raw<Body[]>([]);
  groups = $state.raw<Group[]>([]);
  robots = $state.raw<Robot[]>([]);
  /** What extensions make of bodies. */
  made = $state.raw<Made[]>([]);
  /** The alarms that stand. */
  alarms = $state.raw<Schemas["Alarm"][]>([]);
  identity = $state.raw<Identity>();
  /** The newest move of each body, each unit and what is made of bodies, by address. */
  moves = $state.raw<Record<string, AnyMove>>({});
  /** The newest events, newest first. */
  events = $state.raw<Event[]>([]);
  /** When the gateway was asked for what it has told last; 0 before it did. */
  heardAt = $state(0);
  /** When an event came last, or the stream was opened. */
  eventAt = $state(0);
  streaming = $state(false);
  signedOut = $state(false);
  now = $state(Date.now());

  /** When the bodies were asked for. */
  #bodiesAt = 0;
  #cursor = "";
  #settling: ReturnType<typeof setTimeout> | undefined;
  #knowsEnds = false;
  #reading = false;
  /** Whether the last reading was not answered: what has cut it off may have cut off streams, too. */
  #missed = false;
  /** Readings, one after the other, that had an end of a move which no event has told. */
  #untold = 0;
  /** Moves that are under way and were read before the stream was open: what came between is in neither. */
  #doubted = new Set<string>();
  /** What is to be read next. */
  readonly #wanted = new Set<Part>();
  readonly #readers: Record<Part, () => Promise<unknown>> = {
    bodies: () => this.#readBodies(),
    lines: () => this.#readLines(),
    groups: async () => (this.groups = (await gateway.http.GET("/groups")).data?.groups ?? []),
    robots: async () => (this.robots = (await gateway.http.GET("/robots")).data?.robots ?? []),
    made: async () => (this.made = (await Promise.all(extensions.map(({ read }) => listed(read)))).flat()),
    alarms: async () => (this.alarms = await standingAlarms()),
    leases: () => leases.read(),
  };

  /** Whether what is shown is what is known now. */
  readonly fresh = $derived(this.streaming && this.now - this.heardAt < STALE_MS);

  start(): void {
    leases.start();
    setInterval(() => this.#tick(), TICK_MS);
    document.addEventListener("visibilitychange", () => this.#tick());
    setInterval(() => this.readSoon(), PERIOD_MS);
    void this.read();
    new Live<Event[]>({
      ...EVENTS,
      query: () => this.identity && { ...this.mine(), ...(this.#cursor && { after: this.#cursor }) },
      opened: () => {
        this.streaming = true;
        this.eventAt = Date.now();
        this.#doubted = new Set(Object.values(this.moves).filter((it) => it.ended_at === null).map((it) => it.id));
        void this.read();
      },
      closed: () => (this.streaming = false),
      told: (events) => this.#take(events),
    });
  }

  /** The part of a query that asks for what this key may see. */
  mine(): { bodies?: string } {
    if (!this.identity?.scope) return {};
    return { bodies: [...this.bodies, ...this.robots, ...this.made].map(addressOf).join(",") };
  }

  body(address: string): Body | undefined {
    return this.bodies.find((body) => body.body_id === address);
  }

  robot(address: string): Robot | undefined {
    return this.robots.find((robot) => robot.robot_id === address);
  }

  /** The unit at an address such as `r1/units/2`; the first one where it names only a robot. */
  unitOf(address: string): { robot: Robot; of: Unit; address: string } | undefined {
    const [id = "", ...others] = address.split("/");
    const robot = this.robot(id);
    const number = others.at(-1);
    const of = robot?.units.find((it) => String(it.number) === number) ?? robot?.units[0];
    return robot && of && { robot, of, address: `${id}/units/${of.number}` };
  }

  target(address: string): Target | undefined {
    return this.body(address) ?? this.robot(address) ?? this.made.find((it) => it.address === address);
  }

  line(id: string): Line | undefined {
    return this.lines.find((line) => line.line_id === id);
  }

  /** Whether something is now as it was told at that time. */
  isPresent(target: Target, at: number): boolean {
    const oldMs = target.moving === false ? OLD_AT_REST_MS : OLD_MS;
    return this.fresh && target.online && this.now - at < oldMs;
  }

  isNew(at: number): boolean {
    return this.now - at < OLD_MS;
  }

  /** When the position of a body was read, on this machine's clock, which the gateway's need not follow. */
  positionAt({ position_read_at, last_heard_at, known_age_s }: Body): number {
    const heardAt = this.#bodiesAt - (known_age_s ?? 0) * 1000;
    return heardAt - (Date.parse(last_heard_at ?? "") - Date.parse(position_read_at ?? ""));
  }

  /** Read again, with whatever else is asked for until then. */
  readSoon(parts: readonly Part[] = ALL): void {
    for (const part of parts) this.#wanted.add(part);
    this.#settling ??= setTimeout(() => {
      this.#settling = undefined;
      void this.read([]);
    }, SETTLE_MS);
  }

  async read(parts: readonly Part[] = ALL): Promise<void> {
    for (const part of parts) this.#wanted.add(part);
    if (this.#reading) return;
    this.#reading = true;
    try {
      await this.#read();
      this.signedOut = false;
      this.#untold = this.#missesAnEnd() ? this.#untold + 1 : 0;
      if (this.#missed || this.#untold === LATE_READINGS) Live.beginAnew();
      this.#missed = false;
    } catch (error) {
      if (!(error instanceof GatewayError)) throw error;
      this.#missed = error instanceof NoAnswer;
      if (error instanceof Refused && error.status === 401) this.signedOut = true;
    } finally {
      this.#reading = false;
      if (this.#wanted.size > 0) this.readSoon([]);
    }
  }

  async #read(): Promise<void> {
    this.identity ??= (await gateway.http.GET("/system/identity")).data;
    const parts = [...this.#wanted];
    const askedAt = Date.now();
    this.#wanted.clear();
    await Promise.all(parts.map((part) => this.#readers[part]()));
    this.heardAt = askedAt;
    this.#tick();
    await this.#readMoves();
    if (!this.#knowsEnds) await this.#readEnds();
  }

  /** Whether a move is over, and its stream has not said so. */
  #missesAnEnd(): boolean {
    const units = this.robots.flatMap((robot) => robot.units.map((unit) => unit.move_id));
    const current = new Set([...this.bodies, ...this.made].map((it) => it.move_id).concat(units));
    return Object.values(this.moves).some((move) => move.ended_at === null && !current.has(move.id));
  }

  async #readLines(): Promise<void> {
    this.lines = (await gateway.http.GET("/lines")).data?.lines ?? [];
    epochs.clear();
    for (const { line_id, owner } of this.lines) {
      if (!owner) continue;
      const there = [...this.robots, ...this.made].filter((it) => it.line_id === line_id).map(addressOf);
      for (const address of [line_id, ...there]) epochs.set(address, owner.epoch);
    }
  }

  async #readBodies(): Promise<void> {
    const askedAt = Date.now();
    this.bodies = (await gateway.http.GET("/bodies")).data?.bodies ?? [];
    this.#bodiesAt = askedAt;
  }

  /** A page that has slept finds streams that look open, and may be dead. */
  #tick(): void {
    const now = Date.now();
    if (now - this.now > STALE_MS) Live.beginAnew();
    this.now = now;
  }

  /** How the last moves have ended, as far as the gateway still has it. */
  async #readEnds(): Promise<void> {
    this.#knowsEnds = true;
    let after: string | undefined;
    for (let page = 0; page < PAGES; page++) {
      const query = { ...this.mine(), types: endsOfMoves(), limit: PAGE, after };
      const { data } = await gateway.http.GET("/events", { params: { query } });
      for (const event of data?.events ?? []) this.#note(moveOf(event));
      if (!data || data.events.length < PAGE) return;
      after = data.cursor;
    }
  }

  /** Moves that began before this page was opened, and those of which no event tells the end. */
  async #readMoves(): Promise<void> {
    const { http } = gateway;
    for (const { body_id, move_id: current } of this.bodies) {
      const move_id = this.#unread(body_id, current);
      if (!move_id) continue;
      const path = { body_id, move_id };
      const { data } = await http.GET("/bodies/{body_id}/moves/{move_id}", { params: { path } });
      this.#note(data);
    }
    for (const { robot_id, number, move_id: current } of this.robots.flatMap((robot) => robot.units)) {
      const move_id = this.#unread(`${robot_id}/units/${number}`, current);
      if (!move_id) continue;
      const path = { robot_id, unit: number, move_id };
      const { data } = await http.GET("/robots/{robot_id}/units/{unit}/moves/{move_id}", { params: { path } });
      this.#note(data);
    }
    for (const { address, page, move_id: current } of this.made) {
      const move_id = this.#unread(address, current);
      if (move_id) this.#note(await extensionOf(page)?.readMove(address, move_id));
    }
  }

  /** The move to be read, of the one that is under way now and the newest that is known. */
  #unread(address: string, current: string | null): string | null {
    const known = this.moves[address];
    if (current) return known?.id === current && !this.#doubted.delete(current) ? null : current;
    return this.#untold >= LATE_READINGS && known?.ended_at === null ? known.id : null;
  }

  #take(events: Event[]): void {
    this.eventAt = Date.now();
    this.#tick();
    this.events = [...events.toReversed(), ...this.events].slice(0, KEPT_EVENTS);
    for (const event of events) {
      this.#cursor = event.cursor;
      this.#note(moveOf(event));
      if (event.type === "stream.gap") this.#forgetMoves();
      this.readSoon(concernedBy(event.type));
    }
  }

  /** What came of them meanwhile is read. */
  #forgetMoves(): void {
    this.moves = {};
    this.#knowsEnds = false;
  }

  #note(move: AnyMove | undefined): void {
    if (!move) return;
    const known = this.moves[move.body_id];
    if (known && known.created_at > move.created_at) return;
    this.moves = { ...this.moves, [move.body_id]: move };
  }
}

/** What an event may have changed. */
function concernedBy(type: string): readonly Part[] {
  const [family = "", what] = type.split(".");
  if (what === "lease") return ["leases"];
  return CONCERNED[family] ?? (extensionOf(family) ? ["made"] : ALL);
}

function endsOfMoves(): string {
  const whose = ["body", "robot", ...extensions.map(({ page }) => page)];
  return whose.flatMap((of) => ENDS.map((end) => `${of}.move.${end}`)).join(",");
}

/** What an extension lists; nothing of a gateway that does not have it. */
async function listed(read: () => Promise<Made[]>): Promise<Made[]> {
  try {
    return await read();
  } catch (error) {
    if (error instanceof Refused && error.status === 404) return [];
    throw error;
  }
}

async function standingAlarms(): Promise<Schemas["Alarm"][]> {
  return (await gateway.http.GET("/alarms", { params: { query: { standing: true } } })).data?.alarms ?? [];
}

function moveOf({ data }: Event): AnyMove | undefined {
  return "event_cursor" in data ? (data as AnyMove) : undefined;
}

export const plant = new Plant();
