/** Reading what a page shows again and again. */

import { untrack } from "svelte";

import { Refused, quietly } from "./gateway.ts";
import { plant } from "./plant.svelte.ts";

/** Read now and every so often, while somebody looks and the gateway is there; gives how to end it. */
export function every(periodMs: number, read: () => Promise<unknown>, gone: (refusal: Refused) => void = () => undefined): () => void {
  let isReading = false;
  async function look(): Promise<void> {
    if (isReading || document.hidden || !plant.fresh) return;
    isReading = true;
    await quietly(() => orGone(read, gone)).finally(() => (isReading = false));
  }
  untrack(() => void look());
  const timer = setInterval(() => void look(), periodMs);
  return () => clearInterval(timer);
}

/** A gateway that has begun anew may know nothing of what was followed. */
async function orGone(read: () => Promise<unknown>, gone: (refusal: Refused) => void): Promise<void> {
  try {
    await read();
  } catch (error) {
    if (error instanceof Refused && error.status === 404) gone(error);
    throw error;
  }
}
