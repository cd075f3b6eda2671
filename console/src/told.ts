/** Events in words, and as lines of a table. */

import { extensionOf } from "./extensions.ts";
import { type AnyMove, type Body, type Event, type Schemas, isOwn } from "./gateway.ts";
import { shown } from "./places.ts";
import { language, named, translated, words } from "./words/index.svelte.ts";

/** What an event's type says: `body.move.started` is "body: move, started". */
export function nameOfEvent(type: string): string {
  const [about = "", ...what] = type.split(".");
  const { parts } = words().events;
  return `${extensionOf(about)?.name[language.now] ?? named(parts, about)}: ${what.map((part) => named(parts, part)).join(language.now === "ja" ? "、" : ", ")}`;
}

/** What has gone wrong with what is named beside it: `body.ems_error` is "EMS". */
export function nameOfCause(cause: string): string {
  const { statusBits, events } = words();
  const [, ...what] = cause.split(".");
  return what.map((part) => named({ ...events.parts, ...statusBits }, part)).join(language.now === "ja" ? "、" : ", ");
}

/** Why a move ended: causes in words, several joined by a plus. */
export function nameOfEnd(cause: string): string {
  const { moveEnds, moveStates, sensors } = words();
  return cause.split("+").map((it) => named({ ...moveStates, ...sensors, ...moveEnds }, it)).join(" + ");
}

/** What it is about, as an address. */
export function addressOf({ subject }: Event): string {
  return subject.replace(/^\/(\w+\/(?=.))?/, "");
}

/** Members that tell a program more than a person: ids and times. The type and the row have what counts. */
const PLUMBING = /^(id|.*_id|.*_at)$/;

/** What its data says, as short as it can be. */
export function saidBy(event: Event): string {
  const data = event.data as Record<string, unknown>;
  if ("event_cursor" in data) return saidByMove(data as unknown as AnyMove);
  if (event.type.startsWith("alarm.")) return saidByAlarm(data as unknown as Schemas["Alarm"]);
  if (typeof data["en"] === "string") return `${String(data[language.now])} ${String(data[`remedy_${language.now}`] ?? "")}`;
  const told = Object.entries(data).filter(([name, value]) => value !== null && value !== "" && !PLUMBING.test(name));
  return told.map(([name, value]) => `${translated(name)}: ${plain(value)}`).join(language.now === "ja" ? "、" : ", ");
}

/** A line of what has happened: a move from its start to its end, or events alike that came one after the other. */
export interface Row {
  key: string;
  time: string;
  about: string;
  what: string;
  type: string;
  said: string;
  isBad: boolean;
  /** How many events it tells of. */
  count: number;
  move: AnyMove | undefined;
}

const BAD = ["failed", "lost", "unknown", "rejected"];

/** Fold events: of each move one row, of progress one. */
export function foldedRows(events: readonly Event[], nameOf: (address: string) => { name: string; body: Body | undefined }): Row[] {
  const rows: Row[] = [];
  const moves = new Map<string, Row>();
  for (const event of events) {
    const { name, body } = nameOf(addressOf(event));
    const move = moveOf(event);
    const known = move && moves.get(move.id);
    const before = rows.at(-1);
    if (move && known) {
      known.count += 1;
      if (event.time > known.time) Object.assign(known, rowOf(event, name, body), { key: known.key, count: known.count });
    } else if (!move && before && !before.move && before.type === event.type && before.about === name) {
      before.count += 1;
    } else {
      const row = rowOf(event, name, body);
      rows.push(row);
      if (move) moves.set(move.id, row);
    }
  }
  return rows;
}

/** A row for each event. */
export function rawRows(events: readonly Event[]): Row[] {
  return events.map((event) => ({ ...rowOf(event, addressOf(event), undefined), what: nameOfEvent(event.type), said: saidBy(event) }));
}

