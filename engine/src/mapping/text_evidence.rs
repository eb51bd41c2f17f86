//! What the texts say of a finished map: the worth of every match in bits, and what words alone would have claimed.
//!
//! The map is made of registrations; its matches are short stretches. The text around such a stretch speaks for it
//! through the most surprising chain of matching words that passes through it. Chains that pass through no match are
//! claims of the text that the map does not share: they are listed too, each with the first stage that refuses it.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::place_match::{Channel, Evidence, MatchState, PlaceMatch, RejectionReason};
use super::placement::place_observations;
use super::run::RunRecord;
use super::site_map::SiteMap;
use crate::geometry::Pose2;
use crate::index::{Lattice, WordTolerance};
use crate::matching::{
    Chain, ChainEvidence, MatchingConfig, ObservationPair, RunMatch, TextStatistics, claimed_pairs, match_run,
};
use crate::text::{Direction, Interval};

/// Claims of the text that are listed beside the map's own, the most surprising first.
pub(crate) const NUM_CLAIMS_MAX: usize = 200;
/// Driven shapes that differ by more are not the same place, metres.
const SHAPE_RESIDUAL_MAX_M: f64 = 1.0;
/// Density profiles that correlate less are not the same place.
const CORRELATION_MIN: f64 = 0.5;
/// Places that the map puts farther apart are different ones, metres.
const APART_MIN_M: f64 = 3.0;

/// Adds bits, E-value and shape to every match of a map and every refused candidate, and the claims of the text that the map does not share.
///
/// Runs, map and texts must belong together.
pub fn weigh_texts(runs: &[RunRecord<'_>], map: &mut SiteMap, config: &MatchingConfig) {
    weigh_new_texts(runs, 0, map, config);
}

/// As [`weigh_texts`], where what the first `num_known` runs say of each other was weighed before.
pub(crate) fn weigh_new_texts(
    runs: &[RunRecord<'_>],
    num_known: usize,
    map: &mut SiteMap,
    config: &MatchingConfig,
) {
    let texts: Vec<Lattice> =
        runs.iter().map(|run| Lattice::from_words(run.words).unwrap_or_default()).collect();
    let max_level = config.min_chain_words.len().saturating_sub(1);
    let statistics = TextStatistics::new(&texts, max_level, config.tolerance);
    let all = MatchingConfig { max_chance_matches: f64::INFINITY, ..config.clone() };
    let mut chains: Vec<RunMatch> =
        (num_known..runs.len()).flat_map(|run| match_run(&texts, run, &statistics, &all)).collect();
    chains.sort_by(surprise);
    let site = Site { runs, texts: &texts, statistics: &statistics, tolerance: config.tolerance };
    let index = index_of(&chains);
    for found in map.matches.iter_mut().chain(&mut map.refused) {
        site.weigh(found, &index);
    }
    let claims = site.claims(&chains, map, config.max_chance_matches);
    map.matches.extend(claims);
}

/// The least expected first, then by place.
fn surprise(a: &RunMatch, b: &RunMatch) -> Ordering {
    let place = |found: &RunMatch| (found.later, found.earlier, found.chain.direction, found.chain.max_level);
    (a.evidence.expected_chance_matches.total_cmp(&b.evidence.expected_chance_matches))
        .then_with(|| place(a).cmp(&place(b)))
}

/// Chains by their runs and direction, the most surprising first.
type ChainIndex<'a> = BTreeMap<(u32, u32, Direction), Vec<&'a RunMatch>>;

fn index_of(chains: &[RunMatch]) -> ChainIndex<'_> {
    let mut index = ChainIndex::new();
    for found in chains {
        let key = (found.earlier.run_idx, found.later.run_idx, found.chain.direction);
        index.entry(key).or_default().push(found);
    }
    index
}

/// A site's texts with all that judges them.
struct Site<'a> {
    runs: &'a [RunRecord<'a>],
    texts: &'a [Lattice],
    statistics: &'a TextStatistics,
    tolerance: WordTolerance,
}

