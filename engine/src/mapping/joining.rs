//! Joining runs that never met, the surest first, as long as one convinces.
//!
//! All ways to lay any two components over each other compete; which runs came first plays no part.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use rayon::prelude::*;

use super::candidates::{Candidate, candidates_across};
use super::coarse_graph::Closure;
use super::component::{Component, Workshop};
use super::indices::RunIdx;
use super::join_evidence::JoinEvidence;
use super::null::Null;
use super::place_match::{Channel, PlaceMatch, RejectionReason};
use super::refusals::{Refusal, unfit_matches};
use super::watch::MappingError;
use super::ways::{Groups, Registered, Way};
use crate::geometry::Pose2;

/// What joining made of the runs.
pub(crate) struct Joined<'a> {
    pub components: Vec<Component<'a>>,
    /// Registrations between runs that the map does not bear out.
    pub refused: Vec<Refusal>,
    /// Candidates whose submaps do not fit.
    pub unfit: Vec<PlaceMatch>,
    /// Wrong ways to lay runs over themselves.
    pub null: Null,
}

/// Two components that might be joined.
struct Proposal<'c> {
    host: RunIdx,
    guest: RunIdx,
    groups: Groups<'c>,
}

impl Proposal<'_> {
    /// Orders proposals: the surest last.
    fn rank(&self) -> (usize, Reverse<RunIdx>, Reverse<RunIdx>) {
        (self.groups.largest(), Reverse(self.host), Reverse(self.guest))
    }
}

/// Lays components over each other, the surest first, as long as one convinces. `bodies` come from the foundation, with
/// the null of the runs in them.
///
/// # Errors
/// Whatever the graph cannot solve; [`MappingError::Stopped`].
pub(crate) fn join<'a>(
    (bodies, of_bodies): (Vec<Component<'a>>, &Null),
    alone: Vec<Component<'a>>,
    workshop: Workshop<'a>,
) -> Result<Joined<'a>, MappingError> {
    let run_of = |anchor| workshop.site.anchor(anchor).run;
    let may_be = |candidate: &Candidate| {
        let (earlier, later) = (candidate.earlier, candidate.later);
        let judgements = workshop.judgements;
        !judgements.forbid(earlier, later) && !judgements.keep_apart(&[run_of(earlier)], &[run_of(later)])
    };
    let candidates: Vec<Candidate> = candidates_across(workshop.site).into_iter().filter(may_be).collect();
    let null = of_bodies.with(&Null::of(&alone, workshop.part(0, 4))?);
    let num_bodies = bodies.len();
    let apart = bodies.into_iter().chain(alone);
    let mut joiner = Joiner::new(apart, &candidates, null, workshop);
    joiner.found(num_bodies, workshop.part(1, 4))?;
    // What was refused stays refused as long as neither of the two has grown.
    let is_open = |host, guest| !joiner.refusals.contains_key(&(host, guest)) || joiner.grown.contains(&host);
    let mut proposals = joiner.proposals(is_open);
    let mut num_proposals = proposals.len();
    while let Some(proposal) = proposals.pop() {
        let num_left = proposals.len() + 1;
        num_proposals = num_proposals.max(num_left);
        let (host, guest) = (proposal.host, proposal.guest);
        let laying = workshop.part(2, 4).part(num_proposals - num_left, num_proposals);
        if !joiner.try_join(&proposal, laying)? {
            continue;
        }
        // Every pair that one of the two belongs to is another question now.
        let is_about_them = |proposal: &Proposal<'_>| {
            [proposal.host, proposal.guest].iter().any(|run| [host, guest].contains(run))
        };
        proposals.retain(|proposal| !is_about_them(proposal));
        let joined = host.min(guest);
        proposals.extend(joiner.proposals(|a, b| a == joined || b == joined));
        proposals.sort_by_key(Proposal::rank);
    }
    joiner.finish()
}

struct Joiner<'a, 'c> {
    workshop: Workshop<'a>,
    candidates: &'c [Candidate],
    null: Null,
    /// By the first run of each.
    components: BTreeMap<RunIdx, Component<'a>>,
    /// Why two components were not joined, by their first runs.
    refusals: BTreeMap<(RunIdx, RunIdx), RejectionReason>,
    fits: Vec<Closure>,
    unfit: BTreeMap<usize, &'c Candidate>,
    grown: Vec<RunIdx>,
}

impl<'a, 'c> Joiner<'a, 'c> {
    fn new(
        apart: impl Iterator<Item = Component<'a>>,
        candidates: &'c [Candidate],
        null: Null,
        workshop: Workshop<'a>,
    ) -> Self {
        let components = apart.map(|component| (component.graph.runs()[0], component)).collect();
        Self {
            workshop,
            candidates,
            null,
            components,
            refusals: BTreeMap::new(),
            fits: Vec::new(),
            unfit: BTreeMap::new(),
            grown: Vec::new(),
        }
    }

