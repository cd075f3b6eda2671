/** The body that was looked at last on this computer. */

import { plant } from "./plant.svelte.ts";

const KEPT = "motion-gateway.body";

export function note(body_id: string): void {
  localStorage.setItem(KEPT, body_id);
}

/** The body that a page is about: the one it names, else the one that was looked at last. */
export function bodyOf(subject: string): string {
  if (subject) {
    if (!subject.includes("/")) note(subject);
    return subject;
  }
  const kept = localStorage.getItem(KEPT) ?? "";
  return plant.body(kept) ? kept : (plant.bodies[0]?.body_id ?? "");
}
