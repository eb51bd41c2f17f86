//! From runs to one map, the conductor.

use std::collections::{BTreeMap, BTreeSet};

use super::anchors::AnchorSet;
use super::candidates::candidates_across;
use super::claims::{ClosureIndex, refused_match, spatial_match};
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::guided::guided_closures;
use super::joining::{Hypothesis, JoinReport, hypotheses, judge_join, registered_candidates};
use super::judgements::Judgements;
use super::memo::RegistrationMemo;
use super::overlap::{overlap, own_opinions};
use super::place_match::{Channel, Decision, PlaceMatch, RejectionReason};
use super::placement::place_observations;
use super::refused::refused_matches;
use super::run::RunRecord;
use super::site_map::{MappedRun, SiteMap};
use super::stretches::{StretchSettings, find_stretches};
use super::watch::{MapStage, MappingError, Span, Watch};
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// Builds the map of a site.
///
/// # Errors
/// Whatever the pose graph cannot solve.
pub fn map_site(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    decisions: &[Decision],
    memo: &mut RegistrationMemo,
) -> Result<SiteMap, MappingError> {
    map_site_watched(config, runs, decisions, memo, Watch::nobody())
}

/// Builds the map of a site while somebody watches how far it is, who may end it. What was registered until then is
/// remembered.
///
/// # Errors
/// Whatever the pose graph cannot solve; [`MappingError::Stopped`].
pub fn map_site_watched(
    config: &MappingConfig,
    runs: &[RunRecord<'_>],
    decisions: &[Decision],
    memo: &mut RegistrationMemo,
    watch: Watch<'_>,
) -> Result<SiteMap, MappingError> {
    memo.prepare(&config.submap);
    let set = AnchorSet::build(runs, config);
    if set.anchors.is_empty() {
        return Ok(SiteMap::default());
    }
    let judgements = Judgements::new(decisions, runs, &set, config.submap_half_length_m);
    let mut mapper = Mapper::new(config, runs, &set, &judgements)?;
    mapper.settle(memo, watch.stage(MapStage::Settling))?;
    if runs.len() > 1 {
        mapper.join(memo, watch.stage(MapStage::Joining))?;
    }
    Ok(mapper.finish())
}

/// The map while it is being built.
struct Mapper<'a> {
    config: &'a MappingConfig,
    runs: &'a [RunRecord<'a>],
    set: &'a AnchorSet,
    judgements: &'a Judgements<'a>,
    draft: Draft,
    has_joined: bool,
    /// Candidates whose submaps do not fit.
    unfit: Vec<PlaceMatch>,
}

/// What changes while the map is being built.
#[derive(Clone)]
struct Draft {
    /// Component of each run.
    components: Vec<u32>,
    graph: CoarseGraph,
    /// Constraints that the graph keeps.
    closures: Vec<Closure>,
    /// Pairs of anchors that the latest round registered.
    tried: Vec<(usize, usize)>,
    /// Fits that do not constrain the map.
    refused: Vec<Refusal>,
}

/// A fit that does not constrain the map.
#[derive(Clone, Copy)]
pub(crate) struct Refusal {
    /// What found it.
    pub channel: Channel,
    /// The fit.
    pub closure: Closure,
    /// Why it does not.
    pub reason: RejectionReason,
}

