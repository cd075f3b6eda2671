/** The file of a recording, read in the browser: a zip with JSON lines. */

import type { AnyMove, Event, Schemas } from "./gateway.ts";
import { addressOf } from "./told.ts";

export type Entry = Schemas["TraceRecord"];

export interface Manifest {
  from: string;
  to: string;
  lines: readonly string[];
  configuration: { lines?: readonly { id: string; protocol?: "rorze" | "fics" }[] };
}

/** What stands on the time line; times in ms. */
export interface Mark {
  kind: "move" | "stop" | "alarm";
  about: string;
  from: number;
  to: number;
  isBad: boolean;
  event: Event;
}

/** A record of a line, or an event, at its time. */
export interface Told {
  at: number;
  line: string;
  entry?: Entry;
  event?: Event;
}

const END_SIZE = 22;
const END = 0x06054b50;
const DEFLATED = 8;
const BAD_ENDS = ["failed", "lost", "unknown", "rejected"];

/** The members of a zip of up to 4 GB, each read when it is asked for. */
class Zip {
  readonly #blob: Blob;
  readonly #members: ReadonlyMap<string, { method: number; size: number; offset: number }>;

  private constructor(blob: Blob, directory: DataView, count: number) {
    const members = new Map<string, { method: number; size: number; offset: number }>();
    for (let at = 0, left = count; left > 0; left--) {
      const [name, extra, comment] = [28, 30, 32].map((it) => directory.getUint16(at + it, true)) as [number, number, number];
      const text = new TextDecoder().decode(new Uint8Array(directory.buffer, at + 46, name));
      members.set(text, { method: directory.getUint16(at + 10, true), size: directory.getUint32(at + 20, true), offset: directory.getUint32(at + 42, true) });
      at += 46 + name + extra + comment;
    }
    this.#blob = blob;
    this.#members = members;
  }

  static async of(blob: Blob): Promise<Zip> {
    const end = await viewOf(blob.slice(-END_SIZE));
    if (end.getUint32(0, true) !== END) throw new RangeError("This is no zip file.");
    const [size, offset] = [end.getUint32(12, true), end.getUint32(16, true)];
    return new Zip(blob, await viewOf(blob.slice(offset, offset + size)), end.getUint16(10, true));
  }

  /** Give the lines of a member; of one that is not there, none. */
  async lines(name: string): Promise<string[]> {
    const member = this.#members.get(name);
    if (!member) return [];
    const head = await viewOf(this.#blob.slice(member.offset, member.offset + 30));
    const begin = member.offset + 30 + head.getUint16(26, true) + head.getUint16(28, true);
    const packed = this.#blob.slice(begin, begin + member.size).stream();
    const plain = member.method === DEFLATED ? packed.pipeThrough(new DecompressionStream("deflate-raw")) : packed;
    return (await new Response(plain).text()).split("\n").filter(Boolean);
  }
}

async function viewOf(blob: Blob): Promise<DataView<ArrayBuffer>> {
  return new DataView(await blob.arrayBuffer());
}

export class Recording {
  readonly manifest: Manifest;
  /** When the first that is in it was, which may be after the time that was asked for; and its end. */
  readonly begin: number;
  readonly end: number;
  readonly events: readonly Event[];
  readonly marks: readonly Mark[];
  /** The records of each line as text: few of a hundred thousand are ever looked at. */
  readonly #records: ReadonlyMap<string, readonly string[]>;

  private constructor(manifest: Manifest, events: readonly Event[], records: ReadonlyMap<string, readonly string[]>) {
    this.manifest = manifest;
    this.events = events;
    this.#records = records;
    this.end = Date.parse(manifest.to);
    this.marks = marksOf(events, this.end);
    const firsts = [...events.slice(0, 1).map((it) => Date.parse(it.time)), ...[...records].flatMap(([line, all]) => all.slice(0, 1).map((it) => entryOf(line, it).at))];
    this.begin = Math.min(Math.max(Math.min(...firsts), Date.parse(manifest.from)), this.end);
  }

  static async of(blob: Blob): Promise<Recording> {
    const zip = await Zip.of(blob);
    const manifest = JSON.parse((await zip.lines("manifest.json")).join("\n")) as Manifest;
    const events = (await zip.lines("events.jsonl")).map((it) => JSON.parse(it) as Event);
    const records = new Map<string, string[]>();
    for (const line of manifest.lines) records.set(line, await zip.lines(`lines/${line}.jsonl`));
    return new Recording(manifest, events, records);
  }

  protocol(line: string): "rorze" | "fics" {
    return this.manifest.configuration.lines?.find(({ id }) => id === line)?.protocol ?? "rorze";
  }

  /** What came between two times, at most so much of each line and of the events, those nearest to the middle. */
  around(from: number, to: number, most: number): Told[] {
    const told: Told[] = [];
    for (const [line, records] of this.#records) told.push(...nearest(records, from, to, most, (it) => entryOf(line, it)));
    told.push(...nearest(this.events, from, to, most, (event) => ({ at: Date.parse(event.time), line: addressOf(event), event })));
    return told.toSorted((one, other) => one.at - other.at);
  }
}

function entryOf(line: string, text: string): Told {
  const entry = JSON.parse(text) as Entry;
  return { at: Date.parse(entry.at), line, entry };
}

function nearest<T>(all: readonly T[], from: number, to: number, most: number, read: (it: T) => Told): Told[] {
  const first = (at: number): number => firstFrom(all, (it) => read(it).at >= at);
  const [begin, middle, end] = [first(from), first((from + to) / 2), first(to)];
  return all.slice(Math.max(begin, middle - most / 2), Math.min(end, middle + most / 2)).map(read);
}

/** The place of the first that has it, in a list in which all behind it have it, too. */
function firstFrom<T>(all: readonly T[], has: (it: T) => boolean): number {
  let [low, high] = [0, all.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (has(all[middle] as T)) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** Find moves, stops and alarms: a move from when it was sent to its end, a stop until it was confirmed. */
function marksOf(events: readonly Event[], end: number): Mark[] {
  const marks = new Map<string, Mark>();
  for (const event of events) {
    const [about, at] = [addressOf(event), Date.parse(event.time)];
    if ("event_cursor" in event.data) {
      const move = event.data as AnyMove;
      const to = move.ended_at ? Date.parse(move.ended_at) : end;
      marks.set(move.id, { kind: "move", about, from: Date.parse(move.sent_at ?? move.created_at), to, isBad: BAD_ENDS.includes(move.status), event });
    } else if (event.type.includes(".stop.")) {
      const key = `${about}/stop`;
      const isOver = event.type.endsWith(".confirmed");
      const mark: Mark = { kind: "stop", about, from: marks.get(key)?.from ?? at, to: isOver ? at : end, isBad: !isOver, event };
      marks.delete(key);
      marks.set(isOver ? event.id : key, mark);
    } else if (event.type === "alarm.raised") marks.set(event.id, { kind: "alarm", about, from: at, to: at, isBad: true, event });
  }
  return [...marks.values()];
}
