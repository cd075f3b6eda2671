/** Server-sent events, line by line, as the gateway writes them. */

import type { Event } from "./types.ts";

/** Puts lines together to events, and knows after which cursor reading goes on. */
export class EventReader {
  cursor: string | undefined;
  #rest = "";
  #id: string | undefined;
  #data: string[] = [];

  constructor(cursor?: string) {
    this.cursor = cursor;
  }

  /** Take a piece of text; the events that it ends are given once. */
  *take(text: string): Generator<Event> {
    const lines = (this.#rest + text).split("\n");
    this.#rest = lines.pop() ?? "";
    for (const line of lines) {
      const event = this.#takeLine(line);
      if (event) yield event;
    }
  }

  #takeLine(line: string): Event | undefined {
    this.cursor ??= /^: events after (\S+)$/.exec(line)?.[1];
    if (line.startsWith("id: ")) this.#id = line.slice(4);
    if (line.startsWith("data: ")) this.#data.push(line.slice(6));
    if (line !== "" || this.#data.length === 0) return undefined;
    const event = JSON.parse(this.#data.join("\n")) as Event;
    this.#data = [];
    this.cursor = this.#id ?? this.cursor;
    return event;
  }
}
