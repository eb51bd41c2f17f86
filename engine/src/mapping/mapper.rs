//! From runs to one map, the conductor.

use std::collections::BTreeSet;

use super::anchors::AnchorSet;
use super::candidates::profile_candidates;
use super::claims::{ClosureIndex, spatial_match};
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::guided::guided_closures;
use super::joining::{Hypothesis, hypotheses, judge_join, registered_candidates};
use super::judgements::Judgements;
use super::memo::RegistrationMemo;
use super::place_match::{Decision, PlaceMatch};
use super::placement::place_observations;
use super::refused::refused_matches;
use super::run::RunRecord;
use super::site_map::{MappedRun, SiteMap};
use super::stretches::{StretchSettings, find_stretches};
use crate::geometry::Pose2;
use crate::pose_graph::PoseGraphError;

/// Builds the map of a site.
///
/// # Errors
/// Whatever the pose graph cannot solve.
pub fn map_site(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    decisions: &[Decision],
    memo: &mut RegistrationMemo,
) -> Result<SiteMap, PoseGraphError> {
    memo.prepare(&config.submap);
    let set = AnchorSet::build(runs, config);
    if set.anchors.is_empty() {
        return Ok(SiteMap::default());
    }
    let judgements = Judgements::new(decisions, runs, &set, config.submap_half_length_m);
    let mut mapper = Mapper::new(config, runs, &set, &judgements)?;
    mapper.settle(memo)?;
    if runs.len() > 1 {
        mapper.join(memo)?;
    }
    Ok(mapper.finish())
}

/// The map while it is being built.
struct Mapper<'a> {
    config: &'a MappingConfig,
    runs: &'a [RunRecord<'a>],
    set: &'a AnchorSet,
    judgements: &'a Judgements<'a>,
    components: Vec<u32>,
    graph: CoarseGraph,
    closures: Vec<Closure>,
    tried: Vec<(usize, usize)>,
    refused: Vec<PlaceMatch>,
}

impl<'a> Mapper<'a> {
    fn new(
        config: &'a MappingConfig,
        runs: &'a [RunRecord<'a>],
        set: &'a AnchorSet,
        judgements: &'a Judgements<'a>,
    ) -> Result<Self, PoseGraphError> {
        let mut graph = CoarseGraph::new(set, runs, config);
        graph.optimise(set, &[], config)?;
        let components = (0..runs.len() as u32).collect();
        let (closures, tried, refused) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { config, runs, set, judgements, components, graph, closures, tried, refused })
    }

    /// Guided matching and optimisation in turns, until nothing new is found.
    fn settle(&mut self, memo: &mut RegistrationMemo) -> Result<(), PoseGraphError> {
        for _ in 0..self.config.max_rounds {
            let may_match = |earlier: usize, later: usize| {
                self.components[self.set.anchors[earlier].run_idx as usize]
                    == self.components[self.set.anchors[later].run_idx as usize]
                    && self.set.may_match(earlier, later, self.config.min_gap_m)
                    && !self.judgements.forbid(earlier, later)
            };
            let round = guided_closures(self.set, &self.graph, &may_match, self.config, memo)?;
            let kept = self.graph.optimise(self.set, &round.closures, self.config)?;
            let found: Vec<Closure> = round
                .closures
                .into_iter()
                .zip(kept)
                .filter(|(_, kept)| *kept)
                .map(|(closure, _)| closure)
                .collect();
            let is_settled = num_changed(&self.closures, &found) * 100 <= found.len();
            self.closures = found;
            self.tried = round.tried;
            if is_settled {
                break;
            }
        }
        Ok(())
    }

    /// Lays components over each other, the surest first, as long as one convinces.
    fn join(&mut self, memo: &mut RegistrationMemo) -> Result<(), PoseGraphError> {
        let candidates = profile_candidates(self.runs, self.set, self.config);
        let across: Vec<_> = candidates
            .into_iter()
            .filter(|candidate| {
                self.set.anchors[candidate.earlier].run_idx != self.set.anchors[candidate.later].run_idx
                    && !self.judgements.forbid(candidate.earlier, candidate.later)
            })
            .collect();
        let registered = registered_candidates(&across, self.set, self.config, memo);
        self.refused = refused_matches(&across, &registered);
        let registered: Vec<Closure> = registered.into_iter().flatten().collect();
        let mut refused: BTreeSet<(u32, u32)> = BTreeSet::new();
        loop {
            let proposals = hypotheses(&registered, self.set, &self.graph, &self.components, self.config);
            let proposal =
                proposals.into_iter().find(|proposal| !refused.contains(&(proposal.host, proposal.guest)));
            let Some(proposal) = proposal else { return Ok(()) };
            if self.try_join(&proposal, memo)? {
                refused.clear();
            } else {
                refused.insert((proposal.host, proposal.guest));
            }
        }
    }

    /// Joins two components if the joined map holds; otherwise everything stays as it was.
    fn try_join(
        &mut self,
        proposal: &Hypothesis,
        memo: &mut RegistrationMemo,
    ) -> Result<bool, PoseGraphError> {
        let before = (self.graph.clone(), self.components.clone(), self.closures.clone(), self.tried.clone());
        let is_guest = |anchor: usize| before.1[self.set.anchors[anchor].run_idx as usize] == proposal.guest;
        let is_host = |anchor: usize| before.1[self.set.anchors[anchor].run_idx as usize] == proposal.host;
        for anchor in 0..self.set.anchors.len() {
            if is_guest(anchor) {
                self.graph.poses[anchor] = proposal.host_from_guest.compose(&self.graph.poses[anchor]);
            }
        }
        for component in &mut self.components {
            if *component == proposal.guest {
                *component = proposal.host;
            }
        }
        let mut seeds = self.closures.clone();
        seeds.extend(proposal.closures.iter().copied());
        let kept = self.graph.optimise(self.set, &seeds, self.config)?;
        let num_seeds = kept[self.closures.len()..].iter().filter(|kept| **kept).count();
        if num_seeds > 0 {
            self.settle(memo)?;
        }
        let is_across = |a: usize, b: usize| (is_guest(a) && is_host(b)) || (is_guest(b) && is_host(a));
        let guest_of = |a: usize, b: usize| if is_guest(a) { a } else { b };
        let report = judge_join(&self.closures, &self.tried, self.set, &self.graph, is_across, guest_of);
        let holds = num_seeds > 0
            && report.num_anchors >= self.config.min_joining_anchors
            && report.share >= self.config.min_joining_share
            && report.worst_sd_m <= self.config.max_joining_sd_m
            && !self.judgements.contradict(&self.graph.poses, self.config.neighbour_distance_m, is_guest);
        if !holds {
            (self.graph, self.components, self.closures, self.tried) = before;
        }
        Ok(holds)
    }

    /// The finished map as values.
    fn finish(self) -> SiteMap {
        let components = renumbered(&self.components);
        let runs: Vec<MappedRun> = (0..self.runs.len())
            .map(|run_idx| MappedRun {
                component: components[run_idx],
                map_from_keyframes: spread_corrections(self.set, self.runs, run_idx, &self.graph.poses),
            })
            .collect();
        let poses: Vec<Vec<Pose2>> =
            self.runs.iter().zip(&runs).map(|(run, mapped)| place_observations(run, mapped)).collect();
        let settings = StretchSettings {
            distance_m: self.config.beside_m,
            min_gap_m: self.config.min_gap_m,
            max_observations: 25,
        };
        let index: ClosureIndex<'_> =
            self.closures.iter().map(|closure| ((closure.earlier, closure.later), closure)).collect();
        let matches = find_stretches(self.runs, &poses, &components, &settings)
            .iter()
            .map(|stretch| {
                let mut found = spatial_match(stretch, self.runs, self.set, &self.graph, &index, self.config);
                self.judgements.settle(&mut found);
                found
            })
            .collect();
        let num_components = components.iter().max().map_or(0, |last| last + 1);
        SiteMap { matches, refused: self.refused, runs, num_components }
    }
}

