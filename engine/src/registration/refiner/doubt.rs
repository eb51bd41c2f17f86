//! Whether a scan leaves the robot's place in doubt.

use super::super::lost::{CutReason, Doubt, seen_through};
use super::{Expectation, OdometryRefiner, Settled};
use crate::scan::{Scan, ScanGeometry};

/// Odometry that says less from one scan to the next says that the robot stands, metres…
const STILL_M: f64 = 0.01;
/// … and radians.
const STILL_RAD: f64 = 0.01;
/// Scans from which on the surroundings are known well enough for a scan not to fit.
const NUM_SCANS_KNOWN: usize = 5;

impl OdometryRefiner {
    /// The doubt that a scan leaves about where the robot is, if it does.
    pub(super) fn doubt(
        &mut self,
        geometry: &ScanGeometry,
        scan: &Scan,
        num_points: usize,
        settled: &Settled,
        expected: &Expectation,
    ) -> Option<Doubt> {
        let config = &self.state.config;
        let before = self.state.doubt;
        if num_points < config.min_points_of(geometry) {
            self.state.num_blind += 1;
            // A robot that sees nothing goes by its odometry as long as there is one.
            let untold = (!expected.is_told).then_some(Doubt {
                reason: CutReason::NoReturns,
                is_elsewhere: false,
                num_scans: 0,
            });
            return before.or(untold);
        }
        let was_blind = std::mem::take(&mut self.state.num_blind) > 0;
        let num_scans = before.map_or(1, |doubt| doubt.num_scans + 1);
        let is_still =
            expected.step.x.hypot(expected.step.y) < STILL_M && expected.step.theta.abs() < STILL_RAD;
        // Wheels that turn are on the floor: what they say is doubted only where something else is strange.
        let suspicion = match before {
            Some(doubt) => Some(doubt.reason),
            None if expected.is_gap => Some(CutReason::Gap),
            None if expected.odometry.is_none() => Some(CutReason::Jump),
            None if was_blind => Some(CutReason::NoReturns),
            None if is_still && expected.is_by_odometry => Some(CutReason::Carried),
            None => None,
        };
        let is_known = self.state.recent.len() >= NUM_SCANS_KNOWN;
        let unfollowed = !expected.is_told && !settled.is_registered && is_known;
        let reason = suspicion.or(unfollowed.then_some(CutReason::Unfollowed))?;
        // A robot that stands sees people come and go; after all else a scan that is to be believed fits well.
        let is_standing = reason == CutReason::Carried;
        let sure_share = if is_standing { config.sure_inlier_share } else { config.good_inlier_share };
        if settled.inlier_share >= sure_share {
            return None;
        }
        // A robot that turned too fast sees much that is new; one that is elsewhere at once, or that nothing but its scans has
        // followed through a gap, sees nothing that can be believed.
        let is_elsewhere = before.is_some_and(|doubt| doubt.is_elsewhere)
            || (reason == CutReason::Jump && expected.is_far)
            || (reason == CutReason::Gap && !expected.is_by_odometry)
            || reason == CutReason::Unfollowed;
        // What fits a little and takes nothing away may be true, as may what a robot can have driven.
        let may_be = !is_elsewhere && (expected.is_by_odometry || settled.is_registered);
        let pose = &settled.start_from_robot;
        let is_lost = !may_be
            || seen_through(geometry, &scan.ranges_m, pose, self.state.recent.iter())
                > config.max_seen_through;
        is_lost.then_some(Doubt { reason, is_elsewhere, num_scans })
    }
}
