/** A motion gateway for programs, in Node and in browsers. */

import createClient, { type Client } from "openapi-fetch";

import { GatewayError, MoveNotOver, MoveNotSucceeded, NoAnswer, Refused } from "./errors.ts";
import type { paths } from "./generated/schema.ts";
import { EventReader } from "./server_sent.ts";
import type {
  BodyJog,
  BodyJogRequest,
  Event,
  JogRequest,
  JogSession,
  Move,
  MoveRequest,
  PlannedMove,
  Problem,
  RobotMove,
  RobotMoveRequest,
  StopMode,
  StopResult,
  Taken,
} from "./types.ts";

const URL_OF_THE_DEMO = "http://127.0.0.1:8420";
const TIMEOUT_S = 10;
/** One request waits no longer for the end of a move; another one follows. */
const MAX_WAIT_S = 20;
/** A stream says something at least every 15 s; one that is silent for longer is dead. */
const SILENT_S = 40;
const STOP_TRIES = 3;
/** Before each further try to reach a stream again; the last one from then on. */
const PAUSES_S = [0.1, 0.2, 0.5, 1, 2] as const;
const LEASE_S = 10;
/** Heartbeats in the time in which one has to come. */
const BEATS = 4;
const FIRST_GROUP = 0x80;
const ONLY_PLANNED = "A move with validate_only is not started: plan it.";

export interface Options {
  /** Left out: MOTION_GATEWAY_URL, or this machine. */
  url?: string;
  /** The access key; left out: MOTION_GATEWAY_KEY. */
  key?: string;
  /** Seconds that an answer may take, besides those that were asked to wait for an end. */
  timeout?: number;
  fetch?: typeof globalThis.fetch;
}

export interface StartOptions {
  /** Seconds to wait for the end. */
  wait?: number;
  idempotencyKey?: string;
}

export interface LeaseOptions {
  /** Seconds that it lasts after the program or its connection has died. */
  ttl?: number;
  /** End the leases of others that are in the way; for admins. */
  takeOver?: boolean;
}

export interface EventOptions {
  /** Addresses of bodies, groups and robots. */
  bodies?: readonly string[];
  /** Such as `body.move.*`. */
  types?: readonly string[];
  /** Live values too, such as `body.position`: each so many times a second at most. */
  sample?: number;
  /** A cursor; left out, what happens from now on. */
  after?: string;
  /** Ends the stream. */
  signal?: AbortSignal;
}

/**
 * A gateway: what takes more than one request as methods, and every operation typed by its path in `http`.
 *
 * Errors are `GatewayError`s; nothing that could move a motor is ever sent twice.
 */
export class Gateway {
  /** Every operation: `gateway.http.GET("/bodies/{body_id}", { params: { path: { body_id: "3F" } } })`. */
  readonly http: Client<paths>;
  readonly #url: string;
  readonly #headers: Record<string, string>;
  /** Of the leases that last. */
  readonly #tokens = new Set<number>();
  readonly #timeout: number;
  readonly #fetch: typeof globalThis.fetch;

  constructor(options: Options = {}) {
    const key = options.key ?? environment("MOTION_GATEWAY_KEY");
    this.#url = (options.url ?? environment("MOTION_GATEWAY_URL") ?? URL_OF_THE_DEMO).replace(/\/$/, "");
    this.#headers = key ? { Authorization: `Bearer ${key}` } : {};
    this.#timeout = options.timeout ?? TIMEOUT_S;
    this.#fetch = options.fetch ?? globalThis.fetch.bind(globalThis);
    this.http = createClient<paths>({
      baseUrl: this.#url,
      headers: this.#headers,
      fetch: (request) => this.#ask(request),
    });
  }

  /** Send a single command of the controller's table, as GET /commands lists them; to a link master by `/lines/ID`. */
  async command(address: string, name: string, parameters: Record<string, unknown> = {}): Promise<unknown> {
    return this.#post(`${pathOf(address)}/commands/${name}`, parameters);
  }