/// Component numbers in order of first appearance, without gaps.
fn renumbered(components: &[u32]) -> Vec<u32> {
    let mut seen: Vec<u32> = Vec::new();
    components
        .iter()
        .map(|component| {
            let known = seen.iter().position(|other| other == component);
            known.unwrap_or_else(|| {
                seen.push(*component);
                seen.len() - 1
            }) as u32
        })
        .collect()
}

/// How many pairs stand in one list and not in the other.
fn num_changed(before: &[Closure], after: &[Closure]) -> usize {
    let pairs = |closures: &[Closure]| -> BTreeSet<(usize, usize)> {
        closures.iter().map(|closure| (closure.earlier, closure.later)).collect()
    };
    pairs(before).symmetric_difference(&pairs(after)).count()
}

/// Keyframes between anchors follow the odometry; the closure error is spread along the travel.
fn spread_corrections(
    set: &AnchorSet,
    runs: &[RunRecord<'_>],
    run_idx: usize,
    poses: &[Pose2],
) -> Vec<Pose2> {
    let range = set.of_run(run_idx);
    let keyframes = runs[run_idx].keyframes;
    let mut placed = Vec::with_capacity(keyframes.len());
    let mut from = range.start;
    for (index, keyframe) in keyframes.iter().enumerate() {
        while from + 2 < range.end && set.anchors[from + 1].keyframe as usize <= index {
            from += 1;
        }
        let anchor = &set.anchors[from];
        let by_first = poses[from].compose(&anchor.run_from_anchor.between(&keyframe.run_from_robot));
        let Some(next) = set.anchors[..range.end].get(from + 1) else {
            placed.push(by_first);
            continue;
        };
        let by_next = poses[from + 1].compose(&next.run_from_anchor.between(&keyframe.run_from_robot));
        let travel_m = set.travels_m[run_idx][index];
        let share =
            ((travel_m - anchor.travel_m) / (next.travel_m - anchor.travel_m).max(1e-6)).clamp(0.0, 1.0);
        let error = by_first.between(&by_next);
        placed.push(by_first.compose(&Pose2::new(error.x * share, error.y * share, error.theta * share)));
    }
    placed
}