impl Site<'_> {
    /// Gives a match the evidence of the text around it.
    fn weigh(&self, found: &mut PlaceMatch, index: &ChainIndex<'_>) {
        let key = (found.earlier.run_idx, found.later.run_idx, found.direction);
        let around = index.get(&key).into_iter().flatten().find(|chain| self.passes_through(chain, found));
        if let Some(chain) = around {
            found.evidence.bits = chain.evidence.bits;
            found.evidence.expected_chance_matches = chain.evidence.expected_chance_matches;
            found.evidence.shape_residual_m = self.shape_residual_m(&self.pairs_of(chain), chain);
            return;
        }
        let worth = self.single_words(found);
        found.evidence.bits = worth.bits;
        found.evidence.expected_chance_matches = worth.expected_chance_matches;
    }

    /// Whether a pair of matching words of a chain lies in both stretches.
    fn passes_through(&self, chain: &RunMatch, found: &PlaceMatch) -> bool {
        chain.earlier.overlaps(&found.earlier)
            && chain.later.overlaps(&found.later)
            && chain.chain.pairs.iter().any(|(earlier, later)| {
                let spans = (self.text(&found.earlier).observations_of(*earlier))
                    .zip(self.text(&found.later).observations_of(*later));
                spans.is_some_and(|(earlier, later)| {
                    touches(&found.earlier, earlier) && touches(&found.later, later)
                })
            })
    }

    /// The worth of the best pair of single words in the two stretches; of nothing when none match.
    fn single_words(&self, found: &PlaceMatch) -> ChainEvidence {
        let (earlier, later) = (self.text(&found.earlier), self.text(&found.later));
        let mut best = self.statistics.evidence_of_nothing(later);
        for later_node in nodes_in(later, &found.later) {
            let Some(word) = later.word_ending_at(later_node, 0) else { continue };
            let as_read = if found.direction == Direction::Same { word } else { word.reversed() };
            let window = self.tolerance.window(&as_read);
            for earlier_node in nodes_in(earlier, &found.earlier) {
                if !earlier.word_ending_at(earlier_node, 0).is_some_and(|word| window.contains(&word)) {
                    continue;
                }
                let ids = earlier.id_ending_at(earlier_node, 0).zip(later.id_ending_at(later_node, 0));
                let pairs = ids.into_iter().collect();
                let chain = Chain { pairs, direction: found.direction, max_level: 0 };
                if let Some(worth) = self.statistics.evidence(&chain, later)
                    && worth.bits > best.bits
                {
                    best = worth;
                }
            }
        }
        best
    }

    /// The most surprising chains that pass through no match of the map, with what speaks against them.
    fn claims(&self, chains: &[RunMatch], map: &SiteMap, max_chance_matches: f64) -> Vec<PlaceMatch> {
        let poses: Vec<Vec<Pose2>> =
            self.runs.iter().zip(&map.runs).map(|(run, mapped)| place_observations(run, mapped)).collect();
        let mut claims: Vec<PlaceMatch> = Vec::new();
        for found in chains {
            if claims.len() >= NUM_CLAIMS_MAX {
                break;
            }
            let is_known = |known: &PlaceMatch| {
                known.direction == found.chain.direction
                    && known.earlier.overlaps(&found.earlier)
                    && known.later.overlaps(&found.later)
            };
            if map.matches.iter().chain(&claims).any(is_known) {
                continue;
            }
            let pairs = self.pairs_of(found);
            let evidence = Evidence {
                bits: found.evidence.bits,
                expected_chance_matches: found.evidence.expected_chance_matches,
                shape_residual_m: self.shape_residual_m(&pairs, found),
                density_correlation: self.density_correlation(&pairs, found),
                ..Evidence::default()
            };
            let (run_a, run_b) = (found.earlier.run_idx as usize, found.later.run_idx as usize);
            let is_one_frame = map.runs[run_a].component == map.runs[run_b].component;
            let middle = pairs.get(pairs.len() / 2).filter(|_| is_one_frame);
            let apart_m = middle.and_then(|pair| {
                let ends = poses[run_a].get(pair.earlier as usize).zip(poses[run_b].get(pair.later as usize));
                ends.map(|(a, b)| a.distance(b))
            });
            let reason = refusal(&evidence, apart_m, max_chance_matches);
            claims.push(PlaceMatch {
                earlier: found.earlier,
                later: found.later,
                direction: found.chain.direction,
                channel: Channel::Words,
                evidence,
                probability: if reason.is_some() { 0.0 } else { 0.1 },
                state: reason.map_or(MatchState::Candidate, MatchState::Rejected),
            });
        }
        claims
    }

    fn text(&self, interval: &Interval) -> &Lattice {
        &self.texts[interval.run_idx as usize]
    }

    fn pairs_of(&self, found: &RunMatch) -> Vec<ObservationPair> {
        claimed_pairs(&found.chain, self.text(&found.earlier), self.text(&found.later))
    }

    /// RMS distance of the two driven shapes after rigid alignment.
    fn shape_residual_m(&self, pairs: &[ObservationPair], found: &RunMatch) -> Option<f64> {
        let place = |interval: &Interval, observation: u32| {
            let run = &self.runs[interval.run_idx as usize];
            run.observations
                .get(observation as usize)
                .map(|there| (there.run_from_robot.x, there.run_from_robot.y))
        };
        let points: Option<Vec<_>> = (pairs.iter())
            .map(|pair| place(&found.earlier, pair.earlier).zip(place(&found.later, pair.later)))
            .collect();
        rigid_residual(&points?)
    }

    /// Correlation of the first kernel's densities.
    fn density_correlation(&self, pairs: &[ObservationPair], found: &RunMatch) -> Option<f64> {
        let density = |interval: &Interval, observation: u32| {
            let run = &self.runs[interval.run_idx as usize];
            run.observations.get(observation as usize)?.densities.first().copied().map(f64::from)
        };
        let values: Option<Vec<_>> = (pairs.iter())
            .map(|pair| density(&found.earlier, pair.earlier).zip(density(&found.later, pair.later)))
            .collect();
        correlation(&values?)
    }
}

