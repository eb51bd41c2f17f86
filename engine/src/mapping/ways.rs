//! Ways to lay one component over another: candidates that agree with one another, confirmed by registration.
//!
//! One registration proves little: corridors look alike. But a wrong alignment that fits here contradicts itself some
//! metres on, where the one corridor turns and the other does not. So candidates are first sorted into groups that lay
//! the two components over each other in one way, which costs no registration, and only a few of the members of the
//! largest groups are registered.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use super::candidates::Candidate;
use super::coarse_graph::{Closure, deviation2, slack};
use super::component::{Component, Workshop};
use super::guided::is_fit;
use super::indices::AnchorIdx;
use super::memo::Request;
use super::watch::MappingError;
use crate::geometry::Pose2;
use crate::registration::{SearchWindow, SubmapFit, rotated};

/// A way to lay one component over another.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    /// Frame of the host from frame of the guest.
    pub host_from_guest: Pose2,
    /// The registrations that say so.
    pub closures: Vec<Closure>,
    /// Number of different anchors on either side of them, whichever is less.
    pub num_anchors: usize,
}

/// A candidate between two components, turned so that it leads from the host to the guest.
#[derive(Clone, Copy, Debug)]
struct Claim<'c> {
    candidate: &'c Candidate,
    /// Where the anchors lie, each in the frame of its component.
    host_pose: Pose2,
    guest_pose: Pose2,
    host: AnchorIdx,
    guest: AnchorIdx,
    /// The guest's anchor seen from the host's.
    relative: Pose2,
}

/// A claim that registration bears out.
#[derive(Clone, Copy, Debug)]
struct Fit<'c> {
    claim: Claim<'c>,
    closure: Closure,
    /// Covariance of the claim's relative pose, in the axes of the host's anchor.
    covariance: Matrix3<f64>,
}

impl<'c> Fit<'c> {
    fn new(claim: &Claim<'c>, fit: SubmapFit) -> Self {
        let (earlier, later) = (claim.candidate.earlier, claim.candidate.later);
        let seen = fit.earlier_from_later;
        let (relative, covariance) = match claim.host == earlier {
            true => (seen, fit.covariance),
            // The lever of the heading matters little nearby.
            false => (seen.inverse(), rotated(&fit.covariance, -seen.theta)),
        };
        Self { claim: Claim { relative, ..*claim }, closure: Closure { earlier, later, fit }, covariance }
    }

    /// True when both lay the components over each other in one way, as far as each is sure: a fit in a plain corridor
    /// may slide along it.
    fn agrees(&self, other: &Self, chi2_max: f64) -> bool {
        let host_step = self.claim.host_pose.between(&other.claim.host_pose);
        let guest_step = self.claim.guest_pose.between(&other.claim.guest_pose);
        let one_way = self.claim.relative.compose(&guest_step);
        let other_way = host_step.compose(&other.claim.relative);
        let (host_m, guest_m) = (host_step.x.hypot(host_step.y), guest_step.x.hypot(guest_step.y));
        let drift_m = DRIFT * (host_m + guest_m);
        let drift_rad = DRIFT_RAD_PER_M * (host_m + guest_m);
        let lever_m2 = guest_m * guest_m * self.covariance[(2, 2)] + drift_m * drift_m;
        let covariance = self.covariance
            + rotated(&other.covariance, host_step.theta)
            + slack()
            + Matrix3::from_diagonal(&Vector3::new(lever_m2, lever_m2, drift_rad * drift_rad));
        deviation2(&one_way, &other_way, &covariance) <= chi2_max
    }
}

/// How much further apart two places of a settled component may be than it says, as a share of their distance.
const DRIFT: f64 = 0.015;
/// The same for headings, radians per metre.
const DRIFT_RAD_PER_M: f64 = 0.002;

impl<'c> Claim<'c> {
    fn new(host: &Component<'_>, guest: &Component<'_>, candidate: &'c Candidate) -> Option<Self> {
        let (a, b) = (candidate.earlier, candidate.later);
        if host.graph.holds(a) && guest.graph.holds(b) {
            let (host_pose, guest_pose) = (host.graph.pose(a), guest.graph.pose(b));
            let relative = candidate.predicted;
            Some(Self { candidate, host_pose, guest_pose, host: a, guest: b, relative })
        } else if host.graph.holds(b) && guest.graph.holds(a) {
            let (host_pose, guest_pose) = (host.graph.pose(b), guest.graph.pose(a));
            let relative = candidate.predicted.inverse();
            Some(Self { candidate, host_pose, guest_pose, host: b, guest: a, relative })
        } else {
            None
        }
    }

    /// True when both lay the components over each other in one way, as nearly as profiles can say.
    fn agrees(&self, other: &Self) -> bool {
        let host_step = self.host_pose.between(&other.host_pose);
        let guest_step = self.guest_pose.between(&other.guest_pose);
        let error = self.relative.compose(&guest_step).between(&host_step.compose(&other.relative));
        let length_m = host_step.x.hypot(host_step.y) + guest_step.x.hypot(guest_step.y);
        error.x.hypot(error.y) < 1.5 + 0.03 * length_m && error.theta.abs() < 0.3
    }
}

/// Candidates between two components that are sorted into groups, those that read most alike.
const NUM_SEEDS_MAX: usize = 400;

/// Candidates between two components, in groups that agree.
pub(crate) struct Groups<'c> {
    groups: Vec<Vec<Claim<'c>>>,
}

