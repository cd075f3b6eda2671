/** What needs somebody, and what helps. */

import type { Gateway } from "../../clients/typescript/src/gateway.ts";
import type { Deed, Right, Schemas, Target } from "./gateway.ts";
import { nameOf } from "./actions.svelte.ts";
import { plant } from "./plant.svelte.ts";
import { language, words } from "./words/index.svelte.ts";

export interface Remedy {
  label: string;
  right: Right;
  target: Target | undefined;
  deed: Deed;
}

export interface Alarm {
  key: string;
  who: string;
  link: { page: string; subject: string } | undefined;
  text: string;
  remedies: Remedy[];
}

const PAGES: Record<string, string> = { bodies: "axis", robots: "robot", scaras: "scara" };

/** All that stands now. */
export function alarms(): Alarm[] {
  return plant.alarms.map(shown);
}

function shown(alarm: Schemas["Alarm"]): Alarm {
  const { happened, motor, remedy } = alarm[language.now];
  const [, kind = "", who = ""] = alarm.subject.split("/");
  const page = PAGES[kind];
  const target = plant.target(who);
  const calls = alarm.next.filter(({ method }) => method !== "GET");
  return {
    key: alarm.id,
    who: target ? nameOf(target) : who,
    link: page ? { page, subject: who } : undefined,
    text: `${happened} ${motor} ${remedy}`,
    remedies: [
      ...calls.map((call) => ({ label: call[language.now], right: "operate" as const, target, deed: (gateway: Gateway) => gateway.call(call) })),
      { label: words().events.resetAlarm, right: "operate" as const, target: undefined, deed: reset(alarm.id) },
    ],
  };
}

function reset(alarm_id: string): Deed {
  return ({ http }) => http.POST("/alarms/{alarm_id}/reset", { params: { path: { alarm_id } } });
}

export function clearStatus(bodyId: string): Deed {
  return (gateway) => gateway.command(bodyId, "clear-controller-status");
}

export function resetErrors(robot_id: string): Deed {
  return ({ http }) => http.POST("/robots/{robot_id}/errors/reset", { params: { path: { robot_id } } });
}
