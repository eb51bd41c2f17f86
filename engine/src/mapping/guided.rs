//! Guided matching: whatever the graph believes to be neighbors is registered, within the graph's own uncertainty.

use std::collections::BTreeMap;

use nalgebra::Matrix3;

use super::coarse_graph::{Closure, CoarseGraph, deviation2, slack};
use super::config::MappingConfig;
use super::indices::AnchorIdx;
use super::memo::{RegistrationMemo, Request};
use super::site_anchors::SiteAnchors;
use super::watch::{MappingError, Span};
use crate::geometry::Pose2;
use crate::registration::{SearchWindow, SubmapFit};

/// A pair of anchors that the graph places near each other.
#[derive(Clone, Copy, Debug)]
struct Neighbors {
    request: Request,
    predicted: Pose2,
    covariance: Matrix3<f64>,
    place_sd_m: f64,
}

/// What one round of guided matching found.
#[derive(Clone, Debug, Default)]
pub(crate) struct GuidedRound {
    /// Fits that agree with the graph and with each other.
    pub closures: Vec<Closure>,
    /// All pairs of anchors that were looked at.
    pub tried: Vec<(AnchorIdx, AnchorIdx)>,
    /// Fits of submaps that agree, but not with the graph or with the fits around.
    pub refused: Vec<Closure>,
}

/// True when submaps of two visits agree as far as they overlap.
///
/// Between two places of one drive both must agree. Another drive may have been among people, or before the furniture
/// came: then what the one saw of the other's returns is enough.
pub(crate) fn is_fit(fit: &SubmapFit, is_one_drive: bool, config: &MappingConfig) -> bool {
    let agrees = fit.agreement >= config.min_agreement
        || (!is_one_drive && fit.one_way_agreement >= config.min_one_way_agreement);
    agrees && fit.overlap >= config.min_overlap
}

/// What registrations have said of pairs of anchors, so that a map that hardly moved asks nothing again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Looked {
    pairs: BTreeMap<(AnchorIdx, AnchorIdx), (SearchWindow, Option<SubmapFit>)>,
}

/// A narrower window than before is another question when it is narrower by more than this, metres and radians: in a
/// plain corridor the best place of a wide window need not be the best of a narrow one.
const NARROWER_M: f64 = 0.25;
const NARROWER_RAD: f64 = 0.05;

impl Looked {
    /// Takes over what others have looked at.
    pub fn extend(&mut self, other: &Self) {
        self.pairs.extend(other.pairs.iter().map(|(pair, said)| (*pair, *said)));
    }

    /// What a search of about the same window has said of a pair: a fit where the graph expects it, or that nothing
    /// fits.
    fn answer(&self, pair: &Neighbors, graph: &CoarseGraph<'_>) -> Option<Option<SubmapFit>> {
        let Request { earlier, later, window } = &pair.request;
        let (searched, fit) = self.pairs.get(&(*earlier, *later))?;
        let is_same = searched.half_m <= window.half_m + NARROWER_M
            && searched.half_turn_rad <= window.half_turn_rad + NARROWER_RAD;
        match fit {
            Some(fit) => (is_same && pair.expects(fit, graph)).then_some(Some(*fit)),
            None => (is_same && holds(searched, window)).then_some(None),
        }
    }
}

/// True when every pose of `inner` lies in `outer`.
fn holds(outer: &SearchWindow, inner: &SearchWindow) -> bool {
    let (a, b) = (&outer.center, &inner.center);
    let apart_m = (a.x - b.x).abs().max((a.y - b.y).abs());
    let apart_rad = crate::geometry::wrap_angle(a.theta - b.theta).abs();
    apart_m + inner.half_m <= outer.half_m && apart_rad + inner.half_turn_rad <= outer.half_turn_rad
}

impl Neighbors {
    /// True when a fit lies where the graph expects it.
    fn expects(&self, fit: &SubmapFit, graph: &CoarseGraph<'_>) -> bool {
        let gate = self.covariance + graph.with_floor(&fit.covariance) + slack();
        deviation2(&self.predicted, &fit.earlier_from_later, &gate) <= graph.site.config.max_chi2
    }
}

