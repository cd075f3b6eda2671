/** The names of what the gateway takes and gives. */

import type { components } from "./generated/schema.ts";

export type Schemas = components["schemas"];

export type BodyJog = Schemas["BodyJog"];
export type BodyJogRequest = Schemas["BodyJogRequest"];
export type Event = Schemas["EventList"]["events"][number];
export type JogRequest = Schemas["JogRequest"];
export type JogSession = Schemas["JogSession"];
export type Move = Schemas["Move"];
export type MoveRequest =
  | Schemas["RelativeMoveRequest"]
  | Schemas["AbsoluteMoveRequest"]
  | Schemas["HomeRequest"]
  | Schemas["PositionMoveRequest"]
  | Schemas["ContinuousMoveRequest"];
export type PlannedMove = Schemas["PlannedMove"];
export type Problem = Schemas["Problem"];
export type RobotMove = Schemas["RobotMove"];
export type RobotMoveRequest =
  | Schemas["RobotAbsoluteMoveRequest"]
  | Schemas["RobotRelativeMoveRequest"]
  | Schemas["RobotPositionMoveRequest"]
  | Schemas["RobotHomeRequest"]
  | Schemas["RobotStepRequest"];
export type StopMode = NonNullable<Schemas["StopRequest"]["mode"]>;
export type StopResult = Schemas["StopResult"];
export type Taken = Schemas["Taken"];
