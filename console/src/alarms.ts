/** What needs somebody, and what helps. */

import type { Gateway } from "../../clients/typescript/src/gateway.ts";
import { nameOf, obstacle, obstacleToMove } from "./actions.svelte.ts";
import { extensions } from "./extensions.ts";
import type { Deed, Schemas, Target } from "./gateway.ts";
import { addressOf } from "./leases.svelte.ts";
import { clockOf } from "./places.ts";
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
  /** When it began and, if it is over, when it was seen to be over, as HH:MM:SS. */
  raised: string;
  ended: string | undefined;
  /** What else is told of the same event. */
  parts: { key: string; text: string; remedies: Remedy[] }[];
  remedies: Remedy[];
}

const PAGES: Record<string, string> = { bodies: "axis", robots: "robot" };

type Told = Schemas["Alarm"];

type Box = [Told, ...Told[]];

/** All that is not reset, one for each event: what stands now first, each newest first. */
export function alarms(): Alarm[] {
  return inOrder(boxes(plant.alarms));
}

/** What is told of one thing, one for each event: what the box of another tells of it, too. */
export function alarmsOf(address: string): Alarm[] {
  return inOrder(boxes(plant.alarms.filter(({ subject }) => subject.split("/")[2] === address)));
}

/** Whether something came back otherwise than it was in the last night. */
export function isSwapped(address: string): boolean {
  return plant.alarms.some(({ cause, subject }) => cause.endsWith(".swapped") && subject.split("/")[2] === address);
}

/** How many events there are; several alarms may tell one. */
export function countOfAlarms(): number {
  return boxes(plant.alarms).length;
}

function boxes(told: Told[]): Box[] {
  const ids = new Set(told.map(({ id }) => id));
  const heads = told.filter(({ part_of }) => !part_of || !ids.has(part_of));
  return heads.map((head) => [head, ...told.filter(({ part_of }) => part_of === head.id)]);
}

function inOrder(found: Box[]): Alarm[] {
  const lasts = (box: Box) => box.some((it) => it.ended_at === null);
  return [...found.filter(lasts), ...found.filter((box) => !lasts(box))].map(shown);
}

/** The worst that is told of something: what stands now before what is over. */
export function worstOf(target: Target): Told | undefined {
  const own = plant.alarms.filter(({ subject }) => subject.split("/")[2] === addressOf(target));
  return own.find((it) => it.ended_at === null) ?? own[0];
}

/** All that are over, to be reset together. */
export function over(): Told[] {
  return plant.alarms.filter(({ ended_at }) => ended_at !== null);
}

/** Reset alarms, oldest first; the first that is refused ends it. */
export function resetting(list: Told[]): Deed {
  return async (gateway) => {
    let done: unknown;
    for (const { id } of list.toReversed()) done = await reset(id)(gateway);
    return done;
  };
}

/** Names, where the gateway tells addresses. */
function withNames(text: string): string {
  const targets = [...plant.bodies, ...plant.robots, ...plant.made].filter(({ name }) => name);
  return targets.reduce((said, target) => said.replaceAll(whole(addressOf(target)), nameOf(target)), text);
}

/** An address that is no part of a longer one. */
function whole(address: string): RegExp {
  return new RegExp(`(?<![\\w./])${address.replaceAll(".", String.raw`\.`)}(?![\\w./]*\\w)`, "g");
}

function wordsOf(alarm: Told, parts: readonly ("happened" | "motor" | "remedy")[]): string {
  const told = alarm[language.now];
  return withNames(parts.map((part) => told[part]).filter(Boolean).join(language.now === "ja" ? "" : " "));
}

function shown([alarm, ...others]: [Told, ...Told[]]): Alarm {
  const [, kind = "", who = ""] = alarm.subject.split("/");
  const page = PAGES[kind] ?? extensions.find(({ collection }) => collection === kind)?.page;
  const target = plant.target(who);
  return {
    key: alarm.id,
    who: target ? nameOf(target) : who,
    link: page ? { page, subject: who } : undefined,
    text: wordsOf(alarm, ["happened", "motor", "remedy"]),
    raised: clockOf(alarm.raised_at),
    ended: alarm.ended_at === null ? undefined : clockOf(alarm.ended_at),
    parts: others.map((it) => ({
      key: it.id,
      text: wordsOf(it, ["happened"]),
      remedies: it.subject === alarm.subject || it.ended_at !== null ? [] : remediesOf(it, !alarm.subject.startsWith("/lines/")),
    })),
    remedies: [
      ...remediesOf(alarm),
      { label: words().events.resetAlarm, deed: resetting([alarm, ...others]), why: () => obstacle("operate") },
    ],
  };
}

/** The calls that help; what answers again needs no stop for its silence, and over a lost line none comes. */
function remediesOf(alarm: Told, reached = true): Remedy[] {
  const stops = reached && alarm.ended_at === null;
  const target = plant.target(alarm.subject.split("/")[2] ?? "");
  const calls = alarm.next.filter(({ method, right }) => method !== "GET" && (right !== "stop" || stops));
  return calls.map((call) => ({
    label: call[language.now].replace(/[.。]$/, ""),
    deed: (gateway: Gateway) => gateway.call(call),
    why: () => obstacleTo(call, target),
  }));
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
