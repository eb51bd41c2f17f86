//! Proposals: poses of a recording in the map at which its density profile runs as one that was driven there.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::config::RecallConfig;
use super::example::Example;
use super::place_index::PlaceIndex;
use crate::geometry::{Pose2, angle_between};
use crate::retrieval::ProfileCandidate;
use crate::text::{Direction, Interval};

/// A supposed place of the recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Proposal {
    /// Component of the map.
    pub component: u32,
    /// Pose of the recording's submap in it.
    pub map_from_submap: Pose2,
    /// What was driven there.
    pub earlier: Interval,
    /// Which way.
    pub direction: Direction,
    /// Best score of a window.
    pub score: f64,
    /// Sum of the scores of all windows that propose this place.
    pub total_score: f64,
    /// How alike the best window is.
    pub resemblance: f64,
}

/// Different places that windows of the recording propose, the best first.
pub(super) fn proposals(index: &PlaceIndex, example: &Example, config: &RecallConfig) -> Vec<Proposal> {
    let step = (config.retrieval.query_step_m / config.retrieval.sample_spacing_m).round().max(1.0) as usize;
    let centers: Vec<usize> = (0..example.profile.len()).step_by(step).collect();
    let by_center: Vec<Vec<ProfileCandidate>> =
        centers.par_iter().map(|&center| index.profiles.candidates_of(&example.profile, center)).collect();
    let mut found: Vec<Proposal> = Vec::new();
    for candidate in by_center.iter().flatten() {
        let Some(proposal) = proposal(index, example, candidate) else { continue };
        match found.iter_mut().find(|known| is_same(known, &proposal, config)) {
            Some(known) => {
                known.total_score += proposal.score;
                if proposal.score > known.score {
                    *known = Proposal { total_score: known.total_score, ..proposal };
                }
            }
            None => found.push(proposal),
        }
    }
    let key = |proposal: &Proposal| (proposal.earlier, proposal.direction);
    found.sort_by(|a, b| b.total_score.total_cmp(&a.total_score).then(key(a).cmp(&key(b))));
    found.truncate(config.max_sketched);
    found
}

fn proposal(index: &PlaceIndex, example: &Example, candidate: &ProfileCandidate) -> Option<Proposal> {
    let middle = |interval: &Interval| ((interval.first + interval.last) / 2) as usize;
    let drive = index.drives.get(candidate.earlier.run_idx as usize)?;
    let map_from_place = drive.map_from_observations.get(middle(&candidate.earlier))?;
    let run_from_place = example.observations.get(middle(&candidate.later))?.run_from_robot;
    let turn = match candidate.direction {
        Direction::Same => 0.0,
        Direction::Opposite => PI,
    };
    // The middles of the two stretches are one place.
    let map_from_run = map_from_place.compose(&Pose2::new(0.0, 0.0, turn)).compose(&run_from_place.inverse());
    Some(Proposal {
        component: drive.component,
        map_from_submap: map_from_run.compose(&example.run_from_submap),
        earlier: candidate.earlier,
        direction: candidate.direction,
        score: candidate.score,
        total_score: candidate.score,
        resemblance: candidate.resemblance,
    })
}

fn is_same(a: &Proposal, b: &Proposal, config: &RecallConfig) -> bool {
    a.component == b.component
        && a.map_from_submap.distance(&b.map_from_submap) < config.same_place_m
        && angle_between(a.map_from_submap.theta, b.map_from_submap.theta) < config.same_place_rad
}