impl<'c> Groups<'c> {
    /// Sorts the candidates between two components into groups that agree, the largest first.
    pub fn new(host: &Component<'_>, guest: &Component<'_>, candidates: &'c [Candidate]) -> Self {
        let config = host.graph.site.config;
        let mut claims: Vec<Claim<'c>> =
            candidates.iter().filter_map(|candidate| Claim::new(host, guest, candidate)).collect();
        claims.sort_by(|a, b| {
            let score = |claim: &Claim<'_>| claim.candidate.profile.score;
            score(b).total_cmp(&score(a)).then_with(|| a.candidate.key().cmp(&b.candidate.key()))
        });
        claims.truncate(NUM_SEEDS_MAX);
        let agreeing: Vec<Vec<usize>> = (claims.iter())
            .map(|claim| (0..claims.len()).filter(|&other| claim.agrees(&claims[other])).collect())
            .collect();
        let mut is_left = vec![true; claims.len()];
        let mut groups = Vec::new();
        while groups.len() < config.max_ways {
            let group_of = |seed: usize| -> Vec<usize> {
                agreeing[seed].iter().copied().filter(|&member| is_left[member]).collect()
            };
            let size = |seed: usize| {
                group_of(seed).iter().map(|&member| claims[member].guest).collect::<BTreeSet<_>>().len()
            };
            let seeds = (0..claims.len()).filter(|&seed| is_left[seed]);
            let Some(seed) = seeds.max_by_key(|&seed| (size(seed), Reverse(seed))) else { break };
            let group = group_of(seed);
            if size(seed) < config.min_seeds {
                break;
            }
            groups.push(group.iter().map(|&member| claims[member]).collect());
            group.iter().for_each(|&member| is_left[member] = false);
        }
        Self { groups }
    }

    /// Different anchors of the guest in the largest group.
    pub fn largest(&self) -> usize {
        let num_guests =
            |group: &Vec<Claim<'_>>| group.iter().map(|claim| claim.guest).collect::<BTreeSet<_>>().len();
        self.groups.first().map_or(0, num_guests)
    }

    /// Registers a few members of every group, and returns the ways that these bear out, those with most anchors
    /// first, with the fits of all and the candidates that do not fit.
    ///
    /// # Errors
    /// [`MappingError::Stopped`].
    pub fn ways(&self, workshop: Workshop<'_>) -> Result<Registered<'c>, MappingError> {
        let config = workshop.site.config;
        let mut found = Registered::default();
        for (idx, group) in self.groups.iter().enumerate() {
            let span = workshop.span.part(idx, self.groups.len());
            let chosen = spread_out(group, config.max_probes);
            let requests: Vec<Request> = chosen.iter().map(|claim| request(claim.candidate)).collect();
            let fits = workshop.memo.answers(&requests, workshop.site, span)?;
            let mut fitting = Vec::new();
            for (claim, fit) in chosen.iter().zip(fits) {
                match fit.filter(|fit| is_fit(fit, false, config)) {
                    Some(fit) => fitting.push(Fit::new(claim, fit)),
                    None => found.unfit.push(claim.candidate),
                }
            }
            found.fits.extend(fitting.iter().map(|fit| fit.closure));
            let way = way(&fitting, config.consistency.cycle_chi2_max);
            found.ways.extend(way.filter(|way| way.num_anchors >= config.min_seeds));
        }
        found.ways.sort_by_key(|way| Reverse(way.num_anchors));
        Ok(found)
    }
}

/// What registration made of groups of candidates.
#[derive(Default)]
pub(crate) struct Registered<'c> {
    pub ways: Vec<Way>,
    pub fits: Vec<Closure>,
    pub unfit: Vec<&'c Candidate>,
}

fn request(candidate: &Candidate) -> Request {
    let window = SearchWindow { center: candidate.predicted, half_m: 2.0, half_turn_rad: 0.35 };
    Request { earlier: candidate.earlier, later: candidate.later, window }
}

/// A few of a group, one for each anchor of the guest, evenly along it.
fn spread_out<'c>(group: &[Claim<'c>], num_max: usize) -> Vec<Claim<'c>> {
    // Claims stand in order of their scores, so the first of an anchor is its best.
    let mut seen = BTreeSet::new();
    let mut best: Vec<Claim<'c>> = group.iter().filter(|claim| seen.insert(claim.guest)).copied().collect();
    best.sort_by_key(|claim| claim.guest);
    let count = best.len().min(num_max);
    (0..count).map(|k| best[k * best.len() / count]).collect()
}

/// The largest set of fits that agree with one of them.
fn way(fits: &[Fit<'_>], chi2_max: f64) -> Option<Way> {
    let agreeing = |seed: usize| fits.iter().filter(move |fit| fits[seed].agrees(fit, chi2_max));
    let seed = (0..fits.len()).max_by_key(|&seed| (agreeing(seed).count(), Reverse(seed)))?;
    let members: Vec<&Fit<'_>> = agreeing(seed).collect();
    let doubt = |fit: &Fit<'_>| fit.covariance.fixed_view::<2, 2>(0, 0).trace();
    let surest = members.iter().min_by(|a, b| doubt(a).total_cmp(&doubt(b)))?.claim;
    let hosts: BTreeSet<AnchorIdx> = members.iter().map(|fit| fit.claim.host).collect();
    let guests: BTreeSet<AnchorIdx> = members.iter().map(|fit| fit.claim.guest).collect();
    Some(Way {
        host_from_guest: surest.host_pose.compose(&surest.relative).compose(&surest.guest_pose.inverse()),
        closures: members.iter().map(|fit| fit.closure).collect(),
        num_anchors: hosts.len().min(guests.len()),
    })
}
