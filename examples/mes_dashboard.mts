/**
 * A dashboard for a manufacturing execution system: `node examples/mes_dashboard.mts http://127.0.0.1:8420`.
 *
 * It keeps a row for each body and each robot's unit: what it does, how its moves have ended, how long it was
 * busy. Events tell all of it, and go on where they were after a lost connection. Ctrl-C ends it, and no motor.
 */

// Outside of this repository: from "motion-gateway-client".
import { Gateway, GatewayError, type Event, type Move, type RobotMove } from "../clients/typescript/src/index.ts";

const TYPES = ["body.*", "robot.*", "line.*", "stream.gap"];

/** One body, or one unit of a robot. */
class Row {
  state = "";
  position = "";
  good = 0;
  bad = 0;
  busyS = 0;

  take(move: Move | RobotMove): void {
    this.state = move.status;
    if (typeof move.position === "number") this.position = String(move.position);
    else if (move.position)
      this.position = Object.entries(move.position).map(([axis, value]) => `${axis}${value ?? "?"}`).join(" ");
    if (!move.ended_at || !move.sent_at) return;
    if (move.status === "succeeded") this.good += 1;
    else this.bad += 1;
    this.busyS += (Date.parse(move.ended_at) - Date.parse(move.sent_at)) / 1000;
  }

  text(address: string): string {
    const counts = [this.good, this.bad, this.busyS.toFixed(1)];
    return cells(address, this.state, this.position, ...counts.map(String));
  }
}

/** All rows, and the last alarms. */
class Board {
  readonly rows = new Map<string, Row>();
  alarms: string[] = [];

  take(event: Event): void {
    switch (event.type) {
      case "body.move.started": case "body.move.succeeded": case "body.move.failed": case "body.move.stopped":
      case "robot.move.started": case "robot.move.succeeded": case "robot.move.failed": case "robot.move.stopped":
        return this.row(event.data.body_id).take(event.data);
      case "body.move.lost": case "body.move.unknown": case "robot.move.lost": case "robot.move.unknown":
        this.row(event.data.body_id).take(event.data);
        return this.#alarm(event, "look at the motor before it moves again");
      case "robot.error":
        return this.#alarm(event, event.data.en);
      case "line.down":
        return this.#alarm(event, event.data.reason);
      case "body.offline": case "body.power_cycled": case "robot.offline": case "robot.power_cycled":
      case "stream.gap":
        return this.#alarm(event, "");
    }
  }

  row(address: string): Row {
    const row = this.rows.get(address) ?? new Row();
    this.rows.set(address, row);
    return row;
  }

  text(): string {
    const rows = [...this.rows].sort().map(([address, row]) => row.text(address));
    return [cells("axis", "state", "position", "good", "bad", "busy s"), ...rows, "", ...this.alarms].join("\n");
  }

  #alarm(event: Event, words: string): void {
    const alarm = `${event.time} ${event.type} ${event.subject} ${words}`.trimEnd();
    this.alarms = [...this.alarms, alarm].slice(-5);
  }
}

function cells(axis: string, state: string, ...rest: string[]): string {
  return axis.padEnd(16) + state.padEnd(12) + rest.map((cell) => cell.padStart(10)).join("");
}

try {
  const url = process.argv[2];
  const gateway = new Gateway(url ? { url } : {});
  const board = new Board();
  const { data } = await gateway.http.GET("/bodies");
  for (const body of data?.bodies ?? []) board.row(body.body_id);
  console.log(board.text());
  for await (const event of gateway.events({ types: TYPES })) {
    board.take(event);
    console.log((process.stdout.isTTY ? "\x1b[H\x1b[2J" : "") + board.text());
  }
} catch (error) {
  if (!(error instanceof GatewayError)) throw error;
  console.error(error.message);
  process.exitCode = 1;
}
