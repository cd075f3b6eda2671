/** How the arm of a SCARA robot stands: in millimetres, counted from the base. */

import type { Schemas } from "../../gateway.ts";
import { plant } from "../../plant.svelte.ts";
import { type Sample, samples } from "../../samples.svelte.ts";
import type { Scara } from "./scara.ts";

export interface Point {
  x: number;
  y: number;
}

export interface FingerPlace extends Point {
  /** In degrees, counterclockwise from X. */
  angle: number;
}

const MICROMETRES = 1000;
const THOUSANDTHS = 1000;

/** Where the axes are; undefined while that of one is not known. */
export function samplesOf({ axes }: Scara): Sample[] | undefined {
  const bodies = axes.map(({ body_id }) => plant.body(body_id));
  const told = bodies.map((body) => body && samples.of(body));
  return told.every((it) => it !== undefined) ? told : undefined;
}

export function placeIn({ x, y, angle }: Schemas["ScaraPlace"]): FingerPlace {
  return { x: x.value / MICROMETRES, y: y.value / MICROMETRES, angle: angle.value / THOUSANDTHS };
}

/** How far the finger reaches at most. */
export function reachOf({ geometry: { arm, finger } }: Scara): number {
  return (2 * arm.value + finger.value) / MICROMETRES;
}

/** Base, elbow, wrist and the finger's end. Of the two ways to bend the elbow it is that to which axis 0 points. */
export function jointsOf({ geometry }: Scara, place: FingerPlace, pulses: readonly number[]): Point[] {
  const link = geometry.arm.value / MICROMETRES;
  const finger = along((place.angle * Math.PI) / 180, geometry.finger.value / MICROMETRES);
  const wrist = { x: place.x - finger.x, y: place.y - finger.y };
  const base = (2 * Math.PI * (pulses[0] ?? 0)) / (geometry.pulses_per_turn[0] ?? 1);
  const half = Math.acos(Math.min(1, Math.hypot(wrist.x, wrist.y) / (2 * link)));
  const heading = Math.atan2(wrist.y, wrist.x);
  const bent = [heading + half, heading - half].toSorted((one, other) => Math.cos(other - base) - Math.cos(one - base));
  return [{ x: 0, y: 0 }, along(bent[0] ?? heading, link), wrist, place];
}

function along(direction: number, length: number): Point {
  return { x: length * Math.cos(direction), y: length * Math.sin(direction) };
}
