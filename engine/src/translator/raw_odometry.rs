//! Odometry as sent, cut where no robot can have moved so.

use serde::{Deserialize, Serialize};

use super::{ScanPose, TranslatorConfig};
use crate::geometry::Pose2;
use crate::registration::{CutReason, MotionLimits, ScanClock};
use crate::sampling::{KeyframeSampler, SamplingConfig};
use crate::scan::Scan;

/// Odometry that is believed as long as it can be.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct RawOdometry {
    sampling: SamplingConfig,
    limits: MotionLimits,
    keyframes: KeyframeSampler,
    clock: ScanClock,
    /// Time and pose of the scan before.
    latest: Option<(i64, Pose2)>,
}

impl RawOdometry {
    pub fn new(config: &TranslatorConfig) -> Self {
        Self {
            sampling: config.sampling.clone(),
            limits: config.refiner.motion.clone(),
            keyframes: KeyframeSampler::new(&config.sampling),
            clock: ScanClock::default(),
            latest: None,
        }
    }

    /// Moves on to the next scan.
    pub fn pose(&mut self, scan: &Scan) -> ScanPose {
        let here = scan.odom_from_robot;
        let before = self.latest.replace((scan.timestamp_ns, here));
        let is_possible = before.is_none_or(|(before_ns, before)| {
            let gap_s = self.clock.gap_s(scan.timestamp_ns, before_ns);
            self.limits.is_possible(&before.between(&here), gap_s, self.clock.usual_s())
        });
        if !is_possible {
            self.keyframes = KeyframeSampler::new(&self.sampling);
        }
        ScanPose {
            run_from_robot: here,
            keyframe_covariance: self.keyframes.drive(&here),
            cut: (!is_possible).then_some(CutReason::Jump),
            is_doubtful: false,
        }
    }
}
