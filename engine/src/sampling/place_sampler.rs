//! Places to observe, one every `observation_spacing_m` of travel.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::SamplingConfig;
use crate::geometry::{Pose2, wrap_angle};

/// A place that the robot drove through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Sequence number of the scan taken nearest to it.
    pub scan_seq: u64,
    /// Timestamp of that scan, nanoseconds.
    pub timestamp_ns: i64,
    /// Distance driven up to here, metres.
    pub travel_m: f64,
    /// Raw odometry, interpolated between scans.
    pub odom_from_robot: Pose2,
    /// Pose in the run's frame, interpolated likewise.
    pub run_from_robot: Pose2,
}

/// Turns a stream of scan poses into evenly spaced places, released once they lie the delay behind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaceSampler {
    config: SamplingConfig,
    /// Where the robot last was beyond standing still.
    latest: Option<Place>,
    /// Travel at which it begins, metres.
    begins_at_m: f64,
    next_travel_m: f64,
    waiting: VecDeque<Place>,
}

impl PlaceSampler {
    /// A sampler that has seen nothing. The config must have passed its check.
    pub fn new(config: &SamplingConfig) -> Self {
        Self {
            config: config.clone(),
            latest: None,
            begins_at_m: 0.0,
            next_travel_m: 0.0,
            waiting: VecDeque::new(),
        }
    }

    /// Begins anew wherever the next scan is taken, and forgets what waits; the travel counts on.
    pub fn restart(&mut self) {
        self.begins_at_m = self.latest.take().map_or(self.begins_at_m, |latest| latest.travel_m);
        self.waiting.clear();
    }

    /// Moves on to the pose of the next scan. `here.travel_m` is ignored: travel is counted here.
    ///
    /// Travel is that of the robot, not what odometry says of it. Steps below `standstill_m` are collected until they make one, so that a standing robot's jitter is no travel.
    /// Nothing is observed along a jump; the place behind it is.
    pub fn drive(&mut self, mut here: Place) {
        let Some(latest) = &self.latest else {
            here.travel_m = self.begins_at_m;
            self.next_travel_m = here.travel_m + self.config.observation_spacing_m;
            self.waiting.push_back(here.clone());
            self.latest = Some(here);
            return;
        };
        let step = latest.run_from_robot.distance(&here.run_from_robot);
        if !step.is_finite() || step < self.config.standstill_m {
            return;
        }
        here.travel_m = latest.travel_m + step;
        if step > self.config.jump_m {
            self.waiting.push_back(here.clone());
            self.next_travel_m = here.travel_m + self.config.observation_spacing_m;
        }
        while self.next_travel_m <= here.travel_m {
            self.waiting.push_back(between(latest, &here, self.next_travel_m));
            self.next_travel_m += self.config.observation_spacing_m;
        }
        self.latest = Some(here);
    }

    /// The next place that lies at least the delay behind the robot.
    pub fn next_ready(&mut self) -> Option<Place> {
        let travel_m = self.latest.as_ref()?.travel_m;
        let is_ready =
            self.waiting.front().is_some_and(|place| place.travel_m + self.config.delay_m <= travel_m);
        if is_ready { self.waiting.pop_front() } else { None }
    }

    /// The next place however near; for the end of a run.
    pub fn next_waiting(&mut self) -> Option<Place> {
        self.waiting.pop_front()
    }
}

/// The place after `travel_m`, on the straight line between two scans.
fn between(before: &Place, after: &Place, travel_m: f64) -> Place {
    let share = (travel_m - before.travel_m) / (after.travel_m - before.travel_m);
    let nearest = if share < 0.5 { before } else { after };
    Place {
        scan_seq: nearest.scan_seq,
        timestamp_ns: nearest.timestamp_ns,
        travel_m,
        odom_from_robot: interpolated(&before.odom_from_robot, &after.odom_from_robot, share),
        run_from_robot: interpolated(&before.run_from_robot, &after.run_from_robot, share),
    }
}

fn interpolated(from: &Pose2, to: &Pose2, share: f64) -> Pose2 {
    let turn = wrap_angle(to.theta - from.theta);
    Pose2::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), from.theta + share * turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(scan_seq: u64, x: f64) -> Place {
        let pose = Pose2::new(x, 0.0, 0.0);
        Place {
            scan_seq,
            timestamp_ns: scan_seq as i64,
            travel_m: 0.0,
            odom_from_robot: pose,
            run_from_robot: pose,
        }
    }

    fn xs(sampler: &mut PlaceSampler) -> Vec<f64> {
        std::iter::from_fn(|| sampler.next_ready())
            .map(|place| (place.odom_from_robot.x * 1e6).round() / 1e6)
            .collect()
    }

    #[test]
    fn places_are_evenly_spaced_whatever_the_scans_are() {
        let mut sampler = PlaceSampler::new(&SamplingConfig { delay_m: 0.0, ..SamplingConfig::default() });
        for (seq, x) in [0.0, 0.001, 0.04, 0.25, 0.26, 0.31].into_iter().enumerate() {
            sampler.drive(at(seq as u64, x));
        }
        assert_eq!(xs(&mut sampler), [0.0, 0.1, 0.2, 0.3]);
    }

    #[test]
    fn a_delay_holds_places_back() {
        let mut sampler = PlaceSampler::new(&SamplingConfig { delay_m: 0.5, ..SamplingConfig::default() });
        sampler.drive(at(0, 0.0));
        sampler.drive(at(1, 0.75));
        assert_eq!(xs(&mut sampler), [0.0, 0.1, 0.2]);
        assert!((sampler.next_waiting().map_or(0.0, |place| place.travel_m) - 0.3).abs() < 1e-9);
    }

    #[test]
    fn travel_counts_on_after_a_restart() {
        let mut sampler = PlaceSampler::new(&SamplingConfig { delay_m: 0.0, ..SamplingConfig::default() });
        sampler.drive(at(0, 0.0));
        sampler.drive(at(1, 0.35));
        assert_eq!(xs(&mut sampler).len(), 4);
        sampler.restart();
        sampler.drive(at(2, 70.0));
        sampler.drive(at(3, 70.15));
        let travels = std::iter::from_fn(|| sampler.next_ready()).map(|place| place.travel_m);
        assert!(travels.eq([0.35, 0.35 + 0.1]));
    }

    #[test]
    fn standing_still_is_no_travel_and_a_jump_is_not_observed() {
        let mut sampler = PlaceSampler::new(&SamplingConfig { delay_m: 0.0, ..SamplingConfig::default() });
        for seq in 0..1000 {
            sampler.drive(at(seq, if seq % 2 == 0 { 0.0 } else { 0.015 }));
        }
        sampler.drive(at(1000, 50.0));
        sampler.drive(at(1001, 50.15));
        assert_eq!(xs(&mut sampler), [0.0, 50.0, 50.1]);
    }
}
