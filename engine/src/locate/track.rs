//! A supposed pose that is followed from keyframe to keyframe, with the evidence for and against it.

use std::collections::VecDeque;

use super::served_map::ServedMap;
use super::sweep::{Agreement, Sweep, climb};
use crate::geometry::Pose2;

/// A moment of the session that is kept for judging.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    /// Distance driven since the session began, metres.
    pub travel_m: f64,
    /// Refined odometry.
    pub run_from_robot: Pose2,
    /// What the laser saw.
    pub sweep: Sweep,
    /// The same as it was sent.
    pub ranges_m: Box<[f32]>,
}

/// How far a keyframe's motion may be off, metres and radians.
const MOTION_DEVIATION: (f64, f64) = (0.08, 0.03);

/// A supposed pose at every moment that is kept.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Pose at the last moment.
    pub map_from_robot: Pose2,
    /// How each moment agrees with the map, oldest first.
    pub agreements: VecDeque<Agreement>,
}

impl Track {
    /// Follows a pose at the last moment back through all moments that are kept.
    pub fn backwards(map: &ServedMap, moments: &VecDeque<Moment>, map_from_robot: &Pose2) -> Self {
        let mut agreements = VecDeque::with_capacity(moments.len());
        let mut pose = *map_from_robot;
        let mut later: Option<&Moment> = None;
        for moment in moments.iter().rev() {
            if let Some(later) = later {
                pose = pose.compose(&later.run_from_robot.between(&moment.run_from_robot));
                pose = climb(map, &moment.sweep.ends, &pose, MOTION_DEVIATION);
            }
            agreements.push_front(moment.sweep.agreement(map, &pose));
            later = Some(moment);
        }
        Self { map_from_robot: *map_from_robot, agreements }
    }

    /// Follows the robot to the next moment.
    pub fn follow(&mut self, map: &ServedMap, previous: &Pose2, moment: &Moment) {
        let predicted = self.map_from_robot.compose(&previous.between(&moment.run_from_robot));
        self.map_from_robot = climb(map, &moment.sweep.ends, &predicted, MOTION_DEVIATION);
        self.agreements.push_back(moment.sweep.agreement(map, &self.map_from_robot));
    }

    /// Forgets the oldest agreements beyond as many as there are moments; the newest moment may have none yet.
    pub fn forget_before(&mut self, num_moments: usize) {
        while self.agreements.len() > num_moments {
            self.agreements.pop_front();
        }
    }

    /// Evidence that the robot is here rather than off the map, natural logarithm.
    pub fn evidence(&self, per_moment: f64, elsewhere: f64) -> f64 {
        self.agreements
            .iter()
            .map(|agreement| per_moment * (agreement.share - elsewhere) * agreement.coverage)
            .sum()
    }
}
