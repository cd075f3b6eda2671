/** Who may move: leases, those of this page renewed while it is open. */

import { type Deed, Refused, type Schemas, type Target, gateway, quietly, sent } from "./gateway.ts";

type Lease = Schemas["Lease"];
type Taken = Schemas["Taken"];

const TTL_S = 10;
const RENEWALS = 3;
const HEADER = "Lease-Token";

class Leases {
  #all = $state.raw<Lease[]>([]);
  #mine = $state.raw<Taken[]>([]);
  /** Called with each lease of this page that is over against its will. */
  onLost: (taken: Taken, refusal: Refused) => void = () => undefined;

  start(): void {
    setInterval(() => this.#mine.forEach((taken) => void quietly(() => this.#renew(taken))), (TTL_S * 1000) / RENEWALS);
  }

  async read(): Promise<void> {
    const { data } = await gateway.http.GET("/leases");
    this.#all = data?.leases ?? [];
  }

  /** The lease of something, mine or another's. */
  of(target: Target): Lease | undefined {
    const address = addressOf(target);
    return this.#all.find((lease) => lease.covers.includes(address) || lease.scope === address);
  }

  isMine({ lease }: Lease): boolean {
    return this.#mine.some((taken) => taken.lease === lease);
  }

  take(target: Target): Deed {
    return async ({ http }) => {
      const { data } = await http.POST("/leases", { body: { scope: addressOf(target), ttl_s: TTL_S } });
      if (data) this.#keep([...this.#mine, data]);
      await this.read();
      return data;
    };
  }

  giveBack({ lease }: Lease): Deed {
    return async ({ http }) => {
      const { data } = await http.DELETE("/leases/{lease_id}", { params: { path: { lease_id: lease } } });
      this.#keep(this.#mine.filter((taken) => taken.lease !== lease));
      await this.read();
      return data;
    };
  }

  async #renew(taken: Taken): Promise<void> {
    const { lease } = taken;
    try {
      await gateway.http.POST("/leases/{lease_id}/renew", { params: { path: { lease_id: lease } } });
    } catch (error) {
      if (error instanceof Refused && this.#mine.includes(taken)) this.#lose(taken, error);
      throw error;
    }
  }

  #lose(taken: Taken, refusal: Refused): void {
    this.#keep(this.#mine.filter((it) => it !== taken));
    this.onLost(taken, refusal);
  }

  #keep(mine: Taken[]): void {
    this.#mine = mine;
    if (mine.length > 0) sent.set(HEADER, mine.map(({ token }) => token).join(", "));
    else sent.delete(HEADER);
  }
}

export function addressOf(target: Target): string {
  if ("members" in target) return target.address;
  return "body_id" in target ? target.body_id : target.robot_id;
}

export const leases = new Leases();
