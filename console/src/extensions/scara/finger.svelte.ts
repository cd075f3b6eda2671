/** Where the finger of a SCARA robot is: as the gateway works it out from the newest positions; nothing is sent. */

import { GatewayError, gateway } from "../../gateway.ts";
import { every } from "../../reading.ts";
import { type FingerPlace, placeIn, samplesOf } from "./arm.ts";
import { scaraOf } from "./scara.ts";

const PERIOD_MS = 200;

export class Finger {
  place = $state.raw<FingerPlace>();
  pulses = $state.raw<number[]>();
  /** When the oldest position was told that it is worked out from. */
  at = $state(0);
  /** Why its place is not known. */
  trouble = $state("");

  /** Follow it; gives how to end it. */
  follow(scara_id: string): () => void {
    return every(PERIOD_MS, () => this.#look(scara_id));
  }

  async #look(scara_id: string): Promise<void> {
    const scara = scaraOf(scara_id);
    const told = scara && samplesOf(scara);
    const pulses = told?.map((it) => it.pulses);
    if (!pulses) {
      this.place = undefined;
    } else if (String(pulses) !== String(this.pulses)) {
      await this.#calculate(scara_id, pulses);
    }
    this.pulses = pulses;
    this.at = Math.min(...(told ?? []).map((it) => it.at));
  }

  async #calculate(scara_id: string, pulses: number[]): Promise<void> {
    const params = { path: { scara_id } };
    try {
      const { data } = await gateway.http.POST("/scaras/{scara_id}/kinematics/forward", { params, body: { pulses } });
      this.place = data && placeIn(data);
      this.trouble = "";
    } catch (error) {
      if (!(error instanceof GatewayError)) throw error;
      this.place = undefined;
      this.trouble = error.detail;
    }
  }
}
