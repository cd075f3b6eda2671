/** What needs somebody: as far as the last readings tell. */

import type { Gateway } from "../../clients/typescript/src/gateway.ts";
import type { Body, Deed, Line, Right, Robot, Schemas, Target } from "./gateway.ts";
import { nameOf } from "./actions.svelte.ts";
import { plant } from "./plant.svelte.ts";
import { language, named, words } from "./words/index.svelte.ts";

type Kept = Schemas["Alarm"];

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
const ERRORS = /_error$/;

/** All that stands now: as the gateway keeps it, or by the last readings. */
export function alarms(): Alarm[] {
  return plant.alarms?.map(ofKept) ?? ofReadings();
}

function ofKept(alarm: Kept): Alarm {
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

function ofReadings(): Alarm[] {
  return [
    ...plant.lines.flatMap(ofLine),
    ...plant.bodies.filter((it) => isReachable(it.line_id)).flatMap(ofBody),
    ...plant.robots.filter((it) => isReachable(it.line_id)).flatMap(ofRobot),
  ];
}

/** What stands on a line that is down is told by the line. */
function isReachable(lineId: string): boolean {
  return !plant.line(lineId)?.down_reason;
}

function ofLine(line: Line): Alarm[] {
  if (!line.down_reason) return [];
  const said = words().alarms;
  const text = (line.state === "silent" ? said.lineSilent : said.lineDown)(line.line_id, line.down_reason);
  return [{ key: `line ${line.line_id}`, who: line.line_id, link: undefined, text, remedies: [] }];
}

function ofBody(body: Body): Alarm[] {
  const { alarms: said, axis, statusBits } = words();
  const { body_id } = body;
  const about = { who: nameOf(body), link: { page: "axis", subject: body_id } };
  const found: Alarm[] = [];
  if (!body.online) found.push({ ...about, key: `${body_id} offline`, text: said.offline, remedies: [] });
  if (body.power_cycled)
    found.push({
      ...about,
      key: `${body_id} power`,
      text: said.powerCycled,
      remedies: [
        {
          label: axis.home,
          right: "operate",
          target: body,
          deed: (gateway) => gateway.startMove(body_id, { kind: "home" }),
        },
        { label: axis.acknowledge, right: "operate", target: body, deed: acknowledgeBody(body_id) },
      ],
    });
  const bits = (body.status ?? []).filter((bit) => ERRORS.test(bit));
  if (bits.length > 0)
    found.push({
      ...about,
      key: `${body_id} ${bits.join(" ")}`,
      text: said.status(bits.map((bit) => named(statusBits, bit)).join(", ")),
      remedies: [{ label: axis.clearStatus, right: "setup", target: body, deed: clearStatus(body_id) }],
    });
  return found;
}

function ofRobot(robot: Robot): Alarm[] {
  const { alarms: said, robot: labels } = words();
  const { robot_id, error } = robot;
  const about = { who: nameOf(robot), link: { page: "robot", subject: robot_id } };
  const found: Alarm[] = [];
  if (!robot.online) found.push({ ...about, key: `${robot_id} offline`, text: said.offline, remedies: [] });
  if (error) {
    const inJapanese = language.now === "ja";
    const told = inJapanese ? [error.ja, error.remedy_ja] : [error.en, error.remedy_en];
    found.push({
      ...about,
      key: `${robot_id} ${error.code} ${error.at}`,
      text: [error.code, ...told, error.detail].filter(Boolean).join(" · "),
      remedies: [{ label: labels.reset, right: "operate", target: robot, deed: resetErrors(robot_id) }],
    });
  }
  if (robot.power_cycled)
    found.push({
      ...about,
      key: `${robot_id} power`,
      text: said.robotPowerCycled,
      remedies: [{ label: labels.acknowledge, right: "operate", target: robot, deed: acknowledgeRobot(robot_id) }],
    });
  for (const text of robot.bit_mismatches)
    found.push({ ...about, key: `${robot_id} ${text}`, text, remedies: [] });
  return found;
}

export function acknowledgeBody(body_id: string): Deed {
  return ({ http }) => http.POST("/bodies/{body_id}/power-cycle/acknowledge", { params: { path: { body_id } } });
}

export function clearStatus(bodyId: string): Deed {
  return (gateway) => gateway.command(bodyId, "clear-controller-status");
}

function acknowledgeRobot(robot_id: string): Deed {
  return ({ http }) => http.POST("/robots/{robot_id}/power-cycle/acknowledge", { params: { path: { robot_id } } });
}

export function resetErrors(robot_id: string): Deed {
  return ({ http }) => http.POST("/robots/{robot_id}/errors/reset", { params: { path: { robot_id } } });
}
