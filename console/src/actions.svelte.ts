/** Doing something, telling what came of it, and saying why something cannot be done. */

import { type AnyMove, type Deed, GatewayError, Refused, type Right, type Schemas, type Target, patient } from "./gateway.ts";
import { addressOf, leases } from "./leases.svelte.ts";
import { plant } from "./plant.svelte.ts";
import { replay } from "./replay.svelte.ts";
import { named, translated, words } from "./words/index.svelte.ts";

const SHOWN_MS = 6000;

export interface Notice {
  id: number;
  good: boolean;
  text: string;
  detail: string;
  request: string | null;
  /** The button beside which it stands; undefined where it has none, or is gone. */
  by: string | undefined;
  /** The move with whose end it ends. */
  move: AnyMove | undefined;
  /** The calls that help. */
  next: readonly Schemas["NextCall"][];
}

type Optional = Partial<Pick<Notice, "detail" | "request" | "by" | "move" | "next">>;

class Notices {
  list = $state.raw<Notice[]>([]);
  #last = 0;

  /** Bad news stays until somebody has taken note; what a button says takes the place of what it said before. */
  add(good: boolean, text: string, { detail = "", request = null, by, move, next = [] }: Optional = {}): void {
    const id = ++this.#last;
    const others = this.list.filter((it) => (by === undefined ? it.text !== text || it.detail !== detail : it.by !== by));
    this.list = [{ id, good, text, detail, request, by, move, next }, ...others].slice(0, 5);
    if (good && !move) setTimeout(() => this.drop(id), SHOWN_MS);
  }

  drop(id: number): void {
    this.list = this.list.filter((notice) => notice.id !== id);
  }

  /** A button is gone: bad news of it stands at the head of the page. */
  orphan(by: string): void {
    if (!this.list.some((it) => it.by === by)) return;
    this.list = this.list.flatMap((it) => (it.by !== by ? [it] : it.good ? [] : [{ ...it, by: undefined }]));
  }

  /** A move is over: what was said of its start is no more, and what went wrong takes its place. */
  end(move: AnyMove): void {
    const notice = this.list.find((it) => it.move?.id === move.id);
    if (!notice) return;
    this.drop(notice.id);
    if (["succeeded", "stopped"].includes(move.status)) return;
    const { notices: said, moveStates } = words();
    const detail = [move.error?.detail, move.error?.remedy].map((it) => translated(it ?? "")).filter(Boolean).join(" ");
    this.add(false, said.ended(notice.text, named(moveStates, move.status)), { detail, by: notice.by, next: move.error?.next ?? [] });
  }
}

export const notices = new Notices();

/** What was asked for and is not answered yet. */
const waiting = new Set<{ what: string }>();

/** Say of what is not answered that it may be done or not. */
export function tellUnanswered(): void {
  const { notices: said } = words();
  for (const { what } of waiting) notices.add(false, said.unanswered(what), { detail: said.unansweredWhy });
}

leases.onLost = ({ scope }, { detail, remedy, requestId }) => {
  notices.add(false, words().lease.lost(scope), { detail: `${translated(detail)} ${translated(remedy)}`.trim(), request: requestId });
};

/** Do it, and tell what came of it; quietly, tell only what went wrong. */
export async function perform(what: string, deed: Deed, quiet = false, by?: string): Promise<unknown> {
  const { notices: said } = words();
  const asked = { what };
  waiting.add(asked);
  try {
    const done = await deed(patient);
    const move = moveIn(done);
    if (!quiet) notices.add(true, isUnderWay(done) ? said.started(what) : said.done(what), { by, move: isUnderWay(done) ? move : undefined });
    return done;
  } catch (error) {
    tellFailure(what, error, by);
    return undefined;
  } finally {
    waiting.delete(asked);
    plant.readSoon();
  }
}

export function tellFailure(what: string, error: unknown, by?: string): void {
  if (!(error instanceof GatewayError)) throw error;
  const { notices: said } = words();
  const moved = named(said.moved, error.moved);
  const next = error instanceof Refused ? (error.problem.next ?? []) : [];
  const detail = `${translated(error.detail)} ${moved} ${translated(error.remedy)}`.trim();
  notices.add(false, said.failed(what), { detail, request: error.requestId, by, next });
}

/** The move that was begun, if one was. */
function moveIn(done: unknown): AnyMove | undefined {
  const { data = done } = (done ?? {}) as { data?: unknown };
  return typeof data === "object" && data !== null && "event_cursor" in data && "body_id" in data ? (data as AnyMove) : undefined;
}

function isUnderWay(done: unknown): boolean {
  const { data = done } = (done ?? {}) as { data?: unknown };
  const status = (data as Partial<AnyMove> | undefined)?.status;
  return status !== undefined && ["queued", "sent", "moving", "running"].includes(status);
}

/** Why nobody may do this now; undefined where they may. */
export function obstacle(right: Right, target?: Target): string | undefined {
  const { why, rights, connection } = words();
  const { identity } = plant;
  if (!plant.fresh) return why.disconnected;
  if (replay.of && right !== "view") return why.replay;
  if (identity && !identity.rights.includes(right))
    return why.role(named(connection.role, identity.role), named(rights, right));
  if (!target) return undefined;
  const lease = right === "stop" || right === "view" ? undefined : leases.of(target);
  if (lease && !leases.isMine(lease)) return why.leased(lease.holder);
  const line = plant.line(target.line_id);
  if (line?.down_reason) return why.line(line.line_id, translated(line.down_reason));
  return target.online ? undefined : why.offline(nameOf(target));
}

/** Why it cannot be set in motion now. */
export function obstacleToMove(target: Target, toPlace = false): string | undefined {
  const { why } = words();
  const first = obstacle("operate", target);
  if (first) return first;
  if (target.moving) return why.moving;
  if (target.moving === null) return why.unknownState;
  if ("error" in target && target.error) return why.error;
  return toPlace && target.power_cycled ? why.powerCycled : undefined;
}

export function nameOf(target: Target): string {
  const id = addressOf(target);
  return target.name ? `${target.name} (${id})` : id;
}

/** Name what has an address such as `r1/units/1`. */
export function nameAt(address: string): string {
  const [owner = "", , unit] = address.split("/");
  const found = plant.target(owner);
  return `${found ? nameOf(found) : owner}${unit ? ` · ${words().robot.unit(Number(unit))}` : ""}`;
}

export async function copy(text: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    notices.add(true, words().copied, { detail: text });
  } catch {
    notices.add(false, words().notCopied, { detail: text });
  }
}
