// Patterns of words as they stand in an address and in a question.

import type { Schemas } from "../api";

/** A word that is looked for; what is left out may be anything. */
export interface Pattern {
  class?: number;
  /** Observations. */
  size?: number;
  turn_deg?: number;
}

/** `4:80:0,3:33` reads: class 4 over 80 observations without a turn, then class 3 over 33. */
export function patternsText(patterns: readonly Pattern[]): string {
  return patterns.map(({ class: d, size, turn_deg }) => [d, size, turn_deg].map((part) => part ?? "").join(":").replace(/:+$/, "") || "*").join();
}

export function patternsOf(text: string | null): Pattern[] {
  if (!text) return [];
  return text.split(",").map((part) => {
    const [d, size, turn] = part.split(":").map((value) => (value && value !== "*" && Number.isFinite(Number(value)) ? Number(value) : undefined));
    return { ...(d !== undefined && { class: d }), ...(size !== undefined && { size }), ...(turn !== undefined && { turn_deg: turn }) };
  });
}

/** Words of a text as patterns. */
export function wordsText(words: readonly Schemas["Word"][]): string {
  return patternsText(words.map((word) => ({ class: word.class, size: word.size, turn_deg: Math.round((180 / Math.PI) * word.turn_rad) })));
}

/** A pattern as the API takes it. */
export function wirePattern({ class: d, size, turn_deg }: Pattern): Schemas["WordPattern"] {
  return {
    ...(d !== undefined && { class: d }),
    ...(size !== undefined && { size }),
    ...(turn_deg !== undefined && { turn_rad: (Math.PI / 180) * turn_deg }),
  };
}