    /// Ways to join every two components that are wanted, the surest last.
    fn proposals(&self, is_wanted: impl Fn(RunIdx, RunIdx) -> bool + Sync) -> Vec<Proposal<'c>> {
        let firsts: Vec<RunIdx> = self.components.keys().copied().collect();
        let pairs: Vec<(RunIdx, RunIdx)> = (firsts.iter())
            .flat_map(|&host| {
                firsts.iter().filter(move |&&guest| host < guest).map(move |&guest| (host, guest))
            })
            .filter(|&(host, guest)| is_wanted(host, guest))
            .filter(|(host, guest)| {
                let runs = |first: &RunIdx| self.components[first].graph.runs();
                !self.workshop.judgements.keep_apart(runs(host), runs(guest))
            })
            .collect();
        let proposal = |&(host, guest): &(RunIdx, RunIdx)| {
            let groups = Groups::new(&self.components[&host], &self.components[&guest], self.candidates);
            Proposal { host, guest, groups }
        };
        let mut found: Vec<Proposal<'c>> = pairs.par_iter().map(proposal).collect();
        found.retain(|proposal| proposal.groups.largest() >= self.workshop.site.config.min_seeds);
        found.sort_by_key(Proposal::rank);
        found
    }

    /// Lays every new run over every body of the foundation by itself, and joins those that fit one of them. What comes
    /// of that does not depend on what else is new, so that the next build need not find it out again. A run that fits
    /// two bodies joins these, which is for later.
    fn found(&mut self, num_bodies: usize, workshop: Workshop<'a>) -> Result<(), MappingError> {
        let firsts: Vec<RunIdx> = self.components.keys().copied().collect();
        let bodies = &firsts[..num_bodies];
        let proposals = self.proposals(|host, guest| bodies.contains(&host) && !bodies.contains(&guest));
        let num_proposals = proposals.len();
        let judged = (proposals.par_iter().enumerate())
            .map(|(idx, proposal)| self.judged(proposal, workshop.part(idx, num_proposals)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut fitting: BTreeMap<RunIdx, Vec<(RunIdx, Box<Component<'a>>)>> = BTreeMap::new();
        for (proposal, (registered, verdict)) in proposals.iter().zip(judged) {
            self.note(registered);
            match verdict {
                Verdict::Joined(both) => {
                    fitting.entry(proposal.guest).or_default().push((proposal.host, both))
                }
                Verdict::Apart(reason) => {
                    self.refusals.insert((proposal.host, proposal.guest), reason);
                }
            }
        }
        let mut guests: BTreeMap<RunIdx, Vec<(Component<'a>, Box<Component<'a>>)>> = BTreeMap::new();
        for (guest, mut hosts) in fitting {
            let (1, Some((host, both))) = (hosts.len(), hosts.pop()) else { continue };
            let Some(alone) = self.components.remove(&guest) else { continue };
            self.refusals.retain(|(_, other), _| *other != guest);
            guests.entry(host).or_default().push((alone, both));
        }
        for (host, guests) in guests {
            let founded = Component::founded(&self.components[&host], &guests, workshop)?;
            self.components.insert(host, founded);
            self.grown.push(host);
        }
        Ok(())
    }

    /// What comes of two components, with the registrations that say so.
    fn judged(
        &self,
        proposal: &Proposal<'c>,
        workshop: Workshop<'a>,
    ) -> Result<(Registered<'c>, Verdict<'a>), MappingError> {
        let (host, guest) = (&self.components[&proposal.host], &self.components[&proposal.guest]);
        let registered = proposal.groups.ways(workshop.part(0, 2))?;
        let verdict = judged(&registered.ways, host, guest, &self.null, workshop.part(1, 2))?;
        Ok((registered, verdict))
    }

    /// Notes registrations for the list of what the map does not bear out.
    fn note(&mut self, registered: Registered<'c>) {
        let Registered { fits, unfit, .. } = registered;
        self.fits.extend(fits);
        self.unfit.extend(unfit.into_iter().map(|candidate| {
            let place = self.candidates.partition_point(|other| other.key() < candidate.key());
            (place, candidate)
        }));
    }

    /// Joins two components if one of the ways to do so holds and no other holds nearly as well; otherwise everything
    /// stays as it was.
    fn try_join(&mut self, proposal: &Proposal<'c>, workshop: Workshop<'a>) -> Result<bool, MappingError> {
        let (registered, verdict) = self.judged(proposal, workshop)?;
        self.note(registered);
        match verdict {
            Verdict::Joined(both) => {
                self.components.remove(&proposal.guest);
                self.components.insert(proposal.host, *both);
                self.grown.retain(|run| *run != proposal.guest && *run != proposal.host);
                self.grown.push(proposal.host);
                self.refusals.retain(|(a, b), _| {
                    ![a, b].iter().any(|run| **run == proposal.host || **run == proposal.guest)
                });
                Ok(true)
            }
            Verdict::Apart(reason) => {
                self.refusals.insert((proposal.host, proposal.guest), reason);
                Ok(false)
            }
        }
    }

    /// Settles what has grown, and lists the registrations between runs that the finished map does not bear out.
    fn finish(mut self) -> Result<Joined<'a>, MappingError> {
        for run in &self.grown {
            if let Some(component) = self.components.get_mut(run) {
                component.settle(self.workshop.part(3, 4))?;
            }
        }
        let first_of = |closure: &Closure| {
            let of = |anchor| {
                self.components
                    .iter()
                    .find(|(_, component)| component.graph.holds(anchor))
                    .map(|(run, _)| *run)
            };
            (of(closure.earlier), of(closure.later))
        };
        self.fits.sort_by_key(|closure| (closure.later, closure.earlier));
        self.fits.dedup_by_key(|closure| (closure.later, closure.earlier));
        let refusal = |closure: &Closure| {
            let (Some(a), Some(b)) = first_of(closure) else { return None };
            let is_refused =
                a != b || self.components[&a].graph.chi2(closure) > self.workshop.site.config.max_chi2;
            let pair = (a.min(b), a.max(b));
            let reason = self.refusals.get(&pair).copied().unwrap_or(RejectionReason::Inconsistent);
            is_refused.then_some(Refusal { channel: Channel::Profile, closure: *closure, reason })
        };
        let refused = self.fits.iter().filter_map(refusal).collect();
        let unfit = unfit_matches(self.unfit.values().copied(), self.workshop.site);
        Ok(Joined { components: self.components.into_values().collect(), refused, unfit, null: self.null })
    }
}

/// What became of a proposal.
enum Verdict<'a> {
    Joined(Box<Component<'a>>),
    Apart(RejectionReason),
}

/// Tries the ways to lay a guest over a host against each other.
fn judged<'a>(
    ways: &[Way],
    host: &Component<'a>,
    guest: &Component<'a>,
    null: &Null,
    workshop: Workshop<'a>,
) -> Result<Verdict<'a>, MappingError> {
    let config = workshop.site.config;
    let own = host.own_contradiction(workshop).min(guest.own_contradiction(workshop));
    let mut laid: Vec<(JoinEvidence, Component<'a>)> = Vec::new();
    for (idx, way) in different(ways, guest).into_iter().take(config.max_hypotheses).enumerate() {
        let workshop = workshop.part(idx, config.max_hypotheses);
        let found = Component::laid_over((host, guest), way, own, workshop)?;
        laid.extend(found.map(|(both, evidence)| (evidence, both)));
    }
    let (mut holding, others): (Vec<_>, Vec<_>) =
        laid.into_iter().partition(|(evidence, _)| evidence.holds(config));
    holding.sort_by(|(a, _), (b, _)| a.one_sided_contradiction.total_cmp(&b.one_sided_contradiction));
    let longest = holding.iter().map(|(evidence, _)| evidence.num_anchors).max().unwrap_or_default();
    let reaches = |evidence: &JoinEvidence, least: usize| {
        evidence.num_anchors as f64 >= config.max_ambiguity * least as f64
    };
    // A short stretch of corridor is contradicted by little.
    let Some(place) = holding.iter().position(|(evidence, _)| reaches(evidence, longest)) else {
        return Ok(Verdict::Apart(RejectionReason::Inconsistent));
    };
    let (best, both) = holding.swap_remove(place);
    if best.is_vetoed {
        return Ok(Verdict::Apart(RejectionReason::Vetoed));
    }
    let is_rival = |(other, rival): &(JoinEvidence, Component<'a>)| {
        reaches(other, best.num_anchors)
            && other.one_sided_contradiction <= config.null_slack * best.one_sided_contradiction
            && differ(&both, rival, host, guest)
    };
    if null.explains(&best, config) || holding.iter().chain(&others).any(is_rival) {
        return Ok(Verdict::Apart(RejectionReason::Ambiguous));
    }
    Ok(Verdict::Joined(Box::new(both)))
}

