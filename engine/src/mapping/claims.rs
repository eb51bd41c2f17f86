//! From the finished map to matches with their evidence, told of the runs in the order in which they were given.

use std::collections::{BTreeMap, BTreeSet};

use super::coarse_graph::Closure;
use super::component::Component;
use super::indices::{AnchorIdx, RunIdx};
use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, Registration};
use super::refusals::Refusal;
use super::run::RunRecord;
use super::site_anchors::SiteAnchors;
use super::stretches::{Place, Stretch};
use crate::text::{Direction, Interval, Observation};

/// Closures by their anchors, with the component whose graph keeps them.
pub(crate) struct ClosureIndex<'a> {
    site: &'a SiteAnchors<'a>,
    closures: BTreeMap<(AnchorIdx, AnchorIdx), (&'a Closure, &'a Component<'a>)>,
    /// Pairs of anchors of which one lies near the one end of a closure and the other near its other end.
    near: BTreeSet<(AnchorIdx, AnchorIdx)>,
}

/// Closures up to so many anchors along from both sides of a stretch speak for it.
const NUM_ANCHORS_BESIDE: usize = 2;

impl<'a> ClosureIndex<'a> {
    /// All closures of a map.
    pub fn new(site: &'a SiteAnchors<'a>, components: &'a [Component<'a>]) -> Self {
        let of = |component: &'a Component<'a>| {
            component
                .closures
                .iter()
                .map(move |closure| ((closure.earlier, closure.later), (closure, component)))
        };
        let closures: BTreeMap<_, _> = components.iter().flat_map(of).collect();
        let mut near = BTreeSet::new();
        for (earlier, later) in closures.keys() {
            for a in site.beside(*earlier, NUM_ANCHORS_BESIDE).map(AnchorIdx::new) {
                near.extend(site.beside(*later, NUM_ANCHORS_BESIDE).map(|b| (a, AnchorIdx::new(b))));
            }
        }
        Self { site, closures, near }
    }

    /// True when two places, told by run and observation, were registered with each other or right beside.
    pub fn is_registered(&self, a: Place, b: Place) -> bool {
        let anchor = |(run, observation): Place| {
            let run = self.site.run_told(run as usize)?;
            self.site.nearest(run, self.site.travel_at(run, observation)?)
        };
        let pair = anchor(a).zip(anchor(b));
        pair.is_some_and(|(a, b)| self.near.contains(&(a, b)) || self.near.contains(&(b, a)))
    }

    /// The match that a stretch of the map amounts to.
    ///
    /// Verified when submaps on both sides were registered and the optimized graph kept the constraint; otherwise the
    /// map says so, but nothing saw it.
    pub fn spatial_match(&self, stretch: &Stretch, told: &[RunRecord<'_>]) -> PlaceMatch {
        let supporting = self.supporting(stretch);
        let best = supporting.iter().max_by(|a, b| a.0.fit.agreement.total_cmp(&b.0.fit.agreement));
        let (state, probability) = match best {
            Some((closure, component)) => {
                let support = supporting.len() as f64;
                let doubt = (1.0 - closure.fit.agreement) + 0.01 * component.graph.chi2(closure).min(20.0);
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
                density_correlation: density_correlation(told, stretch),
                registration: best.map(|(closure, _)| registration_of(self.site, closure)),
                ..Evidence::default()
            },
            probability,
            state,
        }
    }

    /// Closures between anchors around the middles of both sides of a stretch.
    fn supporting(&self, stretch: &Stretch) -> Vec<(&'a Closure, &'a Component<'a>)> {
        let around = |interval: &Interval| {
            let run = self.site.run_told(interval.run_idx as usize)?;
            let (anchor, _) = self.site.at_middle(run, interval)?;
            Some(self.site.beside(anchor, NUM_ANCHORS_BESIDE))
        };
        let (Some(earlier), Some(later)) = (around(&stretch.earlier), around(&stretch.later)) else {
            return Vec::new();
        };
        let mut supporting = Vec::new();
        for a in earlier.map(AnchorIdx::new) {
            for b in later.clone().map(AnchorIdx::new) {
                supporting.extend(self.closures.get(&(a, b)).copied());
                supporting.extend(self.closures.get(&(b, a)).copied());
            }
        }
        supporting
    }
}

/// A registration that the map refused, as the match that it would have been.
pub(crate) fn refused_match(refusal: &Refusal, site: &SiteAnchors<'_>) -> PlaceMatch {
    let closure = &refusal.closure;
    let around = |anchor: AnchorIdx| {
        let run = site.record(site.run_of(anchor));
        let scan_seq = run.keyframes[site.anchor(anchor).keyframe.at()].scan_seq;
        let last = run.observations.len().saturating_sub(1);
        let middle =
            run.observations.partition_point(|observation| observation.scan_seq < scan_seq).min(last);
        Interval {
            run_idx: site.told(site.run_of(anchor)) as u32,
            first: middle.saturating_sub(REFUSED_HALF_LENGTH) as u32,
            last: (middle + REFUSED_HALF_LENGTH).min(last) as u32,
        }
    };
    let is_same_way = closure.fit.earlier_from_later.theta.cos() >= 0.0;
    let (first, second) = in_told_order(site, closure);
    PlaceMatch {
        earlier: around(first),
        later: around(second),
        direction: if is_same_way { Direction::Same } else { Direction::Opposite },
        channel: refusal.channel,
        evidence: Evidence { registration: Some(registration_of(site, closure)), ..Evidence::default() },
        probability: 0.0,
        state: MatchState::Rejected(refusal.reason),
    }
}

/// Observations on either side of an anchor that a refused registration is said to be about: about a metre.
const REFUSED_HALF_LENGTH: usize = 10;

/// Anchors of a closure, that of the run listed first or of what was driven first before the other.
fn in_told_order(site: &SiteAnchors<'_>, closure: &Closure) -> (AnchorIdx, AnchorIdx) {
    let place = |anchor: AnchorIdx| {
        let run: RunIdx = site.run_of(anchor);
        (site.told(run), anchor)
    };
    let (a, b) = (closure.earlier, closure.later);
    if place(a) <= place(b) { (a, b) } else { (b, a) }
}

/// A closure as it is served.
fn registration_of(site: &SiteAnchors<'_>, closure: &Closure) -> Registration {
    let fit = &closure.fit;
    let registered = Registration {
        earlier_keyframe: site.anchor(closure.earlier).keyframe.number(),
        later_keyframe: site.anchor(closure.later).keyframe.number(),
        earlier_from_later: fit.earlier_from_later,
        covariance: fit.covariance.transpose().into(),
        agreement: fit.agreement,
    };
    match in_told_order(site, closure).0 == closure.earlier {
        true => registered,
        false => registered.seen_from_later(),
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
