/** How fast an axis is moved by hand: slowly at first, and then as it was chosen last on this computer. */

import type { Body, Schemas } from "./gateway.ts";

type Rate = Schemas["Rate"];
type Unit = Rate["unit"];

const KEPT = "motion-gateway.speed.";
export const LENGTHS = [0.5, 1, 5, 20, 100, 500];
const FINE = LENGTHS.map((value) => value * 1000);
const CHOICES: Record<Unit, readonly number[]> = {
  "pulse/s": [50, 100, 500, 2000, 10_000, 50_000],
  "mm/s": LENGTHS,
  "deg/s": LENGTHS,
  "um/s": FINE,
  "mdeg/s": FINE,
};
/** Of the choices: slow enough to let go in time. */
const FIRST = 2;
const PERCENTS = [1, 5, 10, 25, 50, 100];
const FACTORS = [10, 25, 50, 75, 100];
const FULL = 100;

/** One of several speeds, kept by what moves. */
export class Chosen {
  readonly choices: readonly number[];
  readonly #key: string;
  now = $state(0);

  constructor(address: string, unit: string, choices: readonly number[], first = choices[FIRST] ?? 1) {
    this.#key = `${KEPT}${address}.${unit}`;
    this.choices = choices;
    const kept = Number(localStorage.getItem(this.#key));
    this.now = choices.includes(kept) ? kept : first;
  }

  choose(value: number): void {
    this.now = value;
    localStorage.setItem(this.#key, String(value));
  }
}

/** The part of each chosen speed, in percent, that whatever moves by hand from this computer goes at. */
export const allFactor = new Chosen("all", "factor", FACTORS, FULL);

/** The same of one axis. */
export function factorOf(address: string): Chosen {
  return new Chosen(address, "factor", FACTORS, FULL);
}

/** A speed by hand under the factors: of all, and its own. */
export function factored(speed: number, own = FULL): number {
  return Number(((speed * allFactor.now * own) / FULL ** 2).toPrecision(3));
}

/** A percentage under the factor of all, which no robot takes below one. */
export function factoredPercent(percent: number): number {
  return Math.max(1, Math.round((percent * allFactor.now) / FULL));
}

export function rateUnit(body: Body): Unit {
  return `${body.unit ?? "pulse"}/s` as Unit;
}

/** The speed of a body's jogs, steps and moves to places. */
export function speedOf(body: Body): Chosen {
  const unit = rateUnit(body);
  return new Chosen(body.body_id, unit, CHOICES[unit]);
}

/** The same of a unit of a robot, in percent of its full speed. */
export function percentOf(address: string): Chosen {
  return new Chosen(address, "%", PERCENTS);
}