/// Ways that put the guest at different places; of those that put it at one place the first.
fn different<'w>(ways: &'w [Way], guest: &Component<'_>) -> Vec<&'w Way> {
    let anchors = guest.graph.anchors();
    let Some(&middle) = anchors.get(anchors.len() / 2) else { return Vec::new() };
    let place = |way: &Way| way.host_from_guest.compose(&guest.graph.pose(middle));
    let mut chosen: Vec<&Way> = Vec::new();
    for way in ways {
        if chosen.iter().all(|other| are_apart(&place(other).between(&place(way)))) {
            chosen.push(way);
        }
    }
    chosen
}

/// True when two poses that differ by this are different places.
fn are_apart(difference: &Pose2) -> bool {
    difference.x.hypot(difference.y) > 1.0 || difference.theta.abs() > 0.2
}

/// True when two joined maps put the guest at different places.
fn differ(a: &Component<'_>, b: &Component<'_>, host: &Component<'_>, guest: &Component<'_>) -> bool {
    let (Some(&host), Some(&guest)) = (host.graph.anchors().first(), guest.graph.anchors().first()) else {
        return false;
    };
    let relative = |both: &Component<'_>| both.graph.pose(host).between(&both.graph.pose(guest));
    are_apart(&relative(a).between(&relative(b)))
}
