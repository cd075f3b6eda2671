/** Where the finger of a SCARA robot is: as the gateway works it out from the newest positions; nothing is sent. */

import { type FingerPlace, placeIn, pulsesOf } from "./arm.ts";
import { GatewayError, gateway } from "./gateway.ts";
import { plant } from "./plant.svelte.ts";
import { every } from "./reading.ts";

const PERIOD_MS = 200;

export class Finger {
  place = $state.raw<FingerPlace>();
  pulses = $state.raw<number[]>();
  /** Why its place is not known. */
  trouble = $state("");

  /** Follow it; gives how to end it. */
  follow(scara_id: string): () => void {
    return every(PERIOD_MS, () => this.#look(scara_id));
  }

  async #look(scara_id: string): Promise<void> {
    const scara = plant.scara(scara_id);
    const pulses = scara && pulsesOf(scara);
    if (!pulses) {
      this.place = undefined;
    } else if (String(pulses) !== String(this.pulses)) {
      await this.#calculate(scara_id, pulses);
    }
    this.pulses = pulses;
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
