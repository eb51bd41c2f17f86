//! Runs that hang together, with the closures that hold them: they settle, and they are laid over each other.

use rayon::prelude::*;

use super::coarse_graph::{Closure, CoarseGraph};
use super::guided::{Looked, guided_round};
use super::indices::{AnchorIdx, BodyIdx, RunIdx};
use super::join_evidence::{JoinEvidence, contradiction, max_contradiction};
use super::judgements::Judgements;
use super::memo::RegistrationMemo;
use super::place_match::{Channel, RejectionReason};
use super::refusals::Refusal;
use super::site_anchors::SiteAnchors;
use super::watch::{MappingError, Span};
use super::ways::Way;
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// How often two components that are laid over each other are extended to where they run beside each other.
const NUM_EXTENSIONS: usize = 2;
/// A way is given up when the two contradict each other this many times as much as they may, before anything of it is
/// registered: wrong ways stay about as contradicted as they begin.
const HOPELESS: f64 = 2.0;

/// Runs that share a frame.
#[derive(Clone)]
pub(crate) struct Component<'a> {
    pub graph: CoarseGraph<'a>,
    /// Constraints that the graph keeps.
    pub closures: Vec<Closure>,
    /// Fits between its anchors that do not constrain it.
    pub refused: Vec<Refusal>,
    /// What is known of its pairs of anchors.
    looked: Looked,
    /// What its places said of each other when they were settled, if it holds a body of the foundation: then it is not
    /// asked again, whatever is new.
    settled: Option<Opinions>,
}

/// What stays the same while a map is being built, and which part of that is at hand.
#[derive(Clone, Copy)]
pub(crate) struct Workshop<'a> {
    pub site: &'a SiteAnchors<'a>,
    pub judgements: &'a Judgements<'a>,
    pub memo: &'a RegistrationMemo,
    pub span: Span<'a>,
}

impl Workshop<'_> {
    /// For one of equal parts of the work.
    pub fn part(self, idx: usize, num_parts: usize) -> Self {
        Self { span: self.span.part(idx, num_parts), ..self }
    }
}

impl<'a> Component<'a> {
    /// A run on its own, settled.
    ///
    /// # Errors
    /// Whatever the graph cannot solve; [`MappingError::Stopped`].
    fn alone(workshop: Workshop<'a>, run: RunIdx) -> Result<Self, MappingError> {
        let site = workshop.site;
        let pose_of = |anchor| site.anchor(anchor).run_from_anchor;
        let mut graph = CoarseGraph::new(site, vec![run], pose_of, |_| Pose2::identity())?;
        graph.optimize(&[])?;
        let mut component = Self::new(graph, None);
        component.settle(workshop)?;
        Ok(component)
    }

    /// Every run on its own, settled, apart from the foundation.
    ///
    /// # Errors
    /// Whatever the graph cannot solve; [`MappingError::Stopped`].
    pub fn all_alone(workshop: Workshop<'a>) -> Result<Vec<Self>, MappingError> {
        let driven = workshop.site.driven();
        (driven.par_iter().enumerate())
            .map(|(idx, &run)| Self::alone(workshop.part(idx, driven.len()), run))
            .collect()
    }

    /// A body of the foundation, where it lies, with what its exemplars said of each other.
    ///
    /// # Errors
    /// Poses that are not finite.
    pub fn of_body(
        site: &'a SiteAnchors<'a>,
        body: BodyIdx,
        settled: Opinions,
    ) -> Result<Self, MappingError> {
        let pose_of = |anchor| site.anchor(anchor).run_from_anchor;
        let graph = CoarseGraph::new(site, site.exemplars_of(body), pose_of, |_| Pose2::identity())?;
        Ok(Self::new(graph, Some(settled)))
    }

    fn new(graph: CoarseGraph<'a>, settled: Option<Opinions>) -> Self {
        Self { graph, closures: Vec::new(), refused: Vec::new(), looked: Looked::default(), settled }
    }

