//! Odometry between its messages.

use locution_engine::geometry::{Pose2, wrap_angle};

use super::messages::OdometryMessage;

/// Messages that are farther apart than this say nothing of the time between them.
const GAP_MAX_NS: i64 = 1_000_000_000;

/// Where the odometry says the robot was, at any moment.
pub struct OdometryTrack {
    poses: Vec<(i64, Pose2)>,
}

impl OdometryTrack {
    /// The track of messages in the order of the bag; what is not later than the last, or not finite, is passed over.
    pub fn new(messages: &[OdometryMessage]) -> Self {
        let mut poses: Vec<(i64, Pose2)> = Vec::with_capacity(messages.len());
        for message in messages {
            let [x, y, theta] = message.odom_from_robot;
            let is_later = poses.last().is_none_or(|(last_ns, _)| message.timestamp_ns > *last_ns);
            if is_later && [x, y, theta].iter().all(|number| number.is_finite()) {
                poses.push((message.timestamp_ns, Pose2::new(x, y, theta)));
            }
        }
        Self { poses }
    }

    /// Between two messages in proportion; just before the first or after the last, that message. `None` where no
    /// messages are near.
    pub fn at(&self, timestamp_ns: i64) -> Option<Pose2> {
        let after = self.poses.partition_point(|(time_ns, _)| *time_ns < timestamp_ns);
        if after == 0 || after == self.poses.len() {
            let (end_ns, pose) = self.poses.get(after.min(self.poses.len().checked_sub(1)?))?;
            return (end_ns.abs_diff(timestamp_ns) <= GAP_MAX_NS.unsigned_abs()).then_some(*pose);
        }
        let ((before_ns, a), (after_ns, b)) = (self.poses[after - 1], self.poses[after]);
        if after_ns.saturating_sub(before_ns) > GAP_MAX_NS {
            return None;
        }
        let share = (timestamp_ns - before_ns) as f64 / (after_ns - before_ns) as f64;
        let theta = wrap_angle(a.theta + share * wrap_angle(b.theta - a.theta));
        Some(Pose2::new(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), theta))
    }
}
