/** Events in words, and as lines of a table. */

import type { AnyMove, Event, Schemas } from "./gateway.ts";
import { language, named, words } from "./words/index.svelte.ts";

/** What an event's type says: `body.move.started` is "body: move, started". */
export function nameOfEvent(type: string): string {
  const [about = "", ...what] = type.split(".");
  const { parts } = words().events;
  return `${named(parts, about)}: ${what.map((part) => named(parts, part)).join(language.now === "ja" ? "、" : ", ")}`;
}

/** What has gone wrong with what is named beside it: `body.ems_error` is "EMS". */
export function nameOfCause(cause: string): string {
  const { statusBits, events } = words();
  const [, ...what] = cause.split(".");
  return what.map((part) => named({ ...events.parts, ...statusBits }, part)).join(language.now === "ja" ? "、" : ", ");
}

/** What it is about, as an address. */
export function addressOf({ subject }: Event): string {
  return subject.replace(/^\/(bodies|robots|scaras|groups|lines)\//, "").replace(/^\//, "");
}

/** What its data says, as short as it can be. */
export function saidBy(event: Event): string {
  const data = event.data as Record<string, unknown>;
  if ("event_cursor" in data) return saidByMove(data as unknown as AnyMove);
  if (event.type.startsWith("alarm.")) return saidByAlarm(data as unknown as Schemas["Alarm"]);
  const told = Object.entries(data).filter(([, value]) => value !== null && value !== "");
  return told.map(([name, value]) => `${name}: ${plain(value)}`).join(", ");
}

function plain(value: unknown): string {
  if (Array.isArray(value)) return value.map(plain).join(" ") || words().none;
  return typeof value === "object" ? JSON.stringify(value) : named(words().statusBits, String(value));
}

function saidByAlarm(alarm: Schemas["Alarm"]): string {
  const { happened, motor } = alarm[language.now];
  return [happened, motor, alarm.reset_by].filter(Boolean).join(" ");
}

function saidByMove(move: AnyMove): string {
  const { moveKinds } = words();
  const places = "scara_id" in move ? [move.start, move.target] : [move.start_position, move.target_position];
  const way = places.some(isKnown) ? places.map(placed).join(" → ") + (places.some(Number.isFinite) ? " pulse" : "") : "";
  const end = move.end_cause && move.end_cause !== "normal" ? move.end_cause : "";
  return [named(moveKinds, move.kind), way, end, move.error?.detail].filter(Boolean).join(", ");
}

/** A robot that is not homed knows no axis of a place. */
function isKnown(place: unknown): boolean {
  return typeof place === "number" || Object.values(place ?? {}).some((value) => value !== null);
}

function placed(place: unknown): string {
  if (!isKnown(place)) return "?";
  return typeof place === "number" ? String(place) : JSON.stringify(place).replaceAll("null", "?").replaceAll(/["{}]/g, "");
}

export function csvOf(rows: readonly (readonly string[])[]): string {
  return rows.map((row) => row.map((cell) => `"${cell.replaceAll('"', '""')}"`).join(",")).join("\r\n");
}

/** Let the browser save a text; Excel knows a table as UTF-8 by its first character. */
export function save(name: string, type: string, text: string): void {
  const url = URL.createObjectURL(new Blob([type === "text/csv" ? "\ufeff" : "", text], { type }));
  const link = Object.assign(document.createElement("a"), { href: url, download: name });
  link.click();
  URL.revokeObjectURL(url);
}
