/** Live positions: the newest of each motor, and those of the last 20 s. */

import { type Axes, type Body, type Event, type Robot, gateway } from "./gateway.ts";
import { EVENTS, Live } from "./live.ts";
import { plant } from "./plant.svelte.ts";
import { addressOf } from "./told.ts";

/** Something that was told, and when, on this machine's clock. */
interface Told {
  at: number;
}

export interface Sample extends Told {
  pulses: number;
}

export interface UnitSample extends Told {
  axes: Axes;
}

const KEPT_MS = 20_000;
/** Each motor that can be asked tells its place more often. */
const DEAD_MS = 20_000;

class Samples {
  #pending: Record<string, Sample> = {};
  #showing: ReturnType<typeof setTimeout> | undefined;
  /** What comes within this time is shown together. */
  #gatherMs = 0;
  #newest = $state.raw<Record<string, Sample>>({});
  #units = $state.raw<Record<string, UnitSample>>({});
  /** The samples of one motor, oldest first; not reactive, the plot looks when it draws. */
  readonly trail: Sample[] = [];

  /** Where a body was when that was told last; what the gateway does not know any more is forgotten. */
  of(body: Body): Sample | undefined {
    const sample = this.#newest[body.body_id];
    if (body.position === null) return sample && plant.isNew(sample.at) ? sample : undefined;
    const at = plant.positionAt(body);
    return sample && sample.at > at ? sample : { pulses: body.position, at };
  }

  /** Where the axes of a unit were when its robot last acted on it. */
  ofUnit(address: string): UnitSample | undefined {
    return this.#units[address];
  }

  /** Ask once for units that have not told yet where they are: only that which a robot acts on is followed. */
  async readUnits({ robot_id, units }: Robot): Promise<void> {
    for (const { number } of units) {
      const address = `${robot_id}/units/${number}`;
      if (this.#units[address]) continue;
      const at = Date.now();
      const params = { path: { robot_id, unit: number } };
      const { data } = await gateway.http.GET("/robots/{robot_id}/units/{unit}/position", { params });
      if (data) this.#noteUnit(address, { axes: data.axes, at });
    }
  }

  /** Follow all motors, or one of them, so many times a second; gives how to end it. */
  follow(rate: number, one?: string): () => void {
    this.trail.length = 0;
    this.#gatherMs = 1000 / rate;
    this.#newest = {};
    const live = new Live<Event[]>({
      ...EVENTS,
      query: () => plant.identity && this.#query(rate, one),
      told: (events) => events.forEach((event) => this.#take(event, one)),
      restless: DEAD_MS,
    });
    return () => live.end();
  }

  #query(rate: number, one?: string): Record<string, string> {
    return { ...plant.mine(), ...(one && { bodies: one }), types: "body.position,robot.position", sample: String(rate) };
  }

  #take(event: Event, one?: string): void {
    const { pulses, axes } = event.data as { pulses?: number; axes?: Axes };
    const address = addressOf(event);
    if (pulses !== undefined) this.#note(address, pulses, one);
    if (axes) this.#noteUnit(address, { axes, at: Date.now() });
  }

  #noteUnit(address: string, sample: UnitSample): void {
    this.#units = { ...this.#units, [address]: sample };
  }

  #note(address: string, pulses: number, one?: string): void {
    const sample = { pulses, at: Date.now() };
    this.#pending[address] = sample;
    this.#showing ??= setTimeout(() => this.#show(), this.#gatherMs);
    if (address !== one) return;
    this.trail.push(sample);
    while (this.trail[0] && this.trail[0].at < sample.at - KEPT_MS) this.trail.shift();
  }

  #show(): void {
    this.#showing = undefined;
    this.#newest = { ...this.#newest, ...this.#pending };
    this.#pending = {};
  }
}

export const samples = new Samples();
