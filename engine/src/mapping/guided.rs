//! Guided matching: whatever the graph believes to be neighbours is registered, within the graph's own uncertainty.

use nalgebra::Matrix3;

use super::anchors::AnchorSet;
use super::coarse_graph::{Closure, CoarseGraph, deviation2, slack, with_floor};
use super::config::MappingConfig;
use super::memo::{RegistrationMemo, Request};
use super::watch::{MappingError, Span};
use crate::geometry::Pose2;
use crate::registration::SearchWindow;

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
    /// All pairs of anchors that were registered.
    pub tried: Vec<(usize, usize)>,
    /// Fits of submaps that agree, but not with the graph or with the fits around.
    pub refused: Vec<Closure>,
}

/// Registers all neighbours of one graph that may be matched, and keeps the fits that agree with it and with each other.
///
/// # Errors
/// Whatever the graph cannot solve; [`MappingError::Stopped`].
pub(crate) fn guided_closures(
    set: &AnchorSet,
    graph: &CoarseGraph,
    may_match: &impl Fn(usize, usize) -> bool,
    config: &MappingConfig,
    memo: &mut RegistrationMemo,
    span: Span<'_>,
) -> Result<GuidedRound, MappingError> {
    let neighbors = find_neighbors(set, graph, may_match, config, span.part(0, 2))?;
    let requests: Vec<Request> = neighbors.iter().map(|pair| pair.request).collect();
    let fits = memo.answers(&requests, set, &config.submap, span.part(1, 2))?;
    let mut closures = Vec::new();
    let mut uncertain = Vec::new();
    let mut refused = Vec::new();
    for (pair, fit) in neighbors.iter().zip(fits) {
        let Some(fit) = fit else { continue };
        if fit.agreement < config.min_agreement || fit.overlap < config.min_overlap {
            continue;
        }
        let closure = Closure { earlier: pair.request.earlier, later: pair.request.later, fit };
        let gate = pair.covariance + with_floor(&fit.covariance, config) + slack();
        if deviation2(&pair.predicted, &fit.earlier_from_later, &gate) > config.max_chi2 {
            refused.push(closure);
            continue;
        }
        closures.push(closure);
        uncertain.push(pair.place_sd_m > 0.5);
    }
    let is_supported = |(closure, uncertain): &(&Closure, &bool)| {
        !**uncertain || support(set, closure, &closures) >= config.min_support
    };
    let (supported, alone): (Vec<_>, Vec<_>) = closures.iter().zip(&uncertain).partition(is_supported);
    refused.extend(alone.into_iter().map(|(closure, _)| *closure));
    let supported = supported.into_iter().map(|(closure, _)| *closure).collect();
    let tried = requests.iter().map(|request| (request.earlier, request.later)).collect();
    Ok(GuidedRound { closures: supported, tried, refused })
}

fn find_neighbors(
    set: &AnchorSet,
    graph: &CoarseGraph,
    may_match: &impl Fn(usize, usize) -> bool,
    config: &MappingConfig,
    span: Span<'_>,
) -> Result<Vec<Neighbors>, MappingError> {
    let reach_m = config.neighbor_distance_m + config.max_search_m;
    let mut solver = graph.covariances()?;
    let mut found = Vec::new();
    for later in 0..set.anchors.len() {
        span.done(later, set.anchors.len())?;
        let near: Vec<usize> = (0..later)
            .filter(|&earlier| {
                may_match(earlier, later) && graph.poses[earlier].distance(&graph.poses[later]) < reach_m
            })
            .collect();
        let near = nearest_of_each_pass(&near, |earlier| graph.poses[earlier].distance(&graph.poses[later]));
        let relatives = solver.relative_to_many(later as u32, &near)?;
        for (&earlier, (later_from_earlier, covariance)) in near.iter().zip(relatives) {
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
            let request = Request { earlier: earlier as usize, later, window };
            found.push(Neighbors { request, predicted, covariance, place_sd_m });
        }
    }
    Ok(found)
}

/// Of every stretch of consecutive anchors the three that are nearest: more would say the same again.
fn nearest_of_each_pass(anchors: &[usize], distance_m: impl Fn(usize) -> f64) -> Vec<u32> {
    let mut chosen = Vec::new();
    for pass in anchors.chunk_by(|a, b| a + 1 == *b) {
        let mut by_distance: Vec<usize> = pass.to_vec();
        by_distance.sort_by(|&a, &b| distance_m(a).total_cmp(&distance_m(b)).then(a.cmp(&b)));
        by_distance.truncate(3);
        by_distance.sort_unstable();
        chosen.extend(by_distance.into_iter().map(|anchor| anchor as u32));
    }
    chosen
}

/// How many other closures nearby along both runs say the same.
fn support(set: &AnchorSet, closure: &Closure, all: &[Closure]) -> usize {
    let near = |a: usize, b: usize| {
        let (a, b) = (&set.anchors[a], &set.anchors[b]);
        a.run_idx == b.run_idx && (a.travel_m - b.travel_m).abs() <= 8.0
    };
    all.iter()
        .filter(|other| (other.earlier, other.later) != (closure.earlier, closure.later))
        .filter(|other| near(other.earlier, closure.earlier) && near(other.later, closure.later))
        .filter(|other| agrees(set, closure, other))
        .count()
}

/// True when going round the loop of two closures and the odometry between them comes back to the start.
fn agrees(set: &AnchorSet, a: &Closure, b: &Closure) -> bool {
    let earlier_step = step(set, a.earlier, b.earlier);
    let later_step = step(set, a.later, b.later);
    let one_way = a.fit.earlier_from_later.compose(&later_step);
    let other_way = earlier_step.compose(&b.fit.earlier_from_later);
    let error = one_way.between(&other_way);
    let length_m = earlier_step.x.hypot(earlier_step.y) + later_step.x.hypot(later_step.y);
    error.x.hypot(error.y) < 0.3 + 0.03 * length_m && error.theta.abs() < 0.06 + 0.004 * length_m
}

fn step(set: &AnchorSet, from: usize, to: usize) -> Pose2 {
    set.anchors[from].run_from_anchor.between(&set.anchors[to].run_from_anchor)
}
