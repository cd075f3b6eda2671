/** What a page asks a controller for every so often: it is there only while it is new. */

import { every } from "./reading.ts";
import { plant } from "./plant.svelte.ts";

/** The time that an answer may take. */
const PATIENCE_MS = 3000;

export class Watched<T> {
  #told = $state.raw<{ value: T; at: number }>();
  readonly #periodMs: number;

  constructor(periodMs: number) {
    this.#periodMs = periodMs;
  }

  /** As it is now; undefined where nobody knows. */
  get now(): T | undefined {
    const told = this.#told;
    return told && plant.fresh && plant.now - told.at < this.#keptMs ? told.value : undefined;
  }

  /** Ask for it again and again; gives how to end it. */
  follow(read: () => Promise<T>): () => void {
    this.#told = undefined;
    return every(this.#periodMs, async () => {
      const at = Date.now();
      try {
        this.#told = { value: await read(), at };
      } catch (error) {
        this.#told = undefined;
        throw error;
      }
    });
  }

  /** Change what was told, as something else has told it. */
  set(value: T): void {
    this.#told = { value, at: Date.now() };
  }

  get #keptMs(): number {
    return PATIENCE_MS + this.#periodMs;
  }
}
