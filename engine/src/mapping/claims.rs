//! From the finished map to matches with their evidence.

use std::collections::BTreeMap;

use super::anchors::AnchorSet;
use super::coarse_graph::{Closure, CoarseGraph};
use super::config::MappingConfig;
use super::mapper::Refusal;
use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, Registration};
use super::run::RunRecord;
use super::stretches::Stretch;
use crate::text::{Direction, Interval, Observation};

/// Closures by their anchors.
pub(crate) type ClosureIndex<'a> = BTreeMap<(usize, usize), &'a Closure>;

/// The match that a stretch of the map amounts to.
///
/// Verified when submaps on both sides were registered and the optimised graph kept the constraint; otherwise the map
/// says so, but nothing saw it.
pub(crate) fn spatial_match(
    stretch: &Stretch,
    runs: &[RunRecord<'_>],
    set: &AnchorSet,
    graph: &CoarseGraph,
    closures: &ClosureIndex<'_>,
    config: &MappingConfig,
) -> PlaceMatch {
    let around = |interval: &Interval| {
        let run = interval.run_idx as usize;
        let middle = &runs[run].observations[((interval.first + interval.last) / 2) as usize];
        let keyframe = runs[run].keyframes.partition_point(|keyframe| keyframe.scan_seq < middle.scan_seq);
        let keyframe = keyframe.min(runs[run].keyframes.len().saturating_sub(1));
        let travel_m = set.travels_m[run].get(keyframe).copied().unwrap_or(0.0);
        let anchor = set.nearest(run, travel_m).unwrap_or(0);
        let range = set.of_run(run);
        anchor.saturating_sub(2).max(range.start)..(anchor + 3).min(range.end)
    };
    let (earlier, later) = (around(&stretch.earlier), around(&stretch.later));
    let mut supporting: Vec<&Closure> = Vec::new();
    for a in earlier {
        for b in later.clone() {
            supporting.extend(closures.get(&(a, b)).copied());
            supporting.extend(closures.get(&(b, a)).copied());
        }
    }
    let best = supporting.iter().copied().max_by(|a, b| a.fit.agreement.total_cmp(&b.fit.agreement));
    let density_correlation = density_correlation(runs, stretch);
    let (state, probability) = match best {
        Some(closure) => {
            let support = supporting.len() as f64;
            let doubt = (1.0 - closure.fit.agreement) + 0.01 * graph.chi2(closure, config).min(20.0);
            (MatchState::Verified, (1.0 - 0.2 * doubt - 0.1 / (1.0 + support)).clamp(0.5, 1.0))
        }
        None => (MatchState::Candidate, 0.3),
    };
    PlaceMatch {
        earlier: stretch.earlier,
        later: stretch.later,
        direction: stretch.direction,
        channel: Channel::Spatial,
        evidence: Evidence {
            density_correlation,
            registration: best.map(|closure| registration_of(set, closure)),
            ..Evidence::default()
        },
        probability,
        state,
    }
}

/// A registration that the map refused, as the match that it would have been.
pub(crate) fn refused_match(refusal: &Refusal, runs: &[RunRecord<'_>], set: &AnchorSet) -> PlaceMatch {
    let closure = &refusal.closure;
    let around = |anchor: usize| {
        let anchor = &set.anchors[anchor];
        let run = &runs[anchor.run_idx as usize];
        let scan_seq = run.keyframes[anchor.keyframe as usize].scan_seq;
        let last = run.observations.len().saturating_sub(1);
        let middle =
            run.observations.partition_point(|observation| observation.scan_seq < scan_seq).min(last);
        Interval {
            run_idx: anchor.run_idx,
            first: middle.saturating_sub(REFUSED_HALF_LENGTH) as u32,
            last: (middle + REFUSED_HALF_LENGTH).min(last) as u32,
        }
    };
    let is_same_way = closure.fit.earlier_from_later.theta.cos() >= 0.0;
    PlaceMatch {
        earlier: around(closure.earlier),
        later: around(closure.later),
        direction: if is_same_way { Direction::Same } else { Direction::Opposite },
        channel: refusal.channel,
        evidence: Evidence { registration: Some(registration_of(set, closure)), ..Evidence::default() },
        probability: 0.0,
        state: MatchState::Rejected(refusal.reason),
    }
}

/// Observations on either side of an anchor that a refused registration is said to be about: about a metre.
const REFUSED_HALF_LENGTH: usize = 10;

/// A closure as it is served.
pub(crate) fn registration_of(set: &AnchorSet, closure: &Closure) -> Registration {
    Registration {
        earlier_keyframe: set.anchors[closure.earlier].keyframe,
        later_keyframe: set.anchors[closure.later].keyframe,
        earlier_from_later: closure.fit.earlier_from_later,
        covariance: closure.fit.covariance.transpose().into(),
        agreement: closure.fit.agreement,
    }
}

/// Correlation of the first kernel's densities along the two stretches; none when one of them does not vary.
fn density_correlation(runs: &[RunRecord<'_>], stretch: &Stretch) -> Option<f64> {
    let density = |observation: &Observation| observation.densities.first().copied().map_or(0.0, f64::from);
    let slice = |interval: &Interval| {
        &runs[interval.run_idx as usize].observations[interval.first as usize..=interval.last as usize]
    };
    let (earlier, later) = (slice(&stretch.earlier), slice(&stretch.later));
    let num_pairs = later.len().min(earlier.len());
    if num_pairs < 5 {
        return None;
    }
    let pairs: Vec<(f64, f64)> = (0..num_pairs)
        .map(|k| {
            let a = k * (earlier.len() - 1) / (num_pairs - 1);
            let a = if stretch.direction == Direction::Same { a } else { earlier.len() - 1 - a };
            (density(&earlier[a]), density(&later[k * (later.len() - 1) / (num_pairs - 1)]))
        })
        .collect();
    let count = num_pairs as f64;
    let mean_a = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    let mean_b = pairs.iter().map(|pair| pair.1).sum::<f64>() / count;
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in &pairs {
        aa += (a - mean_a) * (a - mean_a);
        ab += (a - mean_a) * (b - mean_b);
        bb += (b - mean_b) * (b - mean_b);
    }
    (aa > 1e-6 && bb > 1e-6).then(|| ab / (aa * bb).sqrt())
}
