/** The client against a running demo, whose address is in MOTION_GATEWAY_URL. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Gateway, MoveNotOver, MoveNotSucceeded, NoAnswer, pathOf, Refused } from "../src/index.ts";
import type { Event, Move, MoveRequest } from "../src/index.ts";
import { Cable } from "./cable.ts";

const gateway = new Gateway({ timeout: 60 });
const NEWS = ["body.move.*", "body.stop.*"];

function by(pulses: number): MoveRequest {
  return { kind: "relative", direction: "cw", distance: { value: pulses, unit: "pulse" } };
}

function ends(event: Event | undefined, move: Move): boolean {
  return event?.type === "body.move.succeeded" && event.data.id === move.id;
}

async function moved(pulses: number): Promise<Move> {
  return gateway.waitForMove(await gateway.startMove("3F", by(pulses)), { timeout: 60 });
}

test("it moves a motor and waits for the end", async () => {
  const planned = await gateway.planMove("3F", by(500));
  assert.match(planned.frame, /^&3F1\+M/);
  const ended = await moved(500);
  assert.equal(ended.position, (ended.start_position ?? 0) + 500);
  const { data } = await gateway.http.GET("/bodies/{body_id}/position", {
    params: { path: { body_id: "3F" } },
  });
  assert.equal(data?.pulses, ended.position);
  assert.deepEqual(await gateway.command("3F", "get-position"), { pulses: ended.position });
});

test("its stream loses the connection, resumes, and misses nothing", async () => {
  const after = (await moved(1)).event_cursor;
  const cable = await Cable.to(process.env["MOTION_GATEWAY_URL"] ?? "");
  const ending = new AbortController();
  const seen: Event[] = [];
  let last = await moved(2);
  let pulls = 0;
  const watching = new Gateway({ url: cable.url });
  for await (const event of watching.events({ bodies: ["3F"], types: NEWS, after, signal: ending.signal })) {
    seen.push(event);
    if (!ends(event, last)) continue;
    if (pulls++ === 2) break;
    cable.pull();
    await moved(700);
    last = await moved(300);
    cable.plug();
  }
  cable.close();
  const { data } = await gateway.http.GET("/events", {
    params: { query: { after, bodies: "3F", types: NEWS.join(","), limit: 1000 } },
  });
  assert.deepEqual(
    seen.map((event) => event.id),
    data?.events.map((event) => event.id),
  );
  assert.equal(seen.filter((event) => event.type === "body.move.succeeded").length, 6);
});

test("a stop ends a move and its waiting", async () => {
  const move = await gateway.startMove("3F", by(5_000_000));
  await assert.rejects(gateway.waitForMove(move, { timeout: 0.05 }), MoveNotOver);
  assert.equal((await gateway.stop("3F")).confirmed, true);
  await assert.rejects(
    gateway.waitForMove(move),
    (error) => error instanceof MoveNotSucceeded && error.move.status === "stopped",
  );
});

test("a refusal says what the motor did and what to do next", async () => {
  await assert.rejects(gateway.startMove("55", by(5)), (error) => {
    assert(error instanceof Refused);
    assert.deepEqual([error.kind, error.status, error.moved, error.retryable], ["not-found", 404, "no", false]);
    assert(error.requestId);
    return true;
  });
  const keyed = gateway.startMove("3F", by(5), { idempotencyKey: "order 7" });
  await assert.rejects(keyed, /Idempotency-Key/);
  const stream = gateway.events({ bodies: ["55"] });
  await assert.rejects(stream.next(), Refused);
});

test("a move is never sent twice, a stop is", async () => {
  const sent: string[] = [];
  const broken = new Gateway({
    url: "http://gateway",
    key: "k",
    fetch: (request) => {
      const { method, url, headers } = request as Request;
      sent.push(`${method} ${new URL(url).pathname} ${headers.get("Authorization")}`);
      return Promise.reject(new TypeError("fetch failed"));
    },
  });
  await assert.rejects(broken.startMove("3F", by(5)), (error) => {
    return error instanceof NoAnswer && error.moved === "unknown" && !error.retryable;
  });
  await assert.rejects(broken.stop("80"), NoAnswer);
  assert.deepEqual(sent, ["POST /bodies/3F/moves Bearer k", ...Array(3).fill("POST /groups/80/stop Bearer k")]);
});

test("an answer that breaks off is none", async () => {
  let sent = 0;
  const fetch = (): Promise<Response> => {
    sent++;
    const body = new ReadableStream({ pull: (it) => it.error(new TypeError("terminated")) });
    return Promise.resolve(new Response(body));
  };
  const broken = new Gateway({ url: "http://gateway", key: "k", fetch });
  await assert.rejects(broken.http.GET("/bodies"), NoAnswer);
  await assert.rejects(broken.stop("80"), NoAnswer);
  assert.equal(sent, 1 + 3);
});

test("what never reached the gateway moved nothing", async () => {
  const cable = await Cable.to("http://127.0.0.1:1");
  const { url } = cable;
  cable.close();
  await assert.rejects(new Gateway({ url }).startMove("3F", by(5)), (error) => {
    return error instanceof NoAnswer && error.moved === "no" && error.retryable;
  });
});

test("a jog moves for as long as its function runs", async () => {
  const params = { path: { robot_id: "r1", unit: 2 } };
  const status = async () => (await gateway.http.GET("/robots/{robot_id}/units/{unit}/status", { params })).data;
  const motion = await gateway.jog("r1", { unit: 2, axis: "X", direction: "-" }, async () => {
    const until = performance.now() + 1200; // longer than the dead man waits
    while (performance.now() < until) await status();
    return (await status())?.axes["X"]?.motion;
  });
  assert.equal(motion, "jog");
  assert.equal((await status())?.moving, false);
});

test("nobody else moves what is leased", async () => {
  const lease = await gateway.lease("00", async (taken) => {
    await assert.rejects(new Gateway({ timeout: 60 }).startMove("00", by(10)), { kind: "lease" });
    await gateway.waitForMove(await gateway.startMove("00", by(10)), { timeout: 60 });
    return taken.lease;
  });
  const { data } = await gateway.http.GET("/leases");
  assert.ok(data && !data.leases.some((it) => it.lease === lease));
});

test("addresses lead to what they name", () => {
  const paths = ["3F", "arm.80", "r1", "a1", "r1/units/2"].map(pathOf);
  assert.deepEqual(paths, ["/bodies/3F", "/groups/arm.80", "/robots/r1", "/robots/a1", "/robots/r1/units/2"]);
});
