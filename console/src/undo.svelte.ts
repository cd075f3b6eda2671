/** What was overwritten, to be put back: kept in this tab, a reload of the page too. */

import type { Schemas } from "./gateway.ts";
import { plant } from "./plant.svelte.ts";

const KEPT = "motion-gateway.undo";
const FOR_MS = 10 * 60_000;

interface Step {
  id: number;
  /** The body, such as `line1.3F`, or the unit, such as `r1/units/1`. */
  about: string;
  until: number;
  /** What was there before: a user program, or positions. */
  source?: string;
  instructions?: number;
  positions?: Schemas["PositionToStore"][];
  /** The same of a robot's unit. */
  robotPositions?: Schemas["StoredEntry"][];
  flash: boolean;
}

class Undo {
  #steps = $state.raw<Step[]>(JSON.parse(sessionStorage.getItem(KEPT) ?? "[]") as Step[]);

  /** What can be put back in a body now, newest first. */
  of(about: string): Step[] {
    return this.#steps.filter((step) => step.about === about && plant.now < step.until);
  }

  remember(step: Omit<Step, "id" | "until">): void {
    const now = Date.now();
    this.#keep([{ ...step, id: now, until: now + FOR_MS }, ...this.#steps.filter(({ until }) => now < until)]);
  }

  forget({ id }: Step): void {
    this.#keep(this.#steps.filter((step) => step.id !== id));
  }

  #keep(steps: Step[]): void {
    this.#steps = steps;
    try {
      sessionStorage.setItem(KEPT, JSON.stringify(steps));
    } catch {
      // the browser has no room: it is kept until the page is loaded again
    }
  }
}

export const undo = new Undo();
export type { Step };
