// Odometry between its messages.

import { wrapAngle } from "../carmen/fields";
import type { Pose } from "../geometry";
import type { OdometryMessage } from "./messages";

/** Messages that are farther apart than this say nothing of the time between them. */
const GAP_MAX_NS = 1_000_000_000n;

/** Where the odometry says the robot was, at any moment. */
export class OdometryTrack {
  private readonly poses: { timestamp_ns: bigint; pose: Pose }[] = [];

  /** Takes messages in the order of the bag; what is not later than the last, or not finite, is passed over. */
  constructor(messages: OdometryMessage[]) {
    for (const { timestamp_ns, odom_from_robot: pose } of messages) {
      const last = this.poses.at(-1);
      const isFinite = Number.isFinite(pose.x) && Number.isFinite(pose.y) && Number.isFinite(pose.theta);
      if (isFinite && (!last || timestamp_ns > last.timestamp_ns)) this.poses.push({ timestamp_ns, pose });
    }
  }

  /**
   * Between two messages in proportion; just before the first or after the last, that message. Undefined where no messages
   * are near.
   */
  at(timestamp_ns: bigint): Pose | undefined {
    const after = this.firstFrom(timestamp_ns);
    const [a, b] = [this.poses[after - 1], this.poses[after]];
    if (!a || !b) {
      const end = a ?? b;
      if (!end) return undefined;
      const gap_ns = end.timestamp_ns - timestamp_ns;
      return gap_ns <= GAP_MAX_NS && -gap_ns <= GAP_MAX_NS ? end.pose : undefined;
    }
    if (b.timestamp_ns - a.timestamp_ns > GAP_MAX_NS) return undefined;
    const share = Number(timestamp_ns - a.timestamp_ns) / Number(b.timestamp_ns - a.timestamp_ns);
    const theta = wrapAngle(a.pose.theta + share * wrapAngle(b.pose.theta - a.pose.theta));
    return { x: a.pose.x + share * (b.pose.x - a.pose.x), y: a.pose.y + share * (b.pose.y - a.pose.y), theta };
  }

  /** Place of the first pose that is not before a time. */
  private firstFrom(timestamp_ns: bigint): number {
    let [low, high] = [0, this.poses.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.poses[middle]!.timestamp_ns < timestamp_ns) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
