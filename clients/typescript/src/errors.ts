/** What can go wrong, in one sentence each: what happened, what the motor did, and what to do next. */

import type { Move, Problem, RobotMove } from "./types.ts";

const PREFIX = "urn:motion-gateway:problem:";

type Told = Partial<Pick<Problem, "type" | "moved" | "remedy" | "retryable" | "request_id">>;

/** A request was not carried out, or its outcome is not known. */
export class GatewayError extends Error {
  /** The kind of error as a URN; never changes. */
  readonly type: string;
  readonly detail: string;
  /** Whether the motor did anything because of the request. */
  readonly moved: Problem["moved"];
  /** What to do next; may be empty. */
  readonly remedy: string;
  /** Whether the same request may succeed later. */
  readonly retryable: boolean;
  /** What the gateway's trace has it under. */
  readonly requestId: string | null;

  constructor(detail: string, told: Told = {}, options?: ErrorOptions) {
    super(`${detail} ${told.remedy ?? ""}`.trim(), options);
    this.name = new.target.name;
    this.type = told.type ?? `${PREFIX}gateway-error`;
    this.detail = detail;
    this.moved = told.moved ?? "unknown";
    this.remedy = told.remedy ?? "";
    this.retryable = told.retryable ?? false;
    this.requestId = told.request_id ?? null;
  }

  /** The last word of `type`, such as `body-busy`. */
  get kind(): string {
    return this.type.replace(PREFIX, "");
  }
}

/** The gateway has answered with a problem (RFC 9457). */
export class Refused extends GatewayError {
  readonly status: number;
  /** All that was answered. */
  readonly problem: Partial<Problem>;

  constructor(status: number, problem: Partial<Problem>) {
    super(problem.detail ?? `The answer has status ${status}.`, problem);
    this.status = status;
    this.problem = problem;
  }
}

/** The gateway could not be reached, or the connection broke before it had answered. */
export class NoAnswer extends GatewayError {
  constructor(method: string, cause: unknown) {
    const told = { type: `${PREFIX}no-answer` };
    if (method === "GET" || codeOf(cause) === "ECONNREFUSED") {
      super("The gateway does not answer.", { ...told, moved: "no", retryable: true }, { cause });
    } else {
      const remedy = "Look at what the request did before you repeat it.";
      super("The connection broke before the gateway had answered.", { ...told, remedy }, { cause });
    }
  }
}

/** A move that was waited for has ended, and not as it should. */
export class MoveNotSucceeded extends GatewayError {
  readonly move: Move | RobotMove;

  constructor(move: Move | RobotMove) {
    const { error, request_id } = move;
    const ended = `The move ${move.id} of ${move.body_id} has ended: ${move.status}.`;
    const type = error ? PREFIX + error.type : `${PREFIX}move-not-succeeded`;
    super(`${ended} ${error?.detail ?? ""}`.trim(), { ...error, type, request_id });
    this.move = move;
  }
}

/** A move that was waited for is still under way; nothing was done about it. */
export class MoveNotOver extends GatewayError {
  constructor(move: Move | RobotMove, seconds: number) {
    super(`The move ${move.id} of ${move.body_id} is not over in ${seconds} s.`, {
      type: `${PREFIX}move-not-over`,
    });
  }
}

function codeOf(error: unknown): unknown {
  const cause = error instanceof Error ? (error.cause ?? error) : error;
  return typeof cause === "object" && cause !== null && "code" in cause ? cause.code : undefined;
}
