/** A typed client for the motion gateway. */

export * from "./errors.ts";
export * from "./gateway.ts";
export * from "./types.ts";
export type { components, operations, paths } from "./generated/schema.ts";
