//! What speaks for and against a join of two components, once they are laid over each other.

use std::collections::BTreeSet;

use nalgebra::Matrix2;

use super::coarse_graph::CoarseGraph;
use super::component::{Component, Workshop};
use super::config::MappingConfig;
use super::indices::AnchorIdx;
use super::overlap::{LocalOpinions, overlap};
use crate::registration::Opinions;

/// Anchors this close lie beside each other, metres.
pub(crate) const BESIDE_M: f64 = 2.0;

/// How well a joined map holds between host and guest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JoinEvidence {
    /// Different anchors of the guest that fit.
    pub num_anchors: usize,
    /// Share of the tried guest anchors that fit anywhere.
    pub share: f64,
    /// Standard deviation of the worst direction, metres.
    pub worst_sd_m: f64,
    /// The share of the returns that the one contradicts of what the other saw wherever they overlap, whichever way is
    /// less: furniture that came or went counts only one way.
    pub one_sided_contradiction: f64,
    /// The same share between places of host or guest alone that were driven again, whichever contradicts itself less.
    pub own_contradiction: f64,
    /// Guest anchors that lie beside one of the host.
    pub num_beside: usize,
    /// True when the joined map brings together what a person said are different places.
    pub is_vetoed: bool,
}

impl JoinEvidence {
    /// Judges two components laid over each other by their closures and all pairs that were tried.
    pub fn of(
        both: &Component<'_>,
        (host, guest): (&Component<'_>, &Component<'_>),
        own_contradiction: f64,
        tried: &[(AnchorIdx, AnchorIdx)],
        workshop: Workshop<'_>,
    ) -> Self {
        let graph = &both.graph;
        let guest_of = |a: AnchorIdx, b: AnchorIdx| if guest.graph.holds(a) { a } else { b };
        let is_across = |a: AnchorIdx, b: AnchorIdx| guest.graph.holds(a) != guest.graph.holds(b);
        let fitting: Vec<_> =
            both.closures.iter().filter(|closure| is_across(closure.earlier, closure.later)).collect();
        let anchors: BTreeSet<AnchorIdx> =
            fitting.iter().map(|closure| guest_of(closure.earlier, closure.later)).collect();
        let tried: BTreeSet<AnchorIdx> = tried
            .iter()
            .filter(|(a, b)| graph.pose(*a).distance(&graph.pose(*b)) < 2.0)
            .map(|(a, b)| guest_of(*a, *b))
            .collect();
        let mut information = Matrix2::zeros();
        for closure in &fitting {
            let in_map =
                crate::registration::rotated(&closure.fit.covariance, graph.pose(closure.earlier).theta);
            let place = in_map.fixed_view::<2, 2>(0, 0).into_owned() + Matrix2::identity() * 0.01;
            information += place.try_inverse().unwrap_or_else(Matrix2::zeros);
        }
        let weakest = information.symmetric_eigenvalues().min();
        let locals = laid(graph, (host, guest), workshop);
        let near_m = graph.site.config.neighbor_distance_m;
        Self {
            num_anchors: anchors.len(),
            share: tried.intersection(&anchors).count() as f64 / tried.len().max(1) as f64,
            worst_sd_m: if weakest > 0.0 { 1.0 / weakest.sqrt() } else { f64::INFINITY },
            one_sided_contradiction: one_sided(&locals),
            own_contradiction,
            num_beside: locals.iter().filter(|local| local.nearest_m < BESIDE_M).count(),
            is_vetoed: workshop.judgements.contradict(graph, near_m, |anchor| guest.graph.holds(anchor)),
        }
    }

    /// True when the joined map may stand. Where host and guest both contradict themselves, because people crowd there or
    /// what they saw is full of small things, the two may contradict each other a little more than that.
    pub fn holds(&self, config: &MappingConfig) -> bool {
        self.num_anchors >= config.min_joining_anchors
            && self.share >= config.min_joining_share
            && self.worst_sd_m <= config.max_joining_sd_m
            && self.one_sided_contradiction <= max_contradiction(self.own_contradiction, config)
    }
}

/// What two components may contradict of each other, given what the clearer of them contradicts of itself.
pub(crate) fn max_contradiction(own: f64, config: &MappingConfig) -> f64 {
    config.max_contradiction.max(config.max_contradiction_over_own * own)
}

/// The share of the returns that host and guest contradict of each other where a graph puts them, whichever way is
/// less.
pub(crate) fn contradiction(
    graph: &CoarseGraph<'_>,
    pair: (&Component<'_>, &Component<'_>),
    workshop: Workshop<'_>,
) -> f64 {
    one_sided(&laid(graph, pair, workshop))
}

fn laid(
    graph: &CoarseGraph<'_>,
    (host, guest): (&Component<'_>, &Component<'_>),
    workshop: Workshop<'_>,
) -> Vec<LocalOpinions> {
    overlap(workshop, &graph.placed(guest.graph.anchors()), &graph.placed(host.graph.anchors()))
}

fn one_sided(locals: &[LocalOpinions]) -> f64 {
    let mut opinions = Opinions::default();
    locals.iter().for_each(|local| opinions += local.opinions);
    opinions.one_sided_contradiction()
}
