//! Joining runs that never met: consistent sets of registrations, extended along both drives, or nothing.
//!
//! One registration proves little: corridors look alike. But a wrong alignment that fits here contradicts itself some
//! metres on, where the one corridor turns and the other does not. So a hypothesis is extended to all places where it
//! lays the two runs over each other, and must hold nearly everywhere, over a long enough drive, in every direction,
//! and clearly better than any other.

use std::collections::BTreeSet;

use nalgebra::Matrix2;

use super::anchors::AnchorSet;
use super::candidates::Candidate;
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::memo::{RegistrationMemo, Request};
use crate::geometry::Pose2;
use crate::registration::SearchWindow;

/// A way to lay one component over another.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    /// Component that stays.
    pub host: u32,
    /// Component that moves.
    pub guest: u32,
    /// Frame of the host from frame of the guest.
    pub host_from_guest: Pose2,
    /// The registrations that say so.
    pub closures: Vec<Closure>,
    /// Number of different anchors of the guest among them.
    pub num_anchors: usize,
}

/// Registers the candidates between different components.
pub(crate) fn registered_candidates(
    candidates: &[Candidate],
    set: &AnchorSet,
    config: &MappingConfig,
    memo: &mut RegistrationMemo,
) -> Vec<Option<Closure>> {
    let requests: Vec<Request> = candidates
        .iter()
        .map(|candidate| Request {
            earlier: candidate.earlier,
            later: candidate.later,
            window: SearchWindow { centre: candidate.predicted, half_m: 2.0, half_turn_rad: 0.35 },
        })
        .collect();
    let fits = memo.answers(&requests, set, &config.submap);
    requests
        .iter()
        .zip(fits)
        .map(|(request, fit)| {
            fit.filter(|fit| fit.agreement >= config.min_agreement && fit.overlap >= config.min_overlap)
                .map(|fit| Closure { earlier: request.earlier, later: request.later, fit })
        })
        .collect()
}

/// The best hypotheses between every two components, most anchors first. A hypothesis that has a rival of nearly as
/// many anchors is left out.
pub(crate) fn hypotheses(
    closures: &[Closure],
    set: &AnchorSet,
    graph: &CoarseGraph,
    components: &[u32],
    config: &MappingConfig,
) -> Vec<Hypothesis> {
    let component = |anchor: usize| components[set.anchors[anchor].run_idx as usize];
    let mut pairs: BTreeSet<(u32, u32)> = BTreeSet::new();
    for closure in closures {
        let (a, b) = (component(closure.earlier), component(closure.later));
        if a != b {
            pairs.insert((a.min(b), a.max(b)));
        }
    }
    let mut found = Vec::new();
    for (host, guest) in pairs {
        let between: Vec<Closure> = closures
            .iter()
            .filter(|closure| {
                let (a, b) = (component(closure.earlier), component(closure.later));
                (a, b) == (host, guest) || (b, a) == (host, guest)
            })
            .copied()
            .collect();
        let oriented: Vec<Vote> =
            between.iter().map(|closure| vote(closure, graph, component, host)).collect();
        let Some(best) = best_hypothesis(&oriented, &between, graph, (host, guest), &[]) else { continue };
        let rival = best_hypothesis(&oriented, &between, graph, (host, guest), &best.closures);
        let rival_anchors = rival.map_or(0, |rival| rival.num_anchors);
        if rival_anchors as f64 <= config.max_ambiguity * best.num_anchors as f64 && best.num_anchors >= 3 {
            found.push(best);
        }
    }
    found.sort_by_key(|hypothesis| {
        (std::cmp::Reverse(hypothesis.num_anchors), hypothesis.host, hypothesis.guest)
    });
    found
}

/// What one closure says of the two frames.
#[derive(Clone, Copy, Debug)]
struct Vote {
    host_anchor: usize,
    guest_anchor: usize,
    host_from_guest: Pose2,
    /// Pose of the guest's anchor in the host's frame.
    host_from_anchor: Pose2,
}

fn vote(closure: &Closure, graph: &CoarseGraph, component: impl Fn(usize) -> u32, host: u32) -> Vote {
    let (host_anchor, guest_anchor, relative) = if component(closure.earlier) == host {
        (closure.earlier, closure.later, closure.fit.earlier_from_later)
    } else {
        (closure.later, closure.earlier, closure.fit.earlier_from_later.inverse())
    };
    let host_from_anchor = graph.poses[host_anchor].compose(&relative);
    let host_from_guest = host_from_anchor.compose(&graph.poses[guest_anchor].inverse());
    Vote { host_anchor, guest_anchor, host_from_guest, host_from_anchor }
}