function rowOf(event: Event, about: string, body: Body | undefined): Row {
  const move = moveOf(event);
  return {
    key: event.id,
    time: event.time,
    about,
    type: event.type,
    what: move ? named(words().moveKinds, move.kind) : nameOfEvent(event.type),
    said: move ? wayOf(move, body) : saidBy(event),
    isBad: move ? BAD.includes(move.status) : event.type.startsWith("alarm.raised"),
    count: 1,
    move,
  };
}

/** "495 → 5 mm, 1.97 s, succeeded, by me". */
function wayOf(move: AnyMove, body: Body | undefined): string {
  const { moveStates, events } = words();
  const place = (at: number | null): string => (body ? shown(body, at).value : at === null ? "?" : String(at));
  const way =
    "group_id" in move && (move.start_position !== null || move.target_position !== null)
      ? `${place(move.start_position)} → ${place(move.ended_at ? (move.position ?? move.target_position) : move.target_position)} ${body?.unit ?? "pulse"}`
      : "";
  const took = move.sent_at && move.ended_at ? `${((Date.parse(move.ended_at) - Date.parse(move.sent_at)) / 1000).toFixed(2)} s` : "";
  const by = isOwn(move.request_id) ? events.byMe : "";
  const parts = [way, took, named(moveStates, move.status), translated(move.error?.detail ?? ""), by];
  return parts.filter(Boolean).join(language.now === "ja" ? "、" : ", ");
}

function moveOf({ data }: Event): AnyMove | undefined {
  return "event_cursor" in data ? (data as AnyMove) : undefined;
}

function plain(value: unknown): string {
  if (Array.isArray(value)) return value.map(plain).join(" ") || words().none;
  return typeof value === "object" ? JSON.stringify(value) : translated(named(words().statusBits, String(value)));
}

function saidByAlarm(alarm: Schemas["Alarm"]): string {
  const { happened, motor } = alarm[language.now];
  return [happened, motor, alarm.reset_by].filter(Boolean).join(" ");
}

function saidByMove(move: AnyMove): string {
  const { moveKinds } = words();
  const places = "start" in move ? [move.start, move.target] : [move.start_position, move.target_position];
  const way = places.some(isKnown) ? places.map(placed).join(" → ") + (places.some(Number.isFinite) ? " pulse" : "") : "";
  const end = move.end_cause && move.end_cause !== "normal" ? nameOfEnd(move.end_cause) : "";
  return [named(moveKinds, move.kind), way, end, translated(move.error?.detail ?? "")].filter(Boolean).join(", ");
}

/** A robot that is not homed knows no axis of a place. */
function isKnown(place: unknown): boolean {
  return typeof place === "number" || Object.values(place ?? {}).some((value) => value !== null);
}

function placed(place: unknown): string {
  if (!isKnown(place)) return "?";
  return typeof place === "number" ? String(place) : JSON.stringify(place).replaceAll("null", "?").replaceAll(/["{}]/g, "");
}

/** The rows of a table by the names in its first one, with commas or, as Excel writes them, semicolons. */
export function rowsIn(csv: string): Record<string, string>[] {
  const [head = [], ...rows] = csv.replace(/^\ufeff/, "").trim().split(/\r?\n/).map((row) => row.split(/[;,]/));
  return rows.map((row) => Object.fromEntries(head.map((name, index) => [name, row[index] ?? ""])));
}

export function csvOf(rows: readonly (readonly string[])[]): string {
  return rows.map((row) => row.map((cell) => `"${cell.replaceAll('"', '""')}"`).join(",")).join("\r\n");
}

/** Let the browser save a text; Excel knows a table as UTF-8 by its first character. */
export function save(name: string, type: string, text: string): void {
  saveBlob(name, new Blob([type === "text/csv" ? "\ufeff" : "", text], { type }));
}

export function saveBlob(name: string, blob: Blob): void {
  const url = URL.createObjectURL(blob);
  const link = Object.assign(document.createElement("a"), { href: url, download: name });
  link.click();
  URL.revokeObjectURL(url);
}