    /// Guided matching and optimization in turns, until nothing new is found.
    ///
    /// # Errors
    /// Whatever the graph cannot solve; [`MappingError::Stopped`].
    pub fn settle(&mut self, workshop: Workshop<'a>) -> Result<(), MappingError> {
        let Workshop { site, judgements, memo, span } = workshop;
        let may_match = |a, b| site.may_match(a, b) && !judgements.forbid(a, b);
        let max_rounds = site.config.max_rounds;
        for round in 0..max_rounds {
            let round =
                guided_round(&self.graph, &may_match, &mut self.looked, memo, span.part(round, max_rounds))?;
            let kept = self.graph.optimize(&round.closures)?;
            let (found, dropped) = sorted_out(round.closures, &kept);
            let refusal = |closure| Refusal {
                channel: Channel::Spatial,
                closure,
                reason: RejectionReason::Inconsistent,
            };
            self.refused = round.refused.into_iter().chain(dropped).map(refusal).collect();
            let is_settled = num_changed(&self.closures, &found) * 100 <= found.len();
            self.closures = found;
            if is_settled {
                break;
            }
        }
        Ok(())
    }

    /// Share of the returns that its places contradict where it was driven again, in the direction in which it is less;
    /// 0 when it never came back to a place.
    pub fn own_contradiction(&self, workshop: Workshop<'_>) -> f64 {
        let never_came_back = match self.settled {
            Some(settled) => settled == Opinions::default(),
            None => self.closures.is_empty(),
        };
        if never_came_back { 0.0 } else { self.own_opinions(workshop).one_sided_contradiction() }
    }

    fn own_opinions(&self, workshop: Workshop<'_>) -> Opinions {
        self.settled.unwrap_or_else(|| self.opinions(workshop))
    }

    /// What its places say of each other where closures hold them together.
    pub fn opinions(&self, workshop: Workshop<'_>) -> Opinions {
        let mut opinions = Opinions::default();
        for Closure { earlier, later, .. } in &self.closures {
            let relative = self.graph.pose(*earlier).between(&self.graph.pose(*later));
            opinions += workshop.memo.opinions(workshop.site, (*earlier, *later), &relative);
        }
        opinions
    }

    /// Two components in one frame as a way says, extended to wherever they then run beside each other, with what
    /// speaks for and against it; none when it falls apart at once, or when the two contradict each other so much
    /// that no registration will mend it. `own` is what the clearer of the two contradicts of itself.
    ///
    /// # Errors
    /// Whatever the graph cannot solve; [`MappingError::Stopped`].
    pub fn laid_over(
        (host, guest): (&Self, &Self),
        way: &Way,
        own: f64,
        workshop: Workshop<'a>,
    ) -> Result<Option<(Self, JoinEvidence)>, MappingError> {
        let mut both = Self::side_by_side(host, guest, way, workshop)?;
        let inside = [host.closures.as_slice(), &guest.closures].concat();
        let mut across = way.closures.clone();
        let mut tried = Vec::new();
        let mut looked = Looked::default();
        let is_across = |a, b| host.graph.holds(a) != host.graph.holds(b);
        let may_match = |a, b| is_across(a, b) && !workshop.judgements.forbid(a, b);
        let hopeless = HOPELESS * max_contradiction(own, workshop.site.config);
        for round in 0..=NUM_EXTENSIONS {
            let closures = [inside.as_slice(), &across].concat();
            let kept = both.graph.optimize(&closures)?;
            if !kept[inside.len()..].contains(&true) {
                return Ok(None);
            }
            if round == 0 && contradiction(&both.graph, (host, guest), workshop) > hopeless {
                return Ok(None);
            }
            if round == NUM_EXTENSIONS {
                both.closures = sorted_out(closures, &kept).0;
            } else {
                let Workshop { memo, span, .. } = workshop;
                let round = guided_round(&both.graph, &may_match, &mut looked, memo, span)?;
                (across, tried) = (round.closures, round.tried);
            }
        }
        [&host.looked, &guest.looked, &looked].into_iter().for_each(|looked| both.looked.extend(looked));
        let evidence = JoinEvidence::of(&both, (host, guest), own, &tried, workshop);
        Ok(Some((both, evidence)))
    }