/// Registers all neighbors of one graph that may be matched, and keeps the fits that agree with it and with each other.
///
/// # Errors
/// Whatever the graph cannot solve; [`MappingError::Stopped`].
pub(crate) fn guided_round(
    graph: &CoarseGraph<'_>,
    may_match: &impl Fn(AnchorIdx, AnchorIdx) -> bool,
    looked: &mut Looked,
    memo: &RegistrationMemo,
    span: Span<'_>,
) -> Result<GuidedRound, MappingError> {
    let (site, config) = (graph.site, graph.site.config);
    let neighbors = find_neighbors(graph, may_match, span.part(0, 2))?;
    let known: Vec<Option<Option<SubmapFit>>> =
        neighbors.iter().map(|pair| looked.answer(pair, graph)).collect();
    let unknown = neighbors.iter().zip(&known).filter(|(_, known)| known.is_none());
    let requests: Vec<Request> = unknown.map(|(pair, _)| pair.request).collect();
    let mut found = memo.answers(&requests, site, span.part(1, 2))?.into_iter();
    let mut closures = Vec::new();
    let mut uncertain = Vec::new();
    let mut refused = Vec::new();
    for (pair, known) in neighbors.iter().zip(known) {
        let Request { earlier, later, window } = pair.request;
        let is_one_drive = site.run_of(earlier) == site.run_of(later);
        let is_new = known.is_none();
        let fit = known.unwrap_or_else(|| found.next().flatten());
        let fit = fit.filter(|fit| is_fit(fit, is_one_drive, config));
        if is_new {
            looked.pairs.insert((earlier, later), (window, fit));
        }
        let Some(fit) = fit else { continue };
        let closure = Closure { earlier, later, fit };
        if !pair.expects(&fit, graph) {
            refused.push(closure);
            continue;
        }
        closures.push(closure);
        uncertain.push(pair.place_sd_m > 0.5);
    }
    let is_supported = |(closure, uncertain): &(&Closure, &bool)| {
        !**uncertain || support(site, closure, &closures) >= config.min_support
    };
    let (supported, alone): (Vec<_>, Vec<_>) = closures.iter().zip(&uncertain).partition(is_supported);
    refused.extend(alone.into_iter().map(|(closure, _)| *closure));
    let closures = supported.into_iter().map(|(closure, _)| *closure).collect();
    let tried = neighbors.iter().map(|pair| (pair.request.earlier, pair.request.later)).collect();
    Ok(GuidedRound { closures, tried, refused })
}

fn find_neighbors(
    graph: &CoarseGraph<'_>,
    may_match: &impl Fn(AnchorIdx, AnchorIdx) -> bool,
    span: Span<'_>,
) -> Result<Vec<Neighbors>, MappingError> {
    let config = graph.site.config;
    let mut nearby = Nearby::new(config.neighbor_distance_m + config.max_search_m);
    let mut near_of: Vec<(AnchorIdx, Vec<AnchorIdx>)> = Vec::new();
    for (idx, &later) in graph.anchors().iter().enumerate() {
        span.done(idx, graph.anchors().len())?;
        let here = graph.pose(later);
        let distance_m = |anchor: AnchorIdx| graph.pose(anchor).distance(&here);
        let mut near = nearby.around(&here);
        near.retain(|&earlier| distance_m(earlier) < nearby.reach_m && may_match(earlier, later));
        nearby.insert(later, &here);
        let (own, others): (Vec<_>, Vec<_>) =
            near.into_iter().partition(|&earlier| graph.site.run_of(earlier) == graph.site.run_of(later));
        let mut near = nearest_of_each_pass(own, distance_m, (config.max_passes, NUM_OF_OWN_PASS));
        let of_others = (config.max_other_passes, NUM_OF_OTHER_PASS);
        near.extend(nearest_of_each_pass(others, distance_m, of_others));
        near.sort_unstable();
        if !near.is_empty() {
            near_of.push((later, near));
        }
    }
    let relatives = graph.relatives(&near_of)?;
    let mut found = Vec::new();
    for ((later, near), relatives) in near_of.into_iter().zip(relatives) {
        for (earlier, (later_from_earlier, covariance)) in near.into_iter().zip(relatives) {
            let predicted = later_from_earlier.inverse();
            // The same uncertainty, seen from the earlier anchor; the lever of the heading matters little nearby.
            let covariance = crate::registration::rotated(&covariance, predicted.theta);
            let place_sd_m = (covariance[(0, 0)] + covariance[(1, 1)]).sqrt();
            let turn_sd = covariance[(2, 2)].sqrt();
            if predicted.x.hypot(predicted.y) > config.neighbor_distance_m + 2.0 * place_sd_m {
                continue;
            }
            let window = SearchWindow {
                center: predicted,
                half_m: (3.0 * place_sd_m + 0.25).min(config.max_search_m),
                half_turn_rad: (3.0 * turn_sd + 0.05).min(config.max_search_turn_rad),
            };
            let request = Request { earlier, later, window };
            found.push(Neighbors { request, predicted, covariance, place_sd_m });
        }
    }
    Ok(found)
}

