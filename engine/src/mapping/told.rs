//! From the numbers of exemplars and new runs, among which a map is made, to those of the runs of the site, and back.

use super::exemplar::{Exemplar, Source};
use super::place_match::{Decision, PlaceMatch};
use crate::text::Interval;

/// How exemplars and new runs, in the order in which they are told to the map builder, are named in the site.
pub(crate) struct Told {
    /// For each exemplar where it was cut from and how many observations it has.
    exemplars: Vec<(Source, u32)>,
    /// Runs of the site that are settled; the new ones follow them.
    num_settled: u32,
}

impl Told {
    /// Exemplars of all bodies, then the runs behind the settled ones.
    pub fn new<'p>(exemplars: impl Iterator<Item = &'p Exemplar>, num_settled: usize) -> Self {
        let exemplars = exemplars.map(|exemplar| (exemplar.source, exemplar.num_observations())).collect();
        Self { exemplars, num_settled: num_settled as u32 }
    }

    /// Number of exemplars.
    pub fn num_exemplars(&self) -> usize {
        self.exemplars.len()
    }

    /// A match as the site names its runs, observations and keyframes.
    pub fn named(&self, found: &PlaceMatch) -> PlaceMatch {
        let mut named = found.clone();
        named.earlier = self.interval(&found.earlier);
        named.later = self.interval(&found.later);
        if let Some(registration) = &mut named.evidence.registration {
            registration.earlier_keyframe += self.source(found.earlier.run_idx).first_keyframe;
            registration.later_keyframe += self.source(found.later.run_idx).first_keyframe;
        }
        // Exemplars are told by their bodies, so that of two bodies the later run may come first.
        if (found.earlier <= found.later) != (named.earlier <= named.later) {
            std::mem::swap(&mut named.earlier, &mut named.later);
            named.evidence.registration = named.evidence.registration.map(|seen| seen.seen_from_later());
        }
        named
    }

    /// Decisions as they concern exemplars and new runs; one on what no exemplar holds concerns none.
    pub fn decisions(&self, decisions: &[Decision]) -> Vec<Decision> {
        let mut told = Vec::new();
        for decision in decisions {
            for earlier in self.told(&decision.earlier) {
                told.extend(self.told(&decision.later).into_iter().map(|later| {
                    match (earlier <= later) == (decision.earlier <= decision.later) {
                        true => Decision { earlier, later, ..*decision },
                        false => Decision { earlier: later, later: earlier, ..*decision },
                    }
                }));
            }
        }
        told
    }

    fn source(&self, told: u32) -> Source {
        match self.exemplars.get(told as usize) {
            Some((source, _)) => *source,
            None => {
                let run = self.num_settled + told - self.exemplars.len() as u32;
                Source { run, first_observation: 0, first_keyframe: 0 }
            }
        }
    }

    fn interval(&self, told: &Interval) -> Interval {
        let Source { run, first_observation, .. } = self.source(told.run_idx);
        Interval { run_idx: run, first: told.first + first_observation, last: told.last + first_observation }
    }

    /// An interval of the site as parts of exemplars, or as one of a new run.
    fn told(&self, interval: &Interval) -> Vec<Interval> {
        let Interval { run_idx, first, last } = *interval;
        if let Some(new) = run_idx.checked_sub(self.num_settled) {
            return vec![Interval { run_idx: self.exemplars.len() as u32 + new, ..*interval }];
        }
        let within = |(place, (source, num_observations)): (usize, &(Source, u32))| {
            let start = source.first_observation;
            let is_of_it = source.run == run_idx && first < start + num_observations && last >= start;
            is_of_it.then(|| Interval {
                run_idx: place as u32,
                first: first.saturating_sub(start),
                last: (last - start).min(num_observations - 1),
            })
        };
        self.exemplars.iter().enumerate().filter_map(within).collect()
    }
}