    /// A body of the foundation with the runs that were laid over it, each by itself: what they were alone, and what they
    /// are with the body.
    ///
    /// # Errors
    /// Whatever the graph cannot solve.
    pub fn founded(
        body: &Self,
        guests: &[(Self, Box<Self>)],
        workshop: Workshop<'a>,
    ) -> Result<Self, MappingError> {
        let exemplar = body.graph.runs()[0];
        let of_guests = guests.iter().flat_map(|(alone, _)| alone.graph.runs());
        let runs = body.graph.runs().iter().chain(of_guests).copied().collect();
        let pose_of = |anchor: AnchorIdx| {
            let of_it = guests.iter().map(|(_, both)| &both.graph).find(|graph| graph.holds(anchor));
            of_it.map_or_else(Pose2::identity, |graph| {
                graph.pose_of_body(exemplar).between(&graph.pose(anchor))
            })
        };
        let graph =
            CoarseGraph::new(body.graph.site, runs, pose_of, |exemplar| body.graph.pose_of_body(exemplar))?;
        let mut settled = body.own_opinions(workshop);
        guests.iter().for_each(|(alone, _)| settled += alone.own_opinions(workshop));
        let mut founded = Self::new(graph, Some(settled));
        for (_, both) in guests {
            founded.closures.extend(&both.closures);
            founded.looked.extend(&both.looked);
        }
        founded.graph.optimize(&founded.closures)?;
        Ok(founded)
    }

    fn side_by_side(
        host: &Self,
        guest: &Self,
        way: &Way,
        workshop: Workshop<'a>,
    ) -> Result<Self, MappingError> {
        let runs = [host.graph.runs(), guest.graph.runs()].concat();
        let pose_of = |anchor: AnchorIdx| match host.graph.holds(anchor) {
            true => host.graph.pose(anchor),
            false => way.host_from_guest.compose(&guest.graph.pose(anchor)),
        };
        let pose_of_body = |exemplar: RunIdx| match host.graph.runs().binary_search(&exemplar) {
            Ok(_) => host.graph.pose_of_body(exemplar),
            Err(_) => way.host_from_guest.compose(&guest.graph.pose_of_body(exemplar)),
        };
        let graph = CoarseGraph::new(host.graph.site, runs, pose_of, pose_of_body)?;
        let holds_body = host.settled.is_some() || guest.settled.is_some();
        let settled = holds_body.then(|| {
            let mut opinions = host.own_opinions(workshop);
            opinions += guest.own_opinions(workshop);
            opinions
        });
        Ok(Self::new(graph, settled))
    }
}

/// Closures that were kept, and the others.
fn sorted_out(closures: Vec<Closure>, kept: &[bool]) -> (Vec<Closure>, Vec<Closure>) {
    let (kept, dropped): (Vec<_>, Vec<_>) = closures.into_iter().zip(kept).partition(|(_, kept)| **kept);
    let bare = |pairs: Vec<(Closure, &bool)>| pairs.into_iter().map(|(closure, _)| closure).collect();
    (bare(kept), bare(dropped))
}

/// How many pairs stand in one list and not in the other.
fn num_changed(before: &[Closure], after: &[Closure]) -> usize {
    let pairs = |closures: &[Closure]| -> std::collections::BTreeSet<(AnchorIdx, AnchorIdx)> {
        closures.iter().map(|closure| (closure.earlier, closure.later)).collect()
    };
    pairs(before).symmetric_difference(&pairs(after)).count()
}
