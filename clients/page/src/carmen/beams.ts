// Where the beams of a FLASER message point, which the message itself does not say; the rules are those of
// `engine/src/formats/flaser_beams.rs`.

import { parseNumber } from "./fields";
import type { Fields } from "./fields";

/** Direction of the first beam and the angle from one to the next, in the laser's frame. */
export interface BeamAngles {
  min_rad: number;
  increment_rad: number;
}

/** Numbers of readings of the common laser of 180 degrees. */
const COMMON_NUM_RANGES = [90, 180, 181, 360, 361];
/** A stated resolution below this is in radians. */
const RADIANS_BELOW = 0.05;
/** How far a stated resolution may be from that of field of view and number of readings. */
const RESOLUTION_TOLERANCE = 0.02;
const HOW_TO_STATE = "state the laser's field of view";

const radians = (degrees: number) => degrees * (Math.PI / 180);
const degrees = (angle_rad: number) => angle_rad * (180 / Math.PI);

/** What PARAM lines say of the front laser. */
export class StatedLaser {
  private fieldOfView_rad: number | undefined;
  private resolution: number | undefined;

  /** Notes the rest of a PARAM line if it is about the front laser's angles. The last line of a kind counts. */
  note(fields: Fields): void {
    const name = fields.nextWord()?.toLowerCase();
    if (name === undefined || !/front_laser_|frontlaser_|laser_laser1_/.test(name)) return;
    const value = parseNumber(fields.nextWord() ?? "");
    if (value === undefined || !(value > 0) || !Number.isFinite(value)) return;
    // More than a full turn can only be degrees.
    if (/(_fov|_field_of_view)$/.test(name)) this.fieldOfView_rad = value <= 2 * Math.PI + 1e-3 ? value : radians(value);
    else if (name.endsWith("_resolution")) this.resolution = value;
  }

  /** The beams of a message of so many readings; `fieldOfView_deg` wins over the log. Throws what is wrong as a text. */
  beams(numRanges: number, fieldOfView_deg: number | undefined): BeamAngles {
    // An even number of readings leaves out the last beam of the field of view, as a SICK does with 180 of 181.
    const numGaps = numRanges - (numRanges % 2);
    if (fieldOfView_deg !== undefined) return beamsOver(radians(fieldOfView_deg), numGaps);
    const isCommon = COMMON_NUM_RANGES.includes(numRanges);
    const { fieldOfView_rad, resolution } = this;
    if (fieldOfView_rad !== undefined && resolution === undefined) return beamsOver(fieldOfView_rad, numGaps);
    if (fieldOfView_rad !== undefined && resolution !== undefined) {
      const best = bestGaps(fieldOfView_rad, resolution, [numGaps, numRanges - 1, numRanges]);
      if (best !== undefined) return beamsOver(fieldOfView_rad, best);
      if (isCommon) return beamsOver(fieldOfView_rad, numGaps);
      const angle = degrees(fieldOfView_rad).toFixed(2);
      throw new Error(`${numRanges} readings over ${angle} degrees do not have the resolution ${resolution} that the log states; ${HOW_TO_STATE}`);
    }
    if (resolution !== undefined && !isCommon) {
      const resolution_rad = resolution < RADIANS_BELOW ? resolution : radians(resolution);
      return beamsOver(resolution_rad * numGaps, numGaps);
    }
    if (isCommon || isThinned(numRanges)) return beamsOver(Math.PI, numGaps);
    throw new Error(`a FLASER message of ${numRanges} readings does not tell which angle they cover; ${HOW_TO_STATE}`);
  }
}

function bestGaps(fieldOfView_rad: number, resolution: number, candidates: number[]): number | undefined {
  const fit = (numGaps: number) => {
    const increment_rad = fieldOfView_rad / numGaps;
    const error = (stated_rad: number) => Math.abs(stated_rad / increment_rad - 1);
    return Math.min(error(resolution), error(radians(resolution)));
  };
  const best = candidates.reduce((a, b) => (fit(b) < fit(a) ? b : a));
  return fit(best) <= RESOLUTION_TOLERANCE ? best : undefined;
}

/** Whether this may be a scan over 180 degrees of which only every so manieth whole degree was kept. */
function isThinned(numRanges: number): boolean {
  return numRanges < 180 && 180 % (numRanges - 1) === 0 && numRanges % 2 === 1;
}

function beamsOver(fieldOfView_rad: number, numGaps: number): BeamAngles {
  if (!(fieldOfView_rad > 0 && fieldOfView_rad <= 2 * Math.PI * 1.001)) {
    throw new Error(`a field of view of ${degrees(fieldOfView_rad).toFixed(2)} degrees; ${HOW_TO_STATE}`);
  }
  return { min_rad: -0.5 * fieldOfView_rad, increment_rad: fieldOfView_rad / numGaps };
}
