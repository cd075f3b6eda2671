/** What a pendant needs of whatever is moved by hand. */

import type { Deed } from "./gateway.ts";
import type { Chosen } from "./speeds.svelte.ts";

/** A key of the cross: it jogs while it is held, or makes one step. */
export interface Key {
  /** Axis and sign, such as `X+`. */
  name: string;
  /** Its place in the cross. */
  area: string;
  note: string;
  /** How the jog begins, for a command line. */
  deed: Deed;
  hold: (released: Promise<void>) => Promise<unknown>;
  /** One step so long. */
  step: (by: number) => Deed;
}

export interface Place {
  name: string;
  value: string;
  unit: string;
}

/** What stands on a pendant; undefined values are not known now. */
export interface Face {
  places: readonly Place[];
  isOld: boolean;
  /** Whether they are counted from an unknown origin. */
  isUnsure: boolean;
  keys: readonly Key[];
  speed: Chosen;
  speedUnit: string;
  steps: readonly number[];
  stepUnit: string;
  /** Store where it stands under a number, with a name. */
  teach: (number: number, name: string) => Deed;
  stop: Deed;
  note?: string;
}

const AREAS: Record<string, string> = { "X-": "left", "X+": "right", "Y-": "down", "Y+": "up", "Z-": "zdown", "Z+": "zup" };

/** The place of a key: the cross has X and Y, beside it stands Z, and all others below. */
export function areaOf(axis: string, sign: "-" | "+"): string {
  return AREAS[`${axis}${sign}`] ?? "auto";
}