/// The seed with most agreeing anchors; seeds that agree with `excluded` closures are not tried.
fn best_hypothesis(
    votes: &[Vote],
    closures: &[Closure],
    graph: &CoarseGraph,
    (host, guest): (u32, u32),
    excluded: &[Closure],
) -> Option<Hypothesis> {
    let is_excluded = |index: usize| {
        excluded
            .iter()
            .any(|other| (other.earlier, other.later) == (closures[index].earlier, closures[index].later))
    };
    let mut best: Option<(usize, usize, Vec<usize>)> = None;
    for (seed_idx, seed) in votes.iter().enumerate().filter(|(index, _)| !is_excluded(*index)) {
        let members: Vec<usize> = (0..votes.len())
            .filter(|&index| !is_excluded(index))
            .filter(|&index| agrees(seed, &votes[index], graph))
            .collect();
        let anchors: BTreeSet<usize> = members.iter().map(|&index| votes[index].guest_anchor).collect();
        let hosts: BTreeSet<usize> = members.iter().map(|&index| votes[index].host_anchor).collect();
        let num_anchors = anchors.len().min(hosts.len());
        if best.as_ref().is_none_or(|(count, _, _)| num_anchors > *count) {
            best = Some((num_anchors, seed_idx, members));
        }
    }
    best.map(|(num_anchors, seed_idx, members)| Hypothesis {
        host,
        guest,
        host_from_guest: votes[seed_idx].host_from_guest,
        closures: members.iter().map(|&index| closures[index]).collect(),
        num_anchors,
    })
}

/// Two votes agree when the seed's frame puts the other's anchor where the other says; looser with distance.
fn agrees(seed: &Vote, other: &Vote, graph: &CoarseGraph) -> bool {
    let predicted = seed.host_from_guest.compose(&graph.poses[other.guest_anchor]);
    let error = predicted.between(&other.host_from_anchor);
    let apart_m = graph.poses[seed.guest_anchor].distance(&graph.poses[other.guest_anchor]);
    error.x.hypot(error.y) < 0.5 + 0.05 * apart_m && error.theta.abs() < 0.08 + 0.002 * apart_m
}

/// How well a joined map holds between host and guest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JoinReport {
    /// Different anchors of the guest that fit.
    pub num_anchors: usize,
    /// Share of the tried guest anchors that fit anywhere.
    pub share: f64,
    /// Standard deviation of the worst direction, metres.
    pub worst_sd_m: f64,
}

/// Judges a tentatively joined map by its closures and all pairs that were tried.
pub(crate) fn judge_join(
    closures: &[Closure],
    tried: &[(usize, usize)],
    set: &AnchorSet,
    graph: &CoarseGraph,
    is_across: impl Fn(usize, usize) -> bool,
    guest_anchor: impl Fn(usize, usize) -> usize,
) -> JoinReport {
    let fitting: Vec<&Closure> =
        closures.iter().filter(|closure| is_across(closure.earlier, closure.later)).collect();
    let anchors: BTreeSet<usize> =
        fitting.iter().map(|closure| guest_anchor(closure.earlier, closure.later)).collect();
    let tried: BTreeSet<usize> = tried
        .iter()
        .filter(|(a, b)| is_across(*a, *b) && graph.poses[*a].distance(&graph.poses[*b]) < 2.0)
        .map(|(a, b)| guest_anchor(*a, *b))
        .collect();
    let confirmed = tried.intersection(&anchors).count();
    let mut information = Matrix2::zeros();
    for closure in &fitting {
        let in_map =
            crate::registration::rotated(&closure.fit.covariance, graph.poses[closure.earlier].theta);
        let place = in_map.fixed_view::<2, 2>(0, 0).into_owned() + Matrix2::identity() * 0.01;
        information += place.try_inverse().unwrap_or_else(Matrix2::zeros);
    }
    let weakest = information.symmetric_eigenvalues().min();
    debug_assert!(anchors.iter().all(|&anchor| anchor < set.anchors.len()));
    JoinReport {
        num_anchors: anchors.len(),
        share: confirmed as f64 / tried.len().max(1) as f64,
        worst_sd_m: if weakest > 0.0 { 1.0 / weakest.sqrt() } else { f64::INFINITY },
    }
}
