//! Joining runs that never met: consistent sets of registrations, extended along both drives, or nothing.
//!
//! One registration proves little: corridors look alike. But a wrong alignment that fits here contradicts itself some
//! metres on, where the one corridor turns and the other does not. So a hypothesis is extended to all places where it
//! lays the two runs over each other, and must hold nearly everywhere, over a long enough drive, in every direction,
//! and clearly better than any other.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix2;

use super::anchors::AnchorSet;
use super::candidates::Candidate;
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::memo::{RegistrationMemo, Request};
use super::watch::{MappingError, Span};
use crate::geometry::Pose2;
use crate::pose_graph::PoseGraphError;
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

impl Hypothesis {
    /// Orders hypotheses: the surest last.
    pub fn rank(&self) -> (usize, Reverse<u32>, Reverse<u32>) {
        (self.num_anchors, Reverse(self.host), Reverse(self.guest))
    }

    /// True when it joins this component to another.
    pub const fn is_about(&self, component: u32) -> bool {
        self.host == component || self.guest == component
    }
}

/// Registers the candidates between different components.
///
/// # Errors
/// [`MappingError::Stopped`].
pub(crate) fn registered_candidates(
    candidates: &[Candidate],
    set: &AnchorSet,
    config: &MappingConfig,
    memo: &mut RegistrationMemo,
    span: Span<'_>,
) -> Result<Vec<Option<Closure>>, MappingError> {
    let requests: Vec<Request> = candidates
        .iter()
        .map(|candidate| Request {
            earlier: candidate.earlier,
            later: candidate.later,
            window: SearchWindow { center: candidate.predicted, half_m: 2.0, half_turn_rad: 0.35 },
        })
        .collect();
    let fits = memo.answers(&requests, set, &config.submap, span)?;
    let closures = requests
        .iter()
        .zip(fits)
        .map(|(request, fit)| {
            fit.filter(|fit| fit.agreement >= config.min_agreement && fit.overlap >= config.min_overlap)
                .map(|fit| Closure { earlier: request.earlier, later: request.later, fit })
        })
        .collect();
    Ok(closures)
}

/// The best few hypotheses between every two components that are wanted: sets of registrations that agree pair by
/// pair, the largest first.
///
/// # Errors
/// Whatever the graph cannot solve.
pub(crate) fn hypotheses(
    closures: &[Closure],
    set: &AnchorSet,
    graph: &CoarseGraph,
    components: &[u32],
    is_wanted: &dyn Fn(u32, u32) -> bool,
    config: &MappingConfig,
) -> Result<Vec<Vec<Hypothesis>>, PoseGraphError> {
    let component = |anchor: usize| components[set.anchors[anchor].run_idx as usize];
    let mut pairs: BTreeMap<(u32, u32), Vec<Closure>> = BTreeMap::new();
    for closure in closures {
        let (a, b) = (component(closure.earlier), component(closure.later));
        if a != b && is_wanted(a, b) {
            pairs.entry((a.min(b), a.max(b))).or_default().push(*closure);
        }
    }
    let mut found = Vec::new();
    for ((host, guest), mut between) in pairs {
        let mut rivals = Vec::new();
        while rivals.len() < config.max_hypotheses {
            let is_in_scope = |anchor: usize| [host, guest].contains(&component(anchor));
            let members = graph.consistent(&between, &is_in_scope, config)?;
            let is_member = |index: usize| members.binary_search(&index).is_ok();
            let agreeing: Vec<Closure> = members.iter().map(|&index| between[index]).collect();
            let Some(hypothesis) = hypothesis(agreeing, graph, component, (host, guest)) else { break };
            if hypothesis.num_anchors < config.min_seeds {
                break;
            }
            rivals.push(hypothesis);
            let left = between.iter().enumerate().filter(|(index, _)| !is_member(*index));
            between = left.map(|(_, closure)| *closure).collect();
        }
        if !rivals.is_empty() {
            found.push(rivals);
        }
    }
    Ok(found)
}

/// How closures that agree lay the guest over the host: as the surest of them says.
fn hypothesis(
    closures: Vec<Closure>,
    graph: &CoarseGraph,
    component: impl Fn(usize) -> u32,
    (host, guest): (u32, u32),
) -> Option<Hypothesis> {
    let ends = |closure: &Closure| match component(closure.earlier) == host {
        true => (closure.earlier, closure.later, closure.fit.earlier_from_later),
        false => (closure.later, closure.earlier, closure.fit.earlier_from_later.inverse()),
    };
    let doubt = |closure: &Closure| closure.fit.covariance.fixed_view::<2, 2>(0, 0).trace();
    let surest = closures.iter().min_by(|a, b| doubt(a).total_cmp(&doubt(b)))?;
    let (host_anchor, guest_anchor, relative) = ends(surest);
    let host_from_anchor = graph.poses[host_anchor].compose(&relative);
    let host_from_guest = host_from_anchor.compose(&graph.poses[guest_anchor].inverse());
    let hosts: BTreeSet<usize> = closures.iter().map(|closure| ends(closure).0).collect();
    let guests: BTreeSet<usize> = closures.iter().map(|closure| ends(closure).1).collect();
    Some(Hypothesis { host, guest, host_from_guest, closures, num_anchors: hosts.len().min(guests.len()) })
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
    /// Share of the returns of the two that contradict each other wherever they overlap.
    pub contradiction: f64,
    /// The share that the one contradicts of what the other saw, whichever way is less: furniture that came or went
    /// counts only one way.
    pub one_sided_contradiction: f64,
    /// Contradiction between places of one run, the worse of the two maps.
    pub own_contradiction: f64,
    /// True when the joined map brings together what a person said are different places.
    pub is_vetoed: bool,
}

impl JoinReport {
    /// True when the joined map may stand.
    pub fn holds(&self, config: &MappingConfig) -> bool {
        self.num_anchors >= config.min_joining_anchors
            && self.share >= config.min_joining_share
            && self.worst_sd_m <= config.max_joining_sd_m
            && (self.one_sided_contradiction <= config.max_contradiction
                || self.contradiction <= config.max_contradiction_ratio * self.own_contradiction)
    }
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
        ..JoinReport::default()
    }
}
