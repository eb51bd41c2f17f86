// What speaks for a match and against it, in words.

import type { Schemas } from "../api";
import { degrees, metres, percent } from "../ui";

const FOUND: Record<string, string> = {
  spatial: "It was found because both stretches lie near one another in the map made so far.",
  words: "It was found because both stretches read alike.",
  profile: "It was found because the densities along both stretches run alike.",
};

const REASONS: Record<string, string> = {
  weak_text: "It was refused because the words are too common here to prove anything.",
  shape: "It was refused because the two drives do not have the same shape.",
  density: "It was refused because the densities along both stretches differ.",
  registration: "It was refused because the scans of both stretches do not lie over one another.",
  ambiguous: "It was refused because another place fits about as well.",
  inconsistent: "It was refused because it contradicts the other matches.",
  vetoed: "It was refused because a person vetoed it.",
};

/** Sentences, the most telling first. */
export function evidenceText(match: Schemas["Match"]): string[] {
  const { evidence } = match;
  const sentences = [FOUND[match.channel] ?? ""];
  if (match.reason) sentences.unshift(REASONS[match.reason] ?? "");
  const fit = evidence.registration;
  if (fit) {
    const sd_m = Math.sqrt(Math.max(fit.covariance[0]?.[0] ?? 0, fit.covariance[1]?.[1] ?? 0));
    const sd_rad = Math.sqrt(fit.covariance[2]?.[2] ?? 0);
    sentences.push(
      `Laid over one another, ${percent(fit.agreement)} of what both saw agrees. The offset is known to ± ${metres(sd_m)} and ± ${degrees(sd_rad)}.`,
    );
  } else {
    sentences.push("The scans were not laid over one another, so there is no relative pose.");
  }
  sentences.push(...textSentences(evidence));
  if (typeof evidence.shape_residual_m === "number") sentences.push(`The shapes of both drives differ by ${metres(evidence.shape_residual_m)}.`);
  if (typeof evidence.density_correlation === "number") sentences.push(`Their densities correlate by ${evidence.density_correlation.toFixed(2)}.`);
  if (typeof evidence.ambiguity === "number") sentences.push(`The next best place has ${percent(evidence.ambiguity)} of this evidence.`);
  return sentences.filter(Boolean);
}

function textSentences(evidence: Schemas["Evidence"]): string[] {
  const { bits, expected_chance_matches: chance } = evidence;
  if (typeof bits !== "number") return ["No chain of words runs through both stretches."];
  const verdict =
    typeof chance !== "number" || chance > 1
      ? `chance alone would bring ${typeof chance === "number" ? rounded(chance) : "countless"} of them in this site, so the words alone prove nothing`
      : `chance alone would bring ${rounded(chance)} of them in this site, so the words alone speak for it`;
  return [`The best chain of words is worth ${bits.toFixed(1)} bits; ${verdict}.`];
}

function rounded(value: number): string {
  if (value >= 10) return Math.round(value).toLocaleString("en");
  return value >= 0.01 ? value.toPrecision(2) : value.toExponential(0);
}
