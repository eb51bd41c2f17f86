// Colors by what they mean; all told apart by people who see red and green alike.

/** Runs, in turn. */
export const RUN_COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8c5a2b", "#785ef0", "#a39400"];

/** Density classes, narrow to wide. */
export const CLASS_COLORS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#f4e11e"];

/** Labels of places. */
export const LABEL_COLORS: Record<string, string> = {
  corridor: "#56b4e9",
  corner: "#e69f00",
  bifurcation: "#009e73",
  "dead-end": "#cc79a7",
  hall: "#785ef0",
};

/** States of matches. */
export const STATE_COLORS: Record<string, string> = {
  verified: "#e69f00",
  candidate: "#0072b2",
  rejected: "#c0392b",
};

/** Dashes of the channels through which matches were found, in pixels. */
export const CHANNEL_DASHES: Record<string, number[]> = { spatial: [], words: [7, 4], profile: [2, 4] };

/** Colors of rooms, in turn; light, since they lie under everything. */
export const ROOM_COLORS = ["#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#785ef0", "#a39400", "#d55e00", "#0072b2"];

/** What people drew. */
export const ANNOTATION_COLOR = "#b5179e";

export const CHANGE_COLORS: Record<string, string> = { appeared: "#d55e00", disappeared: "#0072b2" };

/** The color of a class; a partition may have more classes than colors. */
export function classColor(densityClass: number): string {
  return CLASS_COLORS[Math.min(densityClass, CLASS_COLORS.length - 1)] ?? "#888888";
}

/** The color of the run at a position of the map's list. */
export function runColor(idx: number): string {
  return RUN_COLORS[idx % RUN_COLORS.length] ?? "#0072b2";
}
