/** Doing something, telling what came of it, and saying why something cannot be done. */

import { type AnyMove, type Deed, GatewayError, type Right, type Target, patient } from "./gateway.ts";
import { addressOf, leases } from "./leases.svelte.ts";
import { plant } from "./plant.svelte.ts";
import { named, words } from "./words/index.svelte.ts";

const SHOWN_MS = 6000;

export interface Notice {
  id: number;
  good: boolean;
  text: string;
  detail: string;
  request: string | null;
}

class Notices {
  list = $state.raw<Notice[]>([]);
  #last = 0;

  /** Bad news stays until somebody has taken note; the same again takes the place of what stood. */
  add(good: boolean, text: string, detail = "", request: string | null = null): void {
    const id = ++this.#last;
    const others = this.list.filter((it) => it.text !== text || it.detail !== detail);
    this.list = [{ id, good, text, detail, request }, ...others].slice(0, 5);
    if (good) setTimeout(() => this.drop(id), SHOWN_MS);
  }

  drop(id: number): void {
    this.list = this.list.filter((notice) => notice.id !== id);
  }
}

export const notices = new Notices();

/** What was asked for and is not answered yet. */
const waiting = new Set<{ what: string }>();

/** Say of what is not answered that it may be done or not. */
export function tellUnanswered(): void {
  const { notices: said } = words();
  for (const { what } of waiting) notices.add(false, said.unanswered(what), said.unansweredWhy);
}

leases.onLost = ({ scope }, { detail, remedy, requestId }) => {
  notices.add(false, words().lease.lost(scope), `${detail} ${remedy}`.trim(), requestId);
};

/** Do it, and tell what came of it; quietly, tell only what went wrong. */
export async function perform(what: string, deed: Deed, quiet = false): Promise<unknown> {
  const { notices: said } = words();
  const asked = { what };
  waiting.add(asked);
  try {
    const done = await deed(patient);
    if (!quiet) notices.add(true, isUnderWay(done) ? said.started(what) : said.done(what));
    return done;
  } catch (error) {
    tellFailure(what, error);
    return undefined;
  } finally {
    waiting.delete(asked);
    plant.readSoon();
  }
}

export function tellFailure(what: string, error: unknown): void {
  if (!(error instanceof GatewayError)) throw error;
  const { notices: said } = words();
  const moved = named(said.moved, error.moved);
  notices.add(false, said.failed(what), `${error.detail} ${moved} ${error.remedy}`.trim(), error.requestId);
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
  if (identity && !identity.rights.includes(right))
    return why.role(named(connection.role, identity.role), named(rights, right));
  if (!target) return undefined;
  const lease = right === "stop" || right === "view" ? undefined : leases.of(target);
  if (lease && !leases.isMine(lease)) return why.leased(lease.holder);
  const line = plant.line(target.line_id);
  if (line?.down_reason) return why.line(line.line_id, line.down_reason);
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

export async function copy(text: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
    notices.add(true, words().copied, text);
  } catch {
    notices.add(false, words().notCopied, text);
  }
}
