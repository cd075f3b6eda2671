/** Whether a recording is served here, and nothing of now: each answer says so. */

const FLAG = "Replay";

class Replay {
  /** The times from which and to which it was recorded; undefined where this is a gateway with lines. */
  of = $state.raw<{ from: string; to: string }>();

  note({ headers }: Response): void {
    const [from, to] = headers.get(FLAG)?.split("/") ?? [];
    if (from && to && from !== this.of?.from) this.of = { from, to };
  }
}

export const replay = new Replay();