/// Anchors by where they lie, in squares as wide as one looks around.
struct Nearby {
    reach_m: f64,
    squares: BTreeMap<(i64, i64), Vec<AnchorIdx>>,
}

impl Nearby {
    fn new(reach_m: f64) -> Self {
        Self { reach_m, squares: BTreeMap::new() }
    }

    fn square(&self, pose: &Pose2) -> (i64, i64) {
        ((pose.x / self.reach_m).floor() as i64, (pose.y / self.reach_m).floor() as i64)
    }

    fn insert(&mut self, anchor: AnchorIdx, pose: &Pose2) {
        self.squares.entry(self.square(pose)).or_default().push(anchor);
    }

    /// Whatever may lie within reach, ascending.
    fn around(&self, pose: &Pose2) -> Vec<AnchorIdx> {
        let (x, y) = self.square(pose);
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        let mut near: Vec<AnchorIdx> =
            around.filter_map(|square| self.squares.get(&square)).flatten().copied().collect();
        near.sort_unstable();
        near
    }
}

/// Anchors of a pass of the same run that are registered with one …
const NUM_OF_OWN_PASS: usize = 3;
/// … and of a pass of another run.
const NUM_OF_OTHER_PASS: usize = 2;

/// Of every stretch of consecutive anchors the few that are nearest: more would say the same again. Of many stretches
/// the nearest few: a place that was passed a hundred times is known.
fn nearest_of_each_pass(
    anchors: Vec<AnchorIdx>,
    distance_m: impl Fn(AnchorIdx) -> f64,
    (num_passes_max, num_of_pass_max): (usize, usize),
) -> Vec<AnchorIdx> {
    let mut passes: Vec<Vec<AnchorIdx>> = anchors
        .chunk_by(|a, b| a.at() + 1 == b.at())
        .map(|pass| {
            let mut by_distance = pass.to_vec();
            by_distance.sort_by(|&a, &b| distance_m(a).total_cmp(&distance_m(b)).then(a.cmp(&b)));
            by_distance.truncate(num_of_pass_max);
            by_distance
        })
        .collect();
    passes.sort_by(|a, b| distance_m(a[0]).total_cmp(&distance_m(b[0])).then(a[0].cmp(&b[0])));
    passes.truncate(num_passes_max);
    passes.into_iter().flatten().collect()
}

/// How many other closures nearby along both runs say the same.
fn support(site: &SiteAnchors<'_>, closure: &Closure, all: &[Closure]) -> usize {
    let near = |a, b| site.are_near_along(a, b, 8.0);
    all.iter()
        .filter(|other| (other.earlier, other.later) != (closure.earlier, closure.later))
        .filter(|other| near(other.earlier, closure.earlier) && near(other.later, closure.later))
        .filter(|other| agrees(site, closure, other))
        .count()
}

/// True when going round the loop of two closures and the odometry between them comes back to the start.
fn agrees(site: &SiteAnchors<'_>, a: &Closure, b: &Closure) -> bool {
    let earlier_step = site.step(a.earlier, b.earlier);
    let later_step = site.step(a.later, b.later);
    let one_way = a.fit.earlier_from_later.compose(&later_step);
    let other_way = earlier_step.compose(&b.fit.earlier_from_later);
    let error = one_way.between(&other_way);
    let length_m = earlier_step.x.hypot(earlier_step.y) + later_step.x.hypot(later_step.y);
    error.x.hypot(error.y) < 0.3 + 0.03 * length_m && error.theta.abs() < 0.06 + 0.004 * length_m
}
