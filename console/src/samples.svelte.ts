/** Live positions: the newest of each motor, and those of the last 20 s. */

import type { Axes, Event } from "./gateway.ts";
import { EVENTS, Live } from "./live.ts";
import { plant } from "./plant.svelte.ts";
import { addressOf } from "./told.ts";

export interface Sample {
  pulses: number;
  /** When it was told, on this machine's clock. */
  at: number;
}

const KEPT_MS = 20_000;
const OLD_MS = 3000;

class Samples {
  #pending: Record<string, Sample> = {};
  #showing: ReturnType<typeof setTimeout> | undefined;
  /** What comes within this time is shown together. */
  #gatherMs = 0;
  #newest = $state.raw<Record<string, Sample>>({});
  #axes = $state.raw<Record<string, Axes>>({});
  /** The samples of one motor, oldest first; not reactive, the plot looks when it draws. */
  readonly trail: Sample[] = [];

  /** The newest sample of a motor, unless there is something newer; without a connection there is not. */
  of(address: string): Sample | undefined {
    const sample = this.#newest[address];
    return sample && (!plant.fresh || plant.now - sample.at < OLD_MS) ? sample : undefined;
  }

  /** Where the axes of a unit were when its robot last acted on it. */
  axesOf(address: string): Axes | undefined {
    return this.#axes[address];
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
    if (axes) this.#axes = { ...this.#axes, [address]: axes };
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
