// Words of one line, with errors that say where; the rules are those of `engine/src/formats/fields.rs`.

import type { Pose } from "../geometry";

/** A text that does not follow its format. */
export class FormatError extends Error {
  constructor(
    readonly line: number,
    problem: string,
  ) {
    super(`line ${line}: ${problem}`);
    this.name = "FormatError";
  }
}

const DECIMAL = /^[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$/;
const NOT_FINITE = /^[+-]?(?:inf|infinity|nan)$/i;

/** A number as Rust reads it; undefined where it would not. */
export function parseNumber(word: string): number | undefined {
  if (DECIMAL.test(word)) return Number(word);
  if (!NOT_FINITE.test(word)) return undefined;
  if (/nan/i.test(word)) return NaN;
  return word.startsWith("-") ? -Infinity : Infinity;
}

/** An angle between −π and π. */
export function wrapAngle(angle: number): number {
  if (angle > -Math.PI && angle <= Math.PI) return angle;
  const turn = 2 * Math.PI;
  const rest = angle % turn;
  const wrapped = rest < 0 ? rest + turn : rest;
  return wrapped > Math.PI ? wrapped - turn : wrapped;
}

/** The words of a line, taken from the left. */
export class Fields {
  private readonly words: string[];
  private next = 0;

  constructor(
    text: string,
    readonly line: number,
  ) {
    this.words = text.split(/[ \t\n\f\r]+/).filter(Boolean);
  }

  error(problem: string): FormatError {
    return new FormatError(this.line, problem);
  }

  nextWord(): string | undefined {
    return this.words[this.next++];
  }

  word(name: string): string {
    const word = this.nextWord();
    if (word === undefined) throw this.error(`the line ends before ${name}`);
    return word;
  }

  number(name: string): number {
    const word = this.word(`the ${name}`);
    const number = parseNumber(word);
    if (number === undefined || !Number.isFinite(number)) throw this.error(`${name} is '${word}', not a finite number`);
    return number;
  }

  count(name: string): number {
    const word = this.word(`the ${name}`);
    if (!/^\+?\d+$/.test(word)) throw this.error(`${name} is '${word}', not a count`);
    return Number(word);
  }

  pose(name: string): Pose {
    return { x: this.number(name), y: this.number(name), theta: wrapAngle(this.number(name)) };
  }
}

/** Seconds in decimal text to whole nanoseconds, exactly; undefined where the text is no such number. */
export function parseSecondsNs(text: string): bigint | undefined {
  const parts = /^([+-]?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d+))?$/.exec(text);
  const [, sign = "", whole = "", fraction = "", exponent = "0"] = parts ?? [];
  if (!parts || whole.length + fraction.length === 0) return undefined;
  const power = Number(exponent);
  if (Math.abs(power) > 2 ** 31 - 1) return undefined;
  const digits = whole + fraction;
  const kept = whole.length + power + 9;
  if (kept < 0 || /^0*$/.test(digits.slice(0, Math.max(kept, 0)))) {
    const isUp = kept >= 0 && kept < digits.length && digits[kept]! >= "5";
    return isUp ? (sign === "-" ? -1n : 1n) : 0n;
  }
  if (kept > digits.length + 20) return undefined;
  const magnitude = BigInt(digits.slice(0, kept).padEnd(kept, "0")) + (kept < digits.length && digits[kept]! >= "5" ? 1n : 0n);
  const value = sign === "-" ? -magnitude : magnitude;
  return value >= -(2n ** 63n) && value < 2n ** 63n ? value : undefined;
}
