//! Candidates from the text: pairs of anchors of different runs whose surroundings read alike.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use rayon::prelude::*;

use super::indices::{AnchorIdx, RunIdx};
use super::site_anchors::SiteAnchors;
use crate::geometry::Pose2;
use crate::retrieval::{ProfileCandidate, ProfileIndex, RunProfile};
use crate::text::Direction;

/// A pair of anchors that may be the same place, and how they would then lie to each other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Anchor of the earlier stretch.
    pub earlier: AnchorIdx,
    /// Anchor of the later stretch.
    pub later: AnchorIdx,
    /// The later anchor seen from the earlier one, as the stretches are aligned.
    pub predicted: Pose2,
    /// What the retrieval said; its runs are numbered in the site's own order.
    pub profile: ProfileCandidate,
}

/// Profile candidates between different runs, at most one for a pair of anchors and a direction, in order of anchors.
///
/// Every two runs are compared on their own: among the runs of many buildings those of other buildings would take the
/// few places that each window has to give. The exemplars of a body are one building, and are compared with a run together;
/// those of two bodies were compared when they were new. Of every two the best `max_candidates_per_pair` are kept.
pub(crate) fn candidates_across(site: &SiteAnchors<'_>) -> Vec<Candidate> {
    let spacing_m = site.config.retrieval.sample_spacing_m;
    let profiles: Vec<RunProfile> = site
        .runs()
        .map(|run| RunProfile::from_observations(site.record(run).observations, spacing_m))
        .collect();
    let mut hosts: Vec<Vec<RunIdx>> = Vec::new();
    for run in site.runs() {
        match hosts.last_mut().filter(|host| site.are_settled(host[0], run)) {
            Some(host) => host.push(run),
            None => hosts.push(vec![run]),
        }
    }
    let is_later = |host: &[RunIdx], later: RunIdx| site.body_of(later).is_none() && host[0] < later;
    let pairs: Vec<(&[RunIdx], RunIdx)> = site
        .runs()
        .flat_map(|later| hosts.iter().map(move |host| (host.as_slice(), later)))
        .filter(|(host, later)| is_later(host, *later))
        .collect();
    let of_pair = |&(host, later): &(&[RunIdx], RunIdx)| {
        let compared = host.iter().chain([&later]).map(|run| profiles[run.at()].clone()).collect();
        let index = ProfileIndex::build(compared, site.config.retrieval.clone());
        let found = index.all_candidates(host.len()).into_iter();
        let named = found.filter_map(|mut profile| {
            let earlier = *host.get(profile.earlier.run_idx as usize)?;
            profile.earlier.run_idx = earlier.at() as u32;
            profile.later.run_idx = later.at() as u32;
            to_anchors(site, (earlier, later), profile)
        });
        best_of_pair(named, site.config.max_candidates_per_pair)
    };
    let found: Vec<Vec<Candidate>> = pairs.par_iter().map(of_pair).collect();
    let mut found: Vec<Candidate> = found.into_iter().flatten().collect();
    found.sort_by_key(Candidate::key);
    found
}

/// Profile candidates within a run, at most one for a pair of anchors and a direction.
pub(crate) fn candidates_within(site: &SiteAnchors<'_>, run: RunIdx) -> Vec<Candidate> {
    let spacing_m = site.config.retrieval.sample_spacing_m;
    let profile = RunProfile::from_observations(site.record(run).observations, spacing_m);
    let index = ProfileIndex::build(vec![profile], site.config.retrieval.clone());
    let named = index.all_candidates(0).into_iter().filter_map(|mut profile| {
        profile.earlier.run_idx = run.at() as u32;
        profile.later.run_idx = run.at() as u32;
        to_anchors(site, (run, run), profile)
    });
    best_of_pair(named, site.config.max_candidates_per_pair)
}

impl Candidate {
    /// What it is about.
    pub fn key(&self) -> (AnchorIdx, AnchorIdx, Direction) {
        (self.later, self.earlier, self.profile.direction)
    }
}

/// The best candidate of every two anchors and direction, and of these the best few.
fn best_of_pair(candidates: impl Iterator<Item = Candidate>, num_max: usize) -> Vec<Candidate> {
    let mut best: BTreeMap<(AnchorIdx, AnchorIdx, Direction), Candidate> = BTreeMap::new();
    for candidate in candidates {
        let key = candidate.key();
        if best.get(&key).is_none_or(|other| candidate.profile.score > other.profile.score) {
            best.insert(key, candidate);
        }
    }
    let mut ranked: Vec<Candidate> = best.into_values().collect();
    ranked.sort_by(|a, b| b.profile.score.total_cmp(&a.profile.score).then(a.key().cmp(&b.key())));
    ranked.truncate(num_max);
    ranked
}

fn to_anchors(
    site: &SiteAnchors<'_>,
    (earlier_run, later_run): (RunIdx, RunIdx),
    profile: ProfileCandidate,
) -> Option<Candidate> {
    let (earlier, run_from_earlier) = site.at_middle(earlier_run, &profile.earlier)?;
    let (later, run_from_later) = site.at_middle(later_run, &profile.later)?;
    let turn = match profile.direction {
        Direction::Same => 0.0,
        Direction::Opposite => PI,
    };
    // The middles of the two stretches are one place; walk from one anchor to it and on to the other anchor.
    let to_middle = site.anchor(earlier).run_from_anchor.between(&run_from_earlier);
    let from_middle = run_from_later.between(&site.anchor(later).run_from_anchor);
    let predicted = to_middle.compose(&Pose2::new(0.0, 0.0, turn)).compose(&from_middle);
    Some(Candidate { earlier, later, predicted, profile })
}