/// The first stage, in order of rising cost, that refuses a claim; `apart_m` is where the map puts its two places.
fn refusal(evidence: &Evidence, apart_m: Option<f64>, max_chance_matches: f64) -> Option<RejectionReason> {
    let is_above = |value: Option<f64>, limit: f64| value.is_some_and(|value| value > limit);
    if evidence.expected_chance_matches > max_chance_matches {
        Some(RejectionReason::WeakText)
    } else if is_above(evidence.shape_residual_m, SHAPE_RESIDUAL_MAX_M) {
        Some(RejectionReason::Shape)
    } else if evidence.density_correlation.is_some_and(|value| value < CORRELATION_MIN) {
        Some(RejectionReason::Density)
    } else if is_above(apart_m, APART_MIN_M) {
        Some(RejectionReason::Inconsistent)
    } else {
        None
    }
}

fn touches(interval: &Interval, (first, last): (u32, u32)) -> bool {
    interval.first <= last && first <= interval.last
}

fn nodes_in(text: &Lattice, interval: &Interval) -> std::ops::Range<usize> {
    let first = text.num_nodes_before(interval.first);
    let last = (first..text.num_nodes()).find(|&node| text.observations(node, node).0 > interval.last);
    first..last.unwrap_or(text.num_nodes())
}

/// RMS distance between paired points after the best rotation and shift of the second ones.
fn rigid_residual(points: &[((f64, f64), (f64, f64))]) -> Option<f64> {
    let count = points.len() as f64;
    if points.len() < 2 {
        return None;
    }
    let mean =
        |value: &dyn Fn(&((f64, f64), (f64, f64))) -> f64| points.iter().map(value).sum::<f64>() / count;
    let (ax, ay) = (mean(&|point| point.0.0), mean(&|point| point.0.1));
    let (bx, by) = (mean(&|point| point.1.0), mean(&|point| point.1.1));
    let (mut dot, mut cross, mut squares) = (0.0, 0.0, 0.0);
    for ((x, y), (u, v)) in points {
        let (x, y, u, v) = (x - ax, y - ay, u - bx, v - by);
        dot += x * u + y * v;
        cross += y * u - x * v;
        squares += x * x + y * y + u * u + v * v;
    }
    // The best rotation turns (dot, cross) onto the first axis.
    Some(((squares - 2.0 * dot.hypot(cross)).max(0.0) / count).sqrt())
}

