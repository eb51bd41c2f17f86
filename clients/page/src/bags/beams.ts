// Laser messages as the readings of one fixed laser.

import type { Schemas } from "../api";
import type { Mounting } from "./frames";
import type { LaserMessage } from "./messages";

/** Beams that are off by less than this are the same. */
const ANGLE_TOLERANCE_RAD = 1e-4;

/**
 * The beams of a run: those of its first message, from right to left as seen from above.
 *
 * A laser that hangs upside down, or turns clockwise, sends them the other way round. Some lasers send a reading more or
 * less from turn to turn; each beam then takes the reading nearest to it.
 */
export class BeamLayout {
  readonly geometry: Schemas["Geometry"];
  private readonly sign: number;
  private readonly rangeMax_m: number;

  constructor(first: LaserMessage, mounting: Mounting) {
    const count = first.ranges_m.length;
    if (count < 2) throw new Error(`a scan of ${count} readings`);
    const increment_rad = first.angleIncrement_rad;
    if (increment_rad === 0 || !Number.isFinite(increment_rad)) throw new Error(`an angle_increment of ${increment_rad}`);
    this.rangeMax_m = first.rangeMax_m;
    if (!(this.rangeMax_m > 0 && this.rangeMax_m < Infinity)) throw new Error(`the scans state a range_max of ${this.rangeMax_m}`);
    this.sign = mounting.isUpsideDown ? -1 : 1;
    const [angle_min_rad, angle_increment_rad] = ordered(first, this.sign);
    this.geometry = { num_ranges: count, angle_min_rad, angle_increment_rad, range_max_m: this.rangeMax_m, robot_from_laser: mounting.robot_from_laser };
  }

  /**
   * The readings of a message at the beams of the run: infinite where they met nothing, 0 where they say nothing
   * (REP 117) or no reading is near.
   */
  ranges_m(message: LaserMessage): Float32Array {
    const { rangeMin_m } = message;
    const cleaned = message.ranges_m.map((range) =>
      Number.isNaN(range) || range < rangeMin_m || range <= 0 ? 0 : range >= this.rangeMax_m ? Infinity : range,
    );
    if (this.sign * message.angleIncrement_rad < 0) cleaned.reverse();
    const [min_rad, increment_rad] = ordered(message, this.sign);
    const { geometry } = this;
    const isSame =
      cleaned.length === geometry.num_ranges &&
      Math.abs(min_rad - geometry.angle_min_rad) < ANGLE_TOLERANCE_RAD &&
      Math.abs(increment_rad - geometry.angle_increment_rad) * cleaned.length <= ANGLE_TOLERANCE_RAD;
    if (isSame) return cleaned;
    return Float32Array.from({ length: geometry.num_ranges }, (_, beam) => {
      const at = (geometry.angle_min_rad + beam * geometry.angle_increment_rad - min_rad) / increment_rad;
      // Half away from zero.
      return cleaned[Math.sign(at) * Math.floor(Math.abs(at) + 0.5)] ?? 0;
    });
  }
}

/** Direction of the rightmost beam and the angle to the next. */
function ordered(message: LaserMessage, sign: number): [number, number] {
  const first_rad = sign * message.angleMin_rad;
  const increment_rad = sign * message.angleIncrement_rad;
  if (increment_rad > 0) return [first_rad, increment_rad];
  return [first_rad + Math.max(0, message.ranges_m.length - 1) * increment_rad, -increment_rad];
}
