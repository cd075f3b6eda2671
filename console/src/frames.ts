/** What the frames of a line mean, by the tables of commands, and who asked for them. */

import type { Schemas } from "./gateway.ts";
import { language, words } from "./words/index.svelte.ts";

export type Info = Schemas["CommandInfo"] | Schemas["FicsCommandInfo"];

const RORZE_FRAME = /^(>?)&([0-9A-F]{2})(?:@([0-9A-F]{2})|([0-9A-Z][0-9A-Z+*-][0-9A-Z])(.*))/;
const FICS_FRAME = /^([0-9A-Z]{3})(?: |\\|$)/;

export interface Asked {
  caller: string | undefined;
  request: string | undefined;
}

/** Who asked for each frame, oldest first: an answer belongs to the last who asked the same. */
export function askers(protocol: "rorze" | "fics", entries: readonly Schemas["TraceRecord"][]): Asked[] {
  const last = new Map<string, Asked>();
  return entries.map(({ kind, data, caller, request_id }) => {
    const about = subjectOf(protocol, data);
    const asked = { caller: caller ?? undefined, request: request_id ?? undefined };
    if (kind === "tx") last.set(about, asked);
    return kind === "rx" ? (last.get(about) ?? asked) : asked;
  });
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
    const [, reply, body, error, code] = frame;
    const told = error === undefined ? this.#titled(this.#rorze.get(code ?? "")) : this.#ofError(error);
    return [body, reply && words().wire.reply, told].filter(Boolean).join(" · ");
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
