/** A SCARA robot as the gateway tells it, and how fast it is moved by hand. */

import type { Made, Schemas } from "../../gateway.ts";
import { plant } from "../../plant.svelte.ts";
import { Chosen, LENGTHS } from "../../speeds.svelte.ts";

export const PAGE = "scara";

export type Scara = Schemas["ScaraInfo"] & Made;
export type ScaraMove = Schemas["ScaraMove"];
export type ScaraMoveRequest =
  | Schemas["ScaraLineRequest"]
  | Schemas["ScaraPathRequest"]
  | Schemas["ScaraOffsetRequest"]
  | Schemas["ScaraExtendRequest"]
  | Schemas["ScaraRetractRequest"]
  | Schemas["ScaraRotateRequest"]
  | Schemas["ScaraFingerRequest"]
  | Schemas["ScaraAlignRequest"];

export function scaraOf(address: string): Scara | undefined {
  return plant.made.find((it): it is Scara => it.page === PAGE && it.address === address);
}

/** How fast the finger goes along its way, or its axes turn where each turns alone. */
export function scaraSpeedOf(scara: Scara, unit: "mm/s" | "deg/s"): Chosen {
  return new Chosen(scara.scara_id, unit, LENGTHS);
}
