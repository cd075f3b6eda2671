/** What needs somebody, and what helps. */

import type { Gateway } from "../../clients/typescript/src/gateway.ts";
import { nameOf, obstacle, obstacleToMove } from "./actions.svelte.ts";
import type { Deed, Schemas, Target } from "./gateway.ts";
import { plant } from "./plant.svelte.ts";
import { language, words } from "./words/index.svelte.ts";

export interface Remedy {
  label: string;
  deed: Deed;
  /** Why it cannot be done now. */
  why: () => string | undefined;
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
      ...calls.map((call) => ({ label: call[language.now].replace(/[.。]$/, ""), deed: (gateway: Gateway) => gateway.call(call), why: () => obstacleTo(call, target) })),
      { label: words().events.resetAlarm, deed: reset(alarm.id), why: () => obstacle("operate") },
    ],
  };
}

function obstacleTo({ right, path }: Schemas["NextCall"], target: Target | undefined): string | undefined {
  if (right === "stop") return obstacle(right);
  return target && path.endsWith("/moves") ? obstacleToMove(target) : obstacle(right, target);
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
