/** What is made of bodies, and brings pages of its own: each a folder of `extensions`, which nothing else names. */

import type { Component } from "svelte";

import type { AnyMove, Made } from "./gateway.ts";
import type { Language } from "./words/index.svelte.ts";

export interface Extension {
  /** Its page; events of it begin with this word. */
  page: string;
  /** Where the gateway lists them. */
  collection: string;
  name: Record<Language, string>;
  read: () => Promise<Made[]>;
  readMove: (address: string, move_id: string) => Promise<AnyMove | undefined>;
  Page: Component<{ subject: string }>;
  Tile: Component<{ of: Made }>;
  Pendant: Component<{ of: Made }>;
}

/** Those of this console; the first module puts them here, before anything is shown. */
export const extensions: Extension[] = [];

export function extensionOf(page: string): Extension | undefined {
  return extensions.find((it) => it.page === page);
}
