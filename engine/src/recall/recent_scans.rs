//! The scans of the last metres of a drive, few enough to be kept by every robot that asks where it is.

use std::collections::VecDeque;

use crate::geometry::angle_between;
use crate::scan::Scan;

/// Scans closer together than this say the same, metres …
const STEP_M: f64 = 0.05;
/// … and radians.
const STEP_RAD: f64 = 0.05;
/// Scans kept however much a robot turns on the spot.
const NUM_SCANS_MAX: usize = 1_000;

/// The last metres of a drive.
#[derive(Clone, Debug)]
pub struct RecentScans {
    length_m: f64,
    /// The last may lie closer to the one before it than a step; all others do not.
    scans: VecDeque<Scan>,
    /// Metres driven from one kept scan to the next.
    travel_m: f64,
}

impl RecentScans {
    /// Will keep the last `length_m` metres of odometry.
    pub fn new(length_m: f64) -> Self {
        Self { length_m, scans: VecDeque::new(), travel_m: 0.0 }
    }

    /// Takes the next scan; it is the last until another comes.
    pub fn push(&mut self, scan: &Scan) {
        let num = self.scans.len();
        if num >= 2 && !is_a_step(&self.scans[num - 2], &self.scans[num - 1]) {
            self.travel_m -= distance_m(&self.scans[num - 2], &self.scans[num - 1]);
            self.scans.pop_back();
        }
        self.travel_m += self.scans.back().map_or(0.0, |last| distance_m(last, scan));
        self.scans.push_back(scan.clone());
        while self.scans.len() > 2 && (self.travel_m > self.length_m || self.scans.len() > NUM_SCANS_MAX) {
            self.travel_m -= distance_m(&self.scans[0], &self.scans[1]);
            self.scans.pop_front();
        }
    }

    /// The scans kept, oldest first.
    pub fn scans(&mut self) -> &[Scan] {
        self.scans.make_contiguous()
    }
}

fn distance_m(a: &Scan, b: &Scan) -> f64 {
    a.odom_from_robot.distance(&b.odom_from_robot)
}

fn is_a_step(a: &Scan, b: &Scan) -> bool {
    distance_m(a, b) >= STEP_M || angle_between(a.odom_from_robot.theta, b.odom_from_robot.theta) >= STEP_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    fn scan(x: f64, theta: f64) -> Scan {
        Scan {
            timestamp_ns: 0,
            odom_from_robot: Pose2::new(x, 0.0, theta),
            angular_velocity_rad_per_s: None,
            ranges_m: vec![1.0],
        }
    }

    #[test]
    fn keeps_steps_and_the_last_scan() {
        let mut recent = RecentScans::new(1.0);
        for idx in 0..=1_001 {
            recent.push(&scan(f64::from(idx) * 0.01, 0.0));
        }
        let kept: Vec<f64> = recent.scans().iter().map(|scan| scan.odom_from_robot.x).collect();
        assert_eq!(kept.last(), Some(&10.01));
        assert!(kept[0] >= 9.0 && kept[0] < 9.1, "a metre and no more: from {}", kept[0]);
        assert!((17..=22).contains(&kept.len()), "{kept:?}");
    }

    #[test]
    fn a_robot_that_turns_for_ever_is_bounded() {
        let mut recent = RecentScans::new(25.0);
        (0..5_000).for_each(|idx| recent.push(&scan(0.0, f64::from(idx) * 0.06)));
        assert_eq!(recent.scans().len(), NUM_SCANS_MAX);
    }
}