impl<'a> Mapper<'a> {
    fn new(
        config: &'a MappingConfig,
        runs: &'a [RunRecord<'a>],
        set: &'a AnchorSet,
        judgements: &'a Judgements<'a>,
    ) -> Result<Self, MappingError> {
        let mut graph = CoarseGraph::new(set, runs, config);
        graph.optimize(set, &[], config)?;
        let components = (0..runs.len() as u32).collect();
        let draft = Draft { components, graph, closures: Vec::new(), tried: Vec::new(), refused: Vec::new() };
        Ok(Self { config, runs, set, judgements, draft, has_joined: false, unfit: Vec::new() })
    }

    /// Guided matching and optimisation in turns, until nothing new is found.
    fn settle(&mut self, memo: &mut RegistrationMemo, span: Span<'_>) -> Result<(), MappingError> {
        for round in 0..self.config.max_rounds {
            let span = span.part(round, self.config.max_rounds);
            let may_match = |earlier: usize, later: usize| {
                self.draft.components[self.set.anchors[earlier].run_idx as usize]
                    == self.draft.components[self.set.anchors[later].run_idx as usize]
                    && self.set.may_match(earlier, later, self.config.min_gap_m)
                    && !self.judgements.forbid(earlier, later)
            };
            let round = guided_closures(self.set, &self.draft.graph, &may_match, self.config, memo, span)?;
            let kept = self.draft.graph.optimize(self.set, &round.closures, self.config)?;
            let (found, dropped) = sorted_out(round.closures, &kept);
            let refused = round.refused.into_iter().chain(dropped);
            let refusal = |closure| Refusal {
                channel: Channel::Spatial,
                closure,
                reason: RejectionReason::Inconsistent,
            };
            self.draft.refused = refused.map(refusal).collect();
            let is_settled = num_changed(&self.draft.closures, &found) * 100 <= found.len();
            self.draft.closures = found;
            self.draft.tried = round.tried;
            if is_settled {
                break;
            }
        }
        Ok(())
    }

    /// Lays components over each other, the surest first, as long as one convinces.
    fn join(&mut self, memo: &mut RegistrationMemo, span: Span<'_>) -> Result<(), MappingError> {
        let across: Vec<_> = candidates_across(self.runs, self.set, self.config)
            .into_iter()
            .filter(|candidate| !self.judgements.forbid(candidate.earlier, candidate.later))
            .collect();
        let registered = registered_candidates(&across, self.set, self.config, memo, span.part(0, 3))?;
        self.unfit = refused_matches(&across, &registered);
        let registered: Vec<Closure> = registered.into_iter().flatten().collect();
        let mut refusals: BTreeMap<(u32, u32), RejectionReason> = BTreeMap::new();
        let mut proposals = self.proposals(&registered, &|_, _| true)?;
        let mut num_proposals = proposals.len();
        while let Some(rivals) = proposals.pop() {
            let num_left = proposals.len() + 1;
            num_proposals = num_proposals.max(num_left);
            let laying = span.part(1, 3).part(num_proposals - num_left, num_proposals);
            let (host, guest) = (rivals[0].host, rivals[0].guest);
            if let Some(reason) = self.try_join(&rivals, memo, laying)? {
                refusals.insert((host, guest), reason);
                continue;
            }
            // Every pair that one of the two belongs to is another question now.
            proposals.retain(|rivals| [host, guest].iter().all(|&joined| !rivals[0].is_about(joined)));
            proposals.extend(self.proposals(&registered, &|a, b| a == host || b == host)?);
            proposals.sort_by_key(|rivals| rivals[0].rank());
            refusals.retain(|&(a, b), _| a != host && b != host && a != guest && b != guest);
            self.has_joined = true;
        }
        if self.has_joined {
            self.settle(memo, span.part(2, 3))?;
        }
        self.refuse_across(&registered, &refusals);
        Ok(())
    }

    /// Ways to join every two components that are wanted, the surest last.
    fn proposals(
        &self,
        registered: &[Closure],
        is_wanted: &dyn Fn(u32, u32) -> bool,
    ) -> Result<Vec<Vec<Hypothesis>>, MappingError> {
        let Draft { graph, components, .. } = &self.draft;
        let mut found = hypotheses(registered, self.set, graph, components, is_wanted, self.config)?;
        found.sort_by_key(|rivals| rivals[0].rank());
        Ok(found)
    }

    /// Lists the registrations between runs that the finished map does not bear out.
    fn refuse_across(&mut self, registered: &[Closure], refusals: &BTreeMap<(u32, u32), RejectionReason>) {
        let component = |anchor: usize| self.draft.components[self.set.anchors[anchor].run_idx as usize];
        let refusal = |closure: &Closure| {
            let (a, b) = (component(closure.earlier), component(closure.later));
            let is_refused = a != b || self.draft.graph.chi2(closure, self.config) > self.config.max_chi2;
            let reason =
                refusals.get(&(a.min(b), a.max(b))).copied().unwrap_or(RejectionReason::Inconsistent);
            is_refused.then_some(Refusal { channel: Channel::Profile, closure: *closure, reason })
        };
        let refused: Vec<Refusal> = registered.iter().filter_map(refusal).collect();
        self.draft.refused.extend(refused);
    }

    /// Joins two components if one of the ways to do so holds and no other holds nearly as well; otherwise everything
    /// stays as it was, and the answer is the reason.
    fn try_join(
        &mut self,
        rivals: &[Hypothesis],
        memo: &mut RegistrationMemo,
        span: Span<'_>,
    ) -> Result<Option<RejectionReason>, MappingError> {
        let before = self.draft.clone();
        let mut holding: Vec<(JoinReport, Draft)> = Vec::new();
        for (idx, hypothesis) in rivals.iter().enumerate() {
            let report = self.lay_over(hypothesis, memo, span.part(idx, rivals.len()))?;
            let draft = std::mem::replace(&mut self.draft, before.clone());
            if let Some(report) = report.filter(|report| report.holds(self.config)) {
                holding.push((report, draft));
            }
        }
        holding.sort_by_key(|(report, _)| std::cmp::Reverse(report.num_anchors));
        let mut holding = holding.into_iter();
        let Some((best, mut draft)) = holding.next() else { return Ok(Some(RejectionReason::Inconsistent)) };
        if best.is_vetoed {
            return Ok(Some(RejectionReason::Vetoed));
        }
        let is_rival = |(other, rival): (JoinReport, Draft)| {
            other.num_anchors as f64 > self.config.max_ambiguity * best.num_anchors as f64
                && differ(&draft, &rival, self.set, (rivals[0].host, rivals[0].guest), &before.components)
        };
        if holding.any(is_rival) {
            return Ok(Some(RejectionReason::Ambiguous));
        }
        draft.graph.assemble(self.set, &draft.closures, self.config)?;
        self.draft = draft;
        Ok(None)
    }

    /// Lays the guest over the host as the hypothesis says, extends it to wherever the two then run beside each other,
    /// and reports how well that holds; none when it falls apart at once.
    fn lay_over(
        &mut self,
        hypothesis: &Hypothesis,
        memo: &mut RegistrationMemo,
        span: Span<'_>,
    ) -> Result<Option<JoinReport>, MappingError> {
        let of_component = |component: u32| -> Vec<usize> {
            (0..self.set.anchors.len())
                .filter(|&anchor| {
                    self.draft.components[self.set.anchors[anchor].run_idx as usize] == component
                })
                .collect()
        };
        let (hosts, guests) = (of_component(hypothesis.host), of_component(hypothesis.guest));
        for &anchor in &guests {
            let pose = &mut self.draft.graph.poses[anchor];
            *pose = hypothesis.host_from_guest.compose(pose);
        }
        for component in &mut self.draft.components {
            if *component == hypothesis.guest {
                *component = hypothesis.host;
            }
        }
        let is_guest = |anchor: usize| guests.binary_search(&anchor).is_ok();
        let is_host = |anchor: usize| hosts.binary_search(&anchor).is_ok();
        let is_across = |a: usize, b: usize| (is_guest(a) && is_host(b)) || (is_guest(b) && is_host(a));
        let is_in_scope = |anchor: usize| is_guest(anchor) || is_host(anchor);
        let (inside, outside): (Vec<Closure>, Vec<Closure>) =
            self.draft.closures.iter().partition(|closure| is_in_scope(closure.earlier));
        let mut across = hypothesis.closures.clone();
        for is_last in [false, false, true] {
            let closures = [inside.as_slice(), across.as_slice()].concat();
            let kept = self.draft.graph.optimize_within(self.set, &closures, &is_in_scope, self.config)?;
            if !kept[inside.len()..].contains(&true) {
                return Ok(None);
            }
            if is_last {
                self.draft.closures = [outside.as_slice(), &sorted_out(closures, &kept).0].concat();
                break;
            }
            let may_match = |a: usize, b: usize| is_across(a, b) && !self.judgements.forbid(a, b);
            let round = guided_closures(self.set, &self.draft.graph, &may_match, self.config, memo, span)?;
            (across, self.draft.tried) = (round.closures, round.tried);
        }
        let guest_of = |a: usize, b: usize| if is_guest(a) { a } else { b };
        let mut report = judge_join(
            &self.draft.closures,
            &self.draft.tried,
            self.set,
            &self.draft.graph,
            is_across,
            guest_of,
        );
        let poses = &self.draft.graph.poses;
        let opinions = overlap(self.set, poses, &guests, &hosts);
        report.contradiction = opinions.all().contradiction();
        report.one_sided_contradiction =
            opinions.of_later.contradiction().min(opinions.of_earlier.contradiction());
        report.own_contradiction = self.own_contradiction(&guests).max(self.own_contradiction(&hosts));
        report.is_vetoed = self.judgements.contradict(poses, self.config.neighbor_distance_m, is_guest);
        Ok(Some(report))
    }

    /// How much the runs to which these anchors belong contradict themselves.
    fn own_contradiction(&self, anchors: &[usize]) -> f64 {
        let runs: BTreeSet<u32> = anchors.iter().map(|&anchor| self.set.anchors[anchor].run_idx).collect();
        let mut all = Opinions::default();
        for run_idx in runs {
            all += own_opinions(self.set, run_idx as usize, self.config.submap_half_length_m);
        }
        all.all().contradiction()
    }

    /// The finished map as values.
    fn finish(self) -> SiteMap {
        let components = renumbered(&self.draft.components);
        let runs: Vec<MappedRun> = (0..self.runs.len())
            .map(|run_idx| MappedRun {
                component: components[run_idx],
                map_from_keyframes: spread_corrections(self.set, self.runs, run_idx, &self.draft.graph.poses),
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
            self.draft.closures.iter().map(|closure| ((closure.earlier, closure.later), closure)).collect();
        let matches = find_stretches(self.runs, &poses, &components, &settings)
            .iter()
            .map(|stretch| {
                let mut found =
                    spatial_match(stretch, self.runs, self.set, &self.draft.graph, &index, self.config);
                self.judgements.settle(&mut found);
                found
            })
            .collect();
        let num_components = components.iter().max().map_or(0, |last| last + 1);
        let as_match = |refusal: &Refusal| {
            let mut refused = refused_match(refusal, self.runs, self.set);
            self.judgements.settle(&mut refused);
            refused
        };
        let refused = self.draft.refused.iter().map(as_match).chain(self.unfit).collect();
        SiteMap { matches, refused, runs, num_components }
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

/// True when two joined maps put the guest at different places.
fn differ(a: &Draft, b: &Draft, set: &AnchorSet, (host, guest): (u32, u32), components: &[u32]) -> bool {
    let first_of = |component: u32| {
        (0..set.anchors.len()).find(|&anchor| components[set.anchors[anchor].run_idx as usize] == component)
    };
    let (Some(host), Some(guest)) = (first_of(host), first_of(guest)) else { return false };
    let relative = |draft: &Draft| draft.graph.poses[host].between(&draft.graph.poses[guest]);
    let difference = relative(a).between(&relative(b));
    difference.x.hypot(difference.y) > 1.0 || difference.theta.abs() > 0.2
}

/// Closures that were kept, and the others.
fn sorted_out(closures: Vec<Closure>, kept: &[bool]) -> (Vec<Closure>, Vec<Closure>) {
    let (kept, dropped): (Vec<_>, Vec<_>) = closures.into_iter().zip(kept).partition(|(_, kept)| **kept);
    let bare = |pairs: Vec<(Closure, &bool)>| pairs.into_iter().map(|(closure, _)| closure).collect();
    (bare(kept), bare(dropped))
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