fn correlation(values: &[(f64, f64)]) -> Option<f64> {
    let count = values.len() as f64;
    let mean_a = values.iter().map(|value| value.0).sum::<f64>() / count;
    let mean_b = values.iter().map(|value| value.1).sum::<f64>() / count;
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in values {
        aa += (a - mean_a).powi(2);
        ab += (a - mean_a) * (b - mean_b);
        bb += (b - mean_b).powi(2);
    }
    (aa > 1e-6 && bb > 1e-6).then(|| ab / (aa * bb).sqrt())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::run::Keyframe;
    use super::super::site_map::MappedRun;
    use super::*;
    use crate::scan::ScanGeometry;
    use crate::text::{Observation, Word, WordId};

    /// A run that drives a slalom through regions of the given classes and sizes, twice if `num_laps` is 2: on the
    /// second lap the robot stands where it stood on the first.
    fn run_of(classes: &[(u8, u32)], num_laps: usize) -> (Vec<Observation>, Vec<Word>) {
        let (mut observations, mut words) = (Vec::new(), Vec::new());
        for lap in 0..num_laps {
            let lap_start = observations.len();
            for (index, &(class, size)) in classes.iter().enumerate() {
                let first = observations.len() as u32;
                for _ in 0..size {
                    let along = (observations.len() - lap_start) as f64 * 0.1;
                    let densities = vec![f32::from(class) / 8.0];
                    let pose = Pose2::new(along, (along * 0.3).sin(), 0.0);
                    observations.push(Observation {
                        scan_seq: observations.len() as u64,
                        timestamp_ns: 0,
                        travel_m: observations.len() as f64 * 0.1,
                        odom_from_robot: pose,
                        run_from_robot: pose,
                        densities,
                        is_hard: true,
                        num_frontiers: 0,
                    });
                }
                words.push(Word {
                    id: WordId { level: 0, index: (lap * classes.len() + index) as u32 },
                    class,
                    size,
                    turn_rad: 0.0,
                    observations: (first, first + size - 1),
                    predecessors: vec![],
                });
            }
        }
        (observations, words)
    }

    fn keyframes_of(observations: &[Observation]) -> Vec<Keyframe> {
        let keyframe = |observation: &Observation| Keyframe {
            scan_seq: observation.scan_seq,
            timestamp_ns: 0,
            odom_from_robot: observation.odom_from_robot,
            run_from_robot: observation.run_from_robot,
            motion_covariance: [[0.0; 3]; 3],
            ranges_m: vec![],
        };
        observations.iter().map(keyframe).collect()
    }

    const LAP: [(u8, u32); 12] = [
        (1, 20),
        (2, 9),
        (5, 14),
        (3, 30),
        (6, 8),
        (0, 12),
        (4, 25),
        (7, 6),
        (2, 40),
        (5, 7),
        (1, 10),
        (6, 18),
    ];

    fn weighed(shift_m: f64, matches: Vec<PlaceMatch>) -> SiteMap {
        let (observations, words) = run_of(&LAP, 2);
        // Another run says what is usual here.
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut class = 0;
        let mut region = || {
            class = (class + rng.random_range(1..8u8)) % 8;
            (class, rng.random_range(4..60))
        };
        let (_, usual) = run_of(&(0..400).map(|_| region()).collect::<Vec<_>>(), 1);
        let geometry = ScanGeometry {
            num_ranges: 1,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.0,
            range_max_m: 1.0,
            robot_from_laser: Pose2::identity(),
        };
        let keyframes = keyframes_of(&observations);
        let record = RunRecord {
            geometry: &geometry,
            observations: &observations,
            words: &words,
            keyframes: &keyframes,
            area: None,
        };
        let other =
            RunRecord { geometry: &geometry, observations: &[], words: &usual, keyframes: &[], area: None };
        // The map may have put the second lap elsewhere.
        let shifted = |(index, keyframe): (usize, &Keyframe)| {
            let shift_m = if index >= observations.len() / 2 { shift_m } else { 0.0 };
            Pose2::new(0.0, shift_m, 0.0).compose(&keyframe.run_from_robot)
        };
        let map_from_keyframes = keyframes.iter().enumerate().map(shifted).collect();
        let elsewhere = MappedRun { component: 1, ..MappedRun::default() };
        let runs = vec![MappedRun { component: 0, map_from_keyframes }, elsewhere];
        let mut map = SiteMap { matches, runs, num_components: 2, ..SiteMap::default() };
        weigh_texts(&[record, other], &mut map, &MatchingConfig::default());
        map
    }

    fn spatial(earlier: (u32, u32), later: (u32, u32)) -> PlaceMatch {
        let interval = |(first, last): (u32, u32)| Interval { run_idx: 0, first, last };
        PlaceMatch {
            earlier: interval(earlier),
            later: interval(later),
            direction: Direction::Same,
            channel: Channel::Spatial,
            evidence: Evidence::default(),
            probability: 0.9,
            state: MatchState::Verified,
        }
    }

    #[test]
    fn a_match_is_worth_the_chain_that_passes_through_it() {
        let map = weighed(0.0, vec![spatial((50, 70), (249, 269)), spatial((50, 70), (300, 310))]);
        let (right, wrong) = (&map.matches[0].evidence, &map.matches[1].evidence);
        assert!(right.bits > 20.0 && right.expected_chance_matches < 1e-3, "{right:?}");
        assert!(right.shape_residual_m.unwrap() < 1e-6);
        assert!(wrong.bits < 8.0 && wrong.expected_chance_matches > 1.0, "{wrong:?}");
        let is_listed = |found: &&PlaceMatch| found.channel == Channel::Words && found.evidence.bits > 20.0;
        assert_eq!(map.matches.iter().filter(is_listed).count(), 0, "the map shares this claim");
    }

    #[test]
    fn a_claim_that_the_map_does_not_share_is_listed_with_what_speaks_against_it() {
        let unshared = |shift_m| weighed(shift_m, vec![]).matches.into_iter().next().unwrap();
        let (together, apart) = (unshared(0.0), unshared(20.0));
        assert_eq!((together.channel, together.state), (Channel::Words, MatchState::Candidate));
        assert_eq!((together.earlier.first, together.later.first), (0, 199));
        assert_eq!(apart.state, MatchState::Rejected(RejectionReason::Inconsistent));
        assert_eq!(apart.probability, 0.0);
    }

    #[test]
    fn the_cheapest_stage_that_refuses_gives_the_reason() {
        let sure = Evidence { bits: 40.0, expected_chance_matches: 1e-6, ..Evidence::default() };
        assert_eq!(refusal(&sure, None, 0.1), None);
        let weak = Evidence { expected_chance_matches: 3.0, shape_residual_m: Some(9.0), ..sure.clone() };
        assert_eq!(refusal(&weak, None, 0.1), Some(RejectionReason::WeakText));
        let bent = Evidence { shape_residual_m: Some(9.0), density_correlation: Some(0.0), ..sure.clone() };
        assert_eq!(refusal(&bent, None, 0.1), Some(RejectionReason::Shape));
        let other = Evidence { density_correlation: Some(0.1), ..sure };
        assert_eq!(refusal(&other, Some(9.0), 0.1), Some(RejectionReason::Density));
    }

    #[test]
    fn a_turned_shape_has_no_residual() {
        let shape = [(0.0, 0.0), (1.0, 0.5), (3.0, -1.0), (4.0, 2.0)];
        let turned = shape.map(|(x, y): (f64, f64)| ((x, y), (5.0 - y, 1.0 + x)));
        assert!(rigid_residual(&turned).unwrap() < 1e-7);
        let mirrored = shape.map(|(x, y): (f64, f64)| ((x, y), (x, -y)));
        assert!(rigid_residual(&mirrored).unwrap() > 0.5);
    }
}
