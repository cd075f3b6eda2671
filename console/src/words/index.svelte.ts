/** The words of the pages, in the language that somebody has chosen, or their browser asks for. */

import { en } from "./en.ts";
import { ja } from "./ja.ts";

const KEPT = "motion-gateway.language";
const ALL = { en, ja };

export type Language = keyof typeof ALL;
export type Words = typeof en;

class Speaking {
  now = $state<Language>(first());

  choose(language: Language): void {
    this.now = language;
    localStorage.setItem(KEPT, language);
  }
}

function first(): Language {
  const wanted = localStorage.getItem(KEPT) ?? navigator.language;
  return wanted.startsWith("ja") ? "ja" : "en";
}

export const language = new Speaking();

export function words(): Words {
  return ALL[language.now];
}

/** The languages that are not spoken now, and what they call themselves. */
export function others(): [Language, string][] {
  return (Object.keys(ALL) as Language[]).filter((it) => it !== language.now).map((it) => [it, ALL[it].language]);
}

/** The name of something in words of ours, or as it is where it is new. */
export function named(names: Record<string, string>, name: string): string {
  return names[name] ?? name;
}

/** Sentences of the gateway in Japanese, by the English ones, from when it has told them. */
let sentences = $state.raw<Record<string, string>>({});

/** Those that name something: what stands for each brace, and the Japanese. */
let patterns: { form: RegExp; names: string[]; japanese: string }[] = [];

export function learn(japanese: Record<string, string>): void {
  const named = Object.entries(japanese).filter(([english]) => english.includes("{"));
  patterns = named.map(([english, japanese]) => {
    const parts = english.split(/\{(\w+)\}/);
    const form = parts.map((part, index) => (index % 2 ? "(.*?)" : part.replaceAll(/[.*+?^$()|[\]\\]/g, String.raw`\$&`)));
    return { form: new RegExp(`^${form.join("")}$`), names: parts.filter((_, index) => index % 2), japanese };
  });
  sentences = japanese;
}

/** A sentence or a word of the gateway in the language of the page, where that has it; of several each. */
export function translated(sentence: string): string {
  if (language.now !== "ja") return sentence;
  const whole = Object.hasOwn(sentences, sentence) ? sentences[sentence] : byPattern(sentence);
  if (whole !== undefined) return whole;
  const each = sentence.split(/(?<=\.) /);
  return each.length > 1 ? each.map(translated).join("") : sentence;
}

function byPattern(sentence: string): string | undefined {
  for (const { form, names, japanese } of patterns) {
    const found = form.exec(sentence);
    if (found) return names.reduce((told, name, index) => told.replaceAll(`{${name}}`, translated(found[index + 1] ?? "")), japanese);
  }
  return undefined;
}
