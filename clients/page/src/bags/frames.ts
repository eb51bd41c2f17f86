// Frames that do not move against each other: where the laser sits on the robot.

import type { Pose } from "../geometry";

/** A laser that is tilted by more than this does not scan level. */
const TILT_MAX_RAD = (15 * Math.PI) / 180;

type Vector = [number, number, number];
/** A rotation in space, by the rows of its matrix. */
export type Rotation = [Vector, Vector, Vector];

/** The rotation of a quaternion. */
export function rotationOf(qx: number, qy: number, qz: number, qw: number): Rotation {
  const length = Math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
  if (!(length > 1e-6 && length < Infinity)) throw new Error("a rotation whose quaternion has no length");
  const [x, y, z, w] = [qx / length, qy / length, qz / length, qw / length];
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** The direction on the floor into which the x axis is turned. */
export function yawOf(rotation: Rotation): number {
  return Math.atan2(rotation[1][0], rotation[0][0]);
}

function apply(rotation: Rotation, [x, y, z]: Vector): Vector {
  return rotation.map((row) => row[0] * x + row[1] * y + row[2] * z) as Vector;
}

function transposed(rotation: Rotation): Rotation {
  return [0, 1, 2].map((column) => rotation.map((row) => row[column as 0 | 1 | 2])) as Rotation;
}

/** What a `geometry_msgs/TransformStamped` says: parent from child, in metres. */
export interface StampedTransform {
  timestamp_ns: bigint;
  parent: string;
  child: string;
  translation_m: Vector;
  rotation: Rotation;
}

/** Target from source. */
interface Transform {
  translation_m: Vector;
  rotation: Rotation;
}

const UNMOVED: Transform = { translation_m: [0, 0, 0], rotation: rotationOf(0, 0, 0, 1) };

function compose(a: Transform, b: Transform): Transform {
  const [x, y, z] = apply(a.rotation, b.translation_m);
  const rotation = transposed(transposed(b.rotation).map((column) => apply(a.rotation, column)) as Rotation);
  return { translation_m: [a.translation_m[0] + x, a.translation_m[1] + y, a.translation_m[2] + z], rotation };
}

function inverse({ rotation, translation_m }: Transform): Transform {
  const back = transposed(rotation);
  return { rotation: back, translation_m: apply(back, translation_m).map((part) => -part) as Vector };
}

/** The tree of frames; the first that is said of a frame stays. */
export class Frames {
  private readonly parents = new Map<string, { parent: string; transform: Transform }>();

  add({ parent, child, translation_m, rotation }: StampedTransform): void {
    if (!this.parents.has(child)) this.parents.set(child, { parent, transform: { translation_m, rotation } });
  }

  /** Every frame above, with ancestor from frame, the nearest first. */
  private ancestors(frame: string): Map<string, Transform> {
    const found = new Map([[frame, UNMOVED]]);
    let fromFrame = UNMOVED;
    for (let said = this.parents.get(frame); said && !found.has(said.parent); said = this.parents.get(said.parent)) {
      fromFrame = compose(said.transform, fromFrame);
      found.set(said.parent, fromFrame);
    }
    return found;
  }

  /** Target from source, when both hang on one tree. */
  between(target: string, source: string): Transform | undefined {
    const aboveTarget = this.ancestors(target);
    for (const [frame, fromSource] of this.ancestors(source)) {
      const fromTarget = aboveTarget.get(frame);
      if (fromTarget) return compose(inverse(fromTarget), fromSource);
    }
    return undefined;
  }
}

/** How a laser sits on its robot. */
export interface Mounting {
  robot_from_laser: Pose;
  /** Whether its beams turn the other way round, seen from above. */
  isUpsideDown: boolean;
}

/** The mounting that a transform says. */
export function mountingOf({ rotation, translation_m }: Transform): Mounting {
  const up = rotation[2][2];
  const tilt_rad = Math.acos(Math.min(Math.abs(up), 1));
  if (tilt_rad > TILT_MAX_RAD) {
    throw new Error(`the laser is tilted by ${((180 / Math.PI) * tilt_rad).toFixed(0)} degrees; only level lasers can be mapped`);
  }
  // The x axis keeps its direction on the floor when the laser is turned over about it.
  return { robot_from_laser: { x: translation_m[0], y: translation_m[1], theta: yawOf(rotation) }, isUpsideDown: up < 0 };
}
