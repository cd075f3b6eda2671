/** What the frames of a line mean, by the tables of commands, and who asked for them. */

import type { Schemas } from "./gateway.ts";
import { language, words } from "./words/index.svelte.ts";

export type Info = Schemas["CommandInfo"] | Schemas["FicsCommandInfo"];

const RORZE_FRAME = /^(>?)&([0-9A-F]{2})(?:@([0-9A-F]{2})|([0-9A-Z][0-9A-Z+*-][0-9A-Z])(.*))/;
const FICS_FRAME = /^([0-9A-Z]{3})(?: |\\|$)/;

type Entry = Schemas["TraceRecord"];

/** The bits that answers in hex tell, from bit 0 up (RC-420 manual 13.8 and 14). */
const BITS: Record<string, readonly string[]> = {
  "9CD": ["pulses_running", "limit_error", "ems_error", "command_error", "initialisation_error", "range_error", "stall_error", "communication_error"],
  "9MD": ["stall", "cw_limit", "ccw_limit", "ems", "stop_command"],
  CLD: ["stall", "origin", "cw_limit", "ccw_limit", "in_position", "ems"],
};

export interface Asked {
  caller: string | undefined;
  request: string | undefined;
}

/** Who asked for each frame, oldest first: an answer belongs to the last who asked the same. */
export function askers(protocol: "rorze" | "fics", entries: readonly Entry[]): Asked[] {
  const last = new Map<string, Asked>();
  return entries.map(({ kind, data, caller, request_id }) => {
    const about = subjectOf(protocol, data);
    const asked = { caller: caller ?? undefined, request: request_id ?? undefined };
    if (kind === "tx") last.set(about, asked);
    return kind === "rx" ? (last.get(about) ?? asked) : asked;
  });
}

/** A question with its answer beside it, or what stands alone. */
export interface Exchange {
  entry: Entry;
  by: Asked | undefined;
  answer?: Entry;
}

/** Put each answer behind its question, oldest question first. */
export function folded(protocol: "rorze" | "fics", entries: readonly Entry[]): Exchange[] {
  const by = askers(protocol, entries);
  const open = new Map<string, Exchange>();
  const exchanges: Exchange[] = [];
  for (const [index, entry] of entries.entries()) {
    const about = subjectOf(protocol, entry.data);
    const question = entry.kind === "rx" ? open.get(about) : undefined;
    if (question) {
      question.answer = entry;
      open.delete(about);
      continue;
    }
    const exchange = { entry, by: by[index] };
    exchanges.push(exchange);
    if (entry.kind === "tx") open.set(about, exchange);
  }
  return exchanges;
}

/** What a command and its answer have in common: a refusal names its body alone. */
function subjectOf(protocol: "rorze" | "fics", data: string): string {
  const found = (protocol === "rorze" ? RORZE_FRAME : FICS_FRAME).exec(data);
  return found?.[protocol === "rorze" ? 2 : 1] ?? "";
}

export class Meanings {
  readonly #rorze = new Map<string, Info>();
  readonly #fics = new Map<string, Info>();
  readonly #errors = new Map<string, Schemas["CommandError"]>();

  constructor(commands: readonly Info[]) {
    for (const info of commands) {
      const known = info.family === "fics" ? this.#fics : this.#rorze;
      if (!known.has(info.code)) known.set(info.code, info);
      if (info.family === "rorze") for (const error of info.errors) this.#errors.set(error.code, error);
    }
  }

  /** Say what a frame means; nothing where it is none that the tables know. */
  of(protocol: "rorze" | "fics", data: string): string {
    return protocol === "rorze" ? this.#ofRorze(data) : this.#ofFics(data);
  }

  #ofRorze(data: string): string {
    const frame = RORZE_FRAME.exec(data);
    if (!frame) return "";
    const [, reply, body, error, code = "", value = ""] = frame;
    const told = error === undefined ? this.#titled(this.#rorze.get(code)) : this.#ofError(error);
    return [body, reply && words().wire.reply, told, reply && valueOf(code, value)].filter(Boolean).join(" · ");
  }

  /** Say what a question and its answer mean together: the answer adds only its value, or why it is refused. */
  ofBoth(protocol: "rorze" | "fics", { entry, answer }: Exchange): string {
    const asked = this.of(protocol, entry.data);
    if (!answer) return asked;
    const [, , , error, code = "", value = ""] = RORZE_FRAME.exec(answer.data) ?? [];
    if (protocol === "fics") return `${asked}: ${answer.data.replace(/^[0-9A-Z]{3} ?|\\r$/g, "") || words().wire.ok}`;
    return `${asked}: ${error === undefined ? valueOf(code, value) || words().wire.ok : this.#ofError(error)}`;
  }

  #ofFics(data: string): string {
    const name = FICS_FRAME.exec(data)?.[1];
    return name ? this.#titled(this.#fics.get(name)) : "";
  }

  #ofError(code: string): string {
    const error = this.#errors.get(code) ?? this.#errors.get(`0x${code}`);
    return `${words().wire.refused} ${error?.[language.now] ?? code}`;
  }

  #titled(info: Info | undefined): string {
    return info ? titleOf(info) : "";
  }
}

export function titleOf(info: Info): string {
  return language.now === "ja" ? info.title_ja : info.title_en;
}

/** Say what an answer tells: bits by their names, numbers without their zeros, all else as it is. */
function valueOf(code: string, value: string): string {
  const plain = value.replace(/\\r$/, "");
  const bits = BITS[code] && /^H([0-9A-F]+)$/.exec(plain)?.[1];
  if (bits) {
    const { statusBits, sensors, program, none } = words();
    const names: Record<string, string> = { ...program.ends, ...sensors, ...statusBits };
    const set = (BITS[code] ?? []).filter((_, bit) => (parseInt(bits, 16) >> bit) & 1);
    return set.map((it) => names[it] ?? it).join(", ") || none;
  }
  return /^[+-]?\d+$/.test(plain) ? Number(plain).toLocaleString(language.now) : plain;
}