  /** Make a call that an alarm, or an error, names as what helps. */
  async call({ method, path, body }: { method: string; path: string; body?: unknown }): Promise<unknown> {
    const headers = { ...this.#headers, "Content-Type": "application/json" };
    const content = body === undefined || body === null ? {} : { body: JSON.stringify(body) };
    return (await this.#ask(new Request(this.#url + path, { method, headers, ...content }))).json();
  }

  /** Start a move of a body. */
  async startMove(bodyId: string, move: MoveRequest, options: StartOptions = {}): Promise<Move> {
    if (move.validate_only) throw new TypeError(ONLY_PLANNED);
    return (await this.#move(bodyId, move, options)) as Move;
  }

  /** Start a move of a robot's unit. */
  async startRobotMove(
    robotId: string,
    unit: number,
    move: RobotMoveRequest,
    options: StartOptions = {},
  ): Promise<RobotMove> {
    if (move.validate_only) throw new TypeError(ONLY_PLANNED);
    const { data } = await this.http.POST("/robots/{robot_id}/units/{unit}/moves", {
      params: { path: { robot_id: robotId, unit }, query: { wait: options.wait } },
      headers: keyed(options),
      body: move,
    });
    return data as RobotMove;
  }

  /** Say what would be sent for a move, and how long it would take; nothing moves. */
  async planMove(bodyId: string, move: MoveRequest): Promise<PlannedMove> {
    return (await this.#move(bodyId, { ...move, validate_only: true }, {})) as PlannedMove;
  }

  /**
   * Wait until a move has succeeded, over broken connections too, and give its last state.
   *
   * Throws MoveNotSucceeded where it has ended otherwise, MoveNotOver where it is under way after `timeout` s.
   */
  async waitForMove<M extends Move | RobotMove>(move: M, { timeout = 60 } = {}): Promise<M> {
    const giveUpAt = performance.now() + timeout * 1000;
    let seen = move;
    while (["queued", "sent", "moving"].includes(seen.status)) {
      const left = (giveUpAt - performance.now()) / 1000;
      if (left <= 0) throw new MoveNotOver(seen, timeout);
      seen = await this.#lookAt(seen, Math.min(left, MAX_WAIT_S));
    }
    if (seen.status !== "succeeded") throw new MoveNotSucceeded(seen);
    return seen;
  }

  /**
   * Stop by software: a body, a group, a robot, a unit, or everything where no address is given.
   *
   * It is sent again where the connection breaks. It does not replace a hardware stop: look at `confirmed`.
   */
  async stop(address?: string, mode: StopMode = "decelerate"): Promise<StopResult> {
    const path = address === undefined ? "/stop" : `${pathOf(address)}/stop`;
    for (let tried = 1; ; tried++) {
      try {
        return (await this.#post(path, { mode })) as StopResult;
      } catch (error) {
        if (!(error instanceof NoAnswer) || tried === STOP_TRIES) throw error;
      }
    }
  }

  /**
   * Jog a body, or an axis of a robot, while `during` runs, with the heartbeats that keep it moving.
   *
   * It stops when `during` ends, and within half a second when the program or its connection dies. A JOG that
   * is over is told at once, whatever `during` still does.
   */
  async jog<T>(
    address: string,
    jog: JogRequest | BodyJogRequest,
    during: (session: JogSession | BodyJog) => Promise<T>,
  ): Promise<T> {
    const path = `${pathOf(address)}/jogs`;
    const session = (await this.#post(path, jog)) as JogSession | BodyJog;
    const here = `${path}/${session.id}`;
    const end = (): Promise<void> => this.#endJog(here, address);
    let refused: (refusal: unknown) => void = () => undefined;
    const over = new Promise<never>((_, reject) => (refused = reject));
    const run = (): Promise<T> => Promise.race([during(session), over]);
    return this.#kept(`${here}/heartbeat`, session.heartbeat_within_ms, run, end, refused);
  }

  /**
   * Let nobody else move a line, a body, a group or a robot while `during` runs.
   *
   * The lease is renewed meanwhile, and goes with everything that this client sends.
   */
  async lease<T>(
    scope: string,
    during: (lease: Taken) => Promise<T>,
    { ttl = LEASE_S, takeOver = false }: LeaseOptions = {},
  ): Promise<T> {
    const taken = (await this.#post("/leases", { scope, ttl_s: ttl, take_over: takeOver })) as Taken;
    const path = `/leases/${taken.lease}`;
    const end = async (): Promise<void> => {
      await this.call({ method: "DELETE", path }).catch(() => undefined); // it ends anyway, or has ended
      this.#tokens.delete(taken.token);
    };
    this.#tokens.add(taken.token);
    return this.#kept(`${path}/renew`, ttl * 1000, () => during(taken), end);
  }

  /**
   * Follow what happens, without an end; a lost connection is taken up where it was lost.
   *
   * Where the gateway no longer has what happened meanwhile, as after its restart, there is an event `stream.gap`.
   */
  async *events(options: EventOptions = {}): AsyncGenerator<Event, void, undefined> {
    let cursor = options.after;
    let failures = 0;
    while (!options.signal?.aborted) {
      const reader = new EventReader(cursor);
      try {
        for await (const text of this.#stream(options, cursor)) {
          failures = 0;
          for (const event of reader.take(text)) {
            cursor = reader.cursor;
            yield event;
          }
          cursor = reader.cursor;
        }
      } catch (error) {
        if (error instanceof GatewayError && !error.retryable) throw error;
      }
      if (!options.signal?.aborted) await pause(PAUSES_S[Math.min(failures++, PAUSES_S.length - 1)] ?? 0);
    }
  }

  async *#stream(options: EventOptions, cursor: string | undefined): AsyncGenerator<string> {
    const query = new URLSearchParams();
    if (options.bodies) query.set("bodies", options.bodies.join(","));
    if (options.types) query.set("types", options.types.join(","));
    if (options.sample) query.set("sample", String(options.sample));
    if (cursor) query.set("after", cursor);
    const ending = new AbortController();
    const end = (): void => ending.abort();
    options.signal?.addEventListener("abort", end);
    let watch = setTimeout(end, SILENT_S * 1000);
    try {
      const request = new Request(`${this.#url}/events/stream?${query}`, {
        headers: this.#headers,
        signal: ending.signal,
      });
      const { body } = await this.#answered(request);
      const reader = body?.pipeThrough(new TextDecoderStream()).getReader();
      for (let piece = await reader?.read(); piece && !piece.done; piece = await reader?.read()) {
        clearTimeout(watch);
        watch = setTimeout(end, SILENT_S * 1000);
        yield piece.value;
      }
    } finally {
      clearTimeout(watch);
      options.signal?.removeEventListener("abort", end);
      ending.abort();
    }
  }

  async #move(bodyId: string, body: MoveRequest, options: StartOptions): Promise<Move | PlannedMove> {
    const { data } = await this.http.POST("/bodies/{body_id}/moves", {
      params: { path: { body_id: bodyId }, query: { wait: options.wait } },
      headers: keyed(options),
      body,
    });
    return data as Move | PlannedMove;
  }

  async #lookAt<M extends Move | RobotMove>(move: M, wait: number): Promise<M> {
    const query = new URLSearchParams({ wait: wait.toFixed(3) });
    try {
      const path = `${this.#url}${pathOf(move.body_id)}/moves/${move.id}?${query}`;
      return (await (await this.#ask(new Request(path, { headers: this.#headers }))).json()) as M;
    } catch (error) {
      if (!(error instanceof NoAnswer)) throw error;
      await pause(Math.min(PAUSES_S[0], wait));
      return move;
    }
  }

  /** Post to a path often enough while something runs; throws after it what was refused. */
  /** Keep something alive while `run` runs; the first refusal is told at once, and thrown in the end. */
  async #kept<T>(
    path: string,
    withinMs: number,
    run: () => Promise<T>,
    end: () => Promise<void>,
    refused: (refusal: unknown) => void = () => undefined,
  ): Promise<T> {
    let refusal: unknown;
    const beat = (): void => {
      this.#post(path).catch((error: unknown) => {
        if (error instanceof NoAnswer) return;
        refusal ??= error;
        refused(error);
      });
    };
    const beating = setInterval(beat, withinMs / BEATS);
    let result: T;
    try {
      result = await run();
    } finally {
      clearInterval(beating);
      await end();
    }
    if (refusal) throw refusal;
    return result;
  }

  async #endJog(path: string, address: string): Promise<void> {
    for (const seconds of PAUSES_S) {
      try {
        const { state } = (await this.#post(`${path}/stop`)) as JogSession | BodyJog;
        if (state !== "jogging" && state !== "stopping") return;
      } catch (error) {
        if (!(error instanceof NoAnswer)) throw error;
      }
      await pause(seconds);
    }
    await this.stop(address);
  }

  async #post(path: string, body?: unknown): Promise<unknown> {
    return this.call({ method: "POST", path, body });
  }

  /** Ask with patience: for as long as was asked to wait, and the usual time on top. The answer is there to its end. */
  async #ask(request: Request): Promise<Response> {
    const wait = Number(new URL(request.url).searchParams.get("wait") ?? 0);
    const patience = AbortSignal.timeout((this.#timeout + wait) * 1000);
    const asked = new Request(request, { signal: AbortSignal.any([request.signal, patience]) });
    if (this.#tokens.size) asked.headers.set("Lease-Token", [...this.#tokens].join(", "));
    const answer = await this.#answered(asked);
    try {
      return new Response(answer.body && (await answer.arrayBuffer()), answer);
    } catch (error) {
      throw new NoAnswer(request.method, error);
    }
  }

  async #answered(request: Request): Promise<Response> {
    let answer: Response;
    try {
      answer = await this.#fetch(request);
    } catch (error) {
      throw new NoAnswer(request.method, error);
    }
    if (answer.ok) return answer;
    throw new Refused(answer.status, (await answer.json().catch(() => ({}))) as Partial<Problem>);
  }
}

/** Where something stands: a body 3F or arm.3F, a group 80, a robot r1, a unit r1/units/1, or a path such as /lines/arm. */
export function pathOf(address: string): string {
  if (address.startsWith("/")) return address;
  if (address.includes("/")) return `/robots/${address.split("/").map(encodeURIComponent).join("/")}`;
  const number = /^(?:.*\.)?([0-9][0-9A-Fa-f])$/.exec(address)?.[1];
  if (number === undefined) return `/robots/${encodeURIComponent(address)}`;
  return `/${parseInt(number, 16) < FIRST_GROUP ? "bodies" : "groups"}/${encodeURIComponent(address)}`;
}

function keyed(options: StartOptions): Record<string, string> {
  return options.idempotencyKey ? { "Idempotency-Key": options.idempotencyKey } : {};
}

function pause(seconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, seconds * 1000));
}

function environment(name: string): string | undefined {
  const host = globalThis as { process?: { env?: Record<string, string | undefined> } };
  return host.process?.env?.[name] || undefined;
}
