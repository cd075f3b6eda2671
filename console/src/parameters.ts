/** The parameters of a command, as fields to be filled in. */

import { translated } from "./words/index.svelte.ts";

export interface Field {
  name: string;
  description: string;
  required: boolean;
  /** A number, a text, or whatever is written as JSON. */
  kind: "number" | "text" | "json";
  choices: readonly string[] | undefined;
  least: number | undefined;
  most: number | undefined;
}

/** A JSON Schema, as far as the tables of commands use it. */
interface Schema {
  type?: string;
  description?: string;
  enum?: readonly unknown[];
  minimum?: number;
  exclusiveMinimum?: number;
  maximum?: number;
  exclusiveMaximum?: number;
  anyOf?: readonly Schema[];
  properties?: Record<string, Schema>;
  required?: readonly string[];
}

/** What a command takes. */
export function fieldsOf(parameters: Schema): Field[] {
  return Object.entries(parameters.properties ?? {}).map(([name, schema]) => {
    const one = alone(schema);
    return {
      name,
      description: told(schema.description ?? ""),
      required: parameters.required?.includes(name) ?? false,
      kind: one.type === "integer" || one.type === "number" ? "number" : one.type === "string" ? "text" : "json",
      choices: one.type === "boolean" ? ["true", "false"] : one.enum?.map(String),
      least: one.minimum ?? after(one.exclusiveMinimum, 1),
      most: one.maximum ?? after(one.exclusiveMaximum, -1),
    };
  });
}

/** In the language of the page, where that has it. */
function told(description: string): string {
  return translated(description).replaceAll("`", "");
}

/** What is sent for what somebody has typed; nothing for nothing. What is no JSON is a text: the gateway says what it takes. */
export function valueOf({ kind }: Field, text: string): unknown {
  if (text === "") return undefined;
  if (kind === "text") return text;
  try {
    return JSON.parse(text) as unknown;
  } catch {
    return text;
  }
}

/** What may also be left out is shown as what it is otherwise. */
function alone(schema: Schema): Schema {
  const others = schema.anyOf?.filter(({ type }) => type !== "null");
  return others?.length === 1 && others[0] ? others[0] : schema;
}

function after(bound: number | undefined, step: number): number | undefined {
  return bound === undefined ? undefined : bound + step;
}
