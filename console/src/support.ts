/** What somebody who helps from afar needs to see, as far as who asks may see it. */

import type { Gateway } from "../../clients/typescript/src/gateway.ts";
import { extensions } from "./extensions.ts";
import { type Deed, GatewayError } from "./gateway.ts";
import { plant } from "./plant.svelte.ts";

const EVENTS = 1000;
const FRAMES = 5000;
const DEEDS = 500;

/** Gather it; what cannot be read stands there with the reason. */
export const gather: Deed = async (gateway) => {
  const { http } = gateway;
  const asked: Record<string, () => Promise<{ data?: unknown }>> = {
    version: () => http.GET("/version"),
    posture: () => http.GET("/system/posture"),
    identity: () => http.GET("/system/identity"),
    lines: () => http.GET("/lines"),
    bodies: () => http.GET("/bodies"),
    groups: () => http.GET("/groups"),
    robots: () => http.GET("/robots"),
    alarms: () => http.GET("/alarms"),
    deeds: () => http.GET("/audit", { params: { query: { limit: DEEDS } } }),
    events: () => lastEvents(gateway),
  };
  for (const { collection, read } of extensions) asked[collection] = async () => ({ data: await read() });
  for (const { line_id } of plant.lines) {
    const params = { path: { line_id }, query: { limit: FRAMES } };
    asked[`trace of ${line_id}`] = () => http.GET("/lines/{line_id}/trace", { params });
  }
  const found: [string, unknown][] = [["gathered_at", new Date().toISOString()]];
  for (const [name, ask] of Object.entries(asked)) found.push([name, await told(ask)]);
  return Object.fromEntries(found);
};

async function told(ask: () => Promise<{ data?: unknown }>): Promise<unknown> {
  try {
    return (await ask()).data;
  } catch (error) {
    if (error instanceof GatewayError) return { not_read: error.detail };
    throw error;
  }
}

/** The newest of all that the gateway still has. */
async function lastEvents({ http }: Gateway): Promise<{ data: unknown[] }> {
  let newest: unknown[] = [];
  let after: string | undefined;
  for (;;) {
    const { data } = await http.GET("/events", { params: { query: { ...plant.mine(), limit: EVENTS, after } } });
    newest = [...newest, ...(data?.events ?? [])].slice(-EVENTS);
    after = data?.cursor;
    if (!data || data.events.length < EVENTS) return { data: newest };
  }
}
