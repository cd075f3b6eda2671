/** Places in words: pulses, and the unit of a body's scale. */

import type { AnyMove, Axes, Body } from "./gateway.ts";
import { language, words } from "./words/index.svelte.ts";

export interface Shown {
  value: string;
  unit: string;
  /** The same in pulses, where the value is in another unit. */
  pulses: string | undefined;
}

const GROUPED = new Intl.NumberFormat("en");

/** Write a place of a body. */
export function shown(body: Body, pulses: number | null): Shown {
  if (pulses === null) return { value: "–", unit: body.unit ?? "", pulses: undefined };
  const whole = GROUPED.format(pulses).replaceAll(",", "\u202f");
  const scaled = scaledOf(body, pulses);
  if (scaled === undefined) return { value: whole, unit: words().plant.pulse, pulses: undefined };
  return { value: scaled.toFixed(decimals(body)), unit: body.unit ?? "", pulses: words().plant.pulses(whole) };
}

export function scaledOf(body: Body, pulses: number): number | undefined {
  return body.pulses_per_unit ? pulses / body.pulses_per_unit : undefined;
}

/** As many as a pulse can be told by. */
function decimals(body: Body): number {
  return Math.min(6, Math.max(0, Math.ceil(Math.log10(Math.abs(body.pulses_per_unit ?? 1)))));
}

type Known = number | null | undefined;

/** How much of a move's way lies behind, from 0 to 1; undefined where that cannot be known. */
export function progress(move: AnyMove | undefined, pulses: number | null): number | undefined {
  return move && "group_id" in move ? partOf(move.start_position, move.target_position, pulses) : undefined;
}

/** The same of a unit of a robot: of the axis that has the longest way. */
export function progressOfUnit(move: AnyMove | undefined, axes: Axes | undefined): number | undefined {
  if (!move || !axes || !("robot_id" in move)) return undefined;
  const { start_position: start, target_position: target } = move;
  const way = (name: string): number => Math.abs((target?.[name] ?? NaN) - (start?.[name] ?? NaN)) || 0;
  const [longest = ""] = Object.keys(axes).toSorted((one, other) => way(other) - way(one));
  return partOf(start?.[longest], target?.[longest], axes[longest]?.value);
}

function partOf(start: Known, target: Known, now: Known): number | undefined {
  if (start == null || target == null || now == null || start === target) return undefined;
  return Math.min(1, Math.max(0, (now - start) / (target - start)));
}

export function isOver(move: AnyMove): boolean {
  return move.ended_at !== null;
}

export function timeOf(text: string): string {
  const tenths = Math.floor(new Date(text).getMilliseconds() / 100);
  return isToday(text) ? `${clockOf(text)}.${tenths}` : clockOf(text);
}

/** The day of a time, as a heading. */
export function dayOf(text: string): string {
  return new Date(text).toLocaleDateString(language.now, { weekday: "long", month: "long", day: "numeric" });
}

/** A time as HH:MM:SS, with its day where that is another. */
export function clockOf(text: string): string {
  const time = new Date(text);
  const two = (value: number) => String(value).padStart(2, "0");
  const clock = [time.getHours(), time.getMinutes(), time.getSeconds()].map(two).join(":");
  return isToday(text) ? clock : `${time.getMonth() + 1}/${time.getDate()} ${clock}`;
}

function isToday(text: string): boolean {
  return new Date(text).toDateString() === new Date().toDateString();
}

/** Whether a place is counted from an unknown origin. */
export function isUnsure(of: { homed: string; power_cycled: boolean }): boolean {
  return of.homed !== "yes" || of.power_cycled;
}
