//! Runs that were cut: the map builder is told of their pieces as of runs that never met, and what it says of pieces is
//! told of the runs.

use std::borrow::Cow;
use std::ops::Range;

use super::place_match::{Decision, PlaceMatch};
use super::run::{Keyframe, RunRecord};
use super::site_map::SiteMap;
use crate::scan::ScanGeometry;
use crate::text::{Interval, Observation, Word, WordId};

/// A piece of a run: what was recorded from one cut to the next.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    /// Place of the run in the list of runs.
    pub run_idx: u32,
    /// Sequence numbers of its scans; the last piece goes on to the end of the run.
    pub scans: Range<u64>,
    /// Its observations among those of the run.
    pub observations: Range<u32>,
    /// Its keyframes among those of the run.
    pub keyframes: Range<u32>,
    geometry: &'a ScanGeometry,
    seen: &'a [Observation],
    words: Cow<'a, [Word]>,
    registered: &'a [Keyframe],
    area: Option<&'a str>,
}

impl Piece<'_> {
    /// What the map builder is told of it.
    pub fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: self.geometry,
            observations: self.seen,
            words: &self.words,
            keyframes: self.registered,
            area: self.area,
        }
    }
}

/// The pieces of all runs of a site, run after run; a run that was not cut is one piece.
#[derive(Clone, Debug, Default)]
pub struct SitePieces<'a> {
    pieces: Vec<Piece<'a>>,
}

impl<'a> SitePieces<'a> {
    /// Cuts runs; for each the sequence numbers of the scans with which its pieces begin, but for the first, ascending.
    pub fn new(runs: &[RunRecord<'a>], cuts: &[Vec<u64>]) -> Self {
        let none = Vec::new();
        let cut = |(run_idx, run)| {
            let cuts = cuts.get(run_idx).unwrap_or(&none);
            (0..=cuts.len()).map(move |part| {
                let first = part.checked_sub(1).map_or(0, |before| cuts[before]);
                piece(run_idx as u32, run, first..cuts.get(part).copied().unwrap_or(u64::MAX))
            })
        };
        Self { pieces: runs.iter().enumerate().flat_map(cut).collect() }
    }

    /// All pieces.
    pub fn pieces(&self) -> &[Piece<'a>] {
        &self.pieces
    }

    /// What the map builder is told: one record for each piece.
    pub fn records(&self) -> Vec<RunRecord<'_>> {
        self.pieces.iter().map(Piece::record).collect()
    }

    /// Decisions on stretches of runs as decisions on stretches of pieces; one on a stretch that was cut is about all
    /// parts of it.
    pub fn decisions(&self, decisions: &[Decision]) -> Vec<Decision> {
        let mut of_pieces = Vec::new();
        for decision in decisions {
            for earlier in self.parts(&decision.earlier) {
                for later in self.parts(&decision.later) {
                    of_pieces.push(Decision { earlier, later, ..*decision });
                }
            }
        }
        of_pieces
    }

    /// Tells the matches of a map, which are of pieces, of the runs. The map's list of runs stays one of pieces.
    pub fn tell_of_runs(&self, map: &mut SiteMap) {
        map.matches.iter_mut().chain(&mut map.refused).for_each(|found| self.tell_match(found));
    }

    fn tell_match(&self, found: &mut PlaceMatch) {
        let keyframe = |of: &Interval| self.pieces[of.run_idx as usize].keyframes.start;
        if let Some(registration) = &mut found.evidence.registration {
            registration.earlier_keyframe += keyframe(&found.earlier);
            registration.later_keyframe += keyframe(&found.later);
        }
        for interval in [&mut found.earlier, &mut found.later] {
            let Piece { run_idx, observations, .. } = &self.pieces[interval.run_idx as usize];
            let from = observations.start;
            *interval =
                Interval { run_idx: *run_idx, first: interval.first + from, last: interval.last + from };
        }
    }

    /// The parts of a stretch of a run, each in its piece.
    fn parts(&self, interval: &Interval) -> Vec<Interval> {
        let Interval { run_idx, first, last } = *interval;
        let part = |(place, piece): (usize, &Piece<'_>)| {
            let Range { start, end } = piece.observations;
            let held = first.max(start)..=last.min(end.checked_sub(1)?);
            (piece.run_idx == run_idx && !held.is_empty()).then(|| Interval {
                run_idx: place as u32,
                first: held.start() - start,
                last: held.end() - start,
            })
        };
        self.pieces.iter().enumerate().filter_map(part).collect()
    }
}

fn piece<'a>(run_idx: u32, run: &RunRecord<'a>, scans: Range<u64>) -> Piece<'a> {
    let place = |seq: u64| run.observations.partition_point(|seen| seen.scan_seq < seq);
    let observations = place(scans.start)..place(scans.end);
    let place = |seq: u64| run.keyframes.partition_point(|keyframe| keyframe.scan_seq < seq);
    let keyframes = place(scans.start)..place(scans.end);
    let is_whole = scans.start == 0 && scans.end == u64::MAX;
    let words =
        if is_whole { Cow::Borrowed(run.words) } else { Cow::Owned(words_in(run.words, &observations)) };
    Piece {
        run_idx,
        scans,
        observations: observations.start as u32..observations.end as u32,
        keyframes: keyframes.start as u32..keyframes.end as u32,
        geometry: run.geometry,
        seen: &run.observations[observations],
        words,
        registered: &run.keyframes[keyframes],
        area: run.area,
    }
}

/// The words of some observations of a run, numbered as if these were all.
fn words_in(words: &[Word], observations: &Range<usize>) -> Vec<Word> {
    let (start, end) = (observations.start as u32, observations.end as u32);
    let mut num_before: Vec<u32> = Vec::new();
    for word in words.iter().filter(|word| word.observations.0 < start) {
        let level = usize::from(word.id.level);
        num_before.resize(num_before.len().max(level + 1), 0);
        num_before[level] += 1;
    }
    let renamed = |id: &WordId| {
        let before = num_before.get(usize::from(id.level)).copied().unwrap_or_default();
        Some(WordId { index: id.index.checked_sub(before)?, ..*id })
    };
    let held = words.iter().filter(|word| (start..end).contains(&word.observations.0));
    held.filter_map(|word| {
        let (first, last) = word.observations;
        Some(Word {
            id: renamed(&word.id)?,
            observations: (first - start, last - start),
            predecessors: word.predecessors.iter().filter_map(renamed).collect(),
            ..word.clone()
        })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::super::place_match::{Channel, Evidence, MatchState, Registration};
    use super::*;
    use crate::geometry::Pose2;
    use crate::text::{Direction, Quantizer, TextBuilder, TextConfig};

    fn laser() -> ScanGeometry {
        ScanGeometry {
            num_ranges: 1,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        }
    }

    fn observation(scan_seq: u64) -> Observation {
        let pose = Pose2::new(scan_seq as f64 * 0.1, 0.0, 0.0);
        Observation {
            scan_seq,
            timestamp_ns: 0,
            travel_m: scan_seq as f64 * 0.1,
            odom_from_robot: pose,
            run_from_robot: pose,
            densities: vec![if scan_seq % 20 < 10 { 0.1 } else { 0.9 }],
            is_hard: true,
            num_frontiers: 0,
        }
    }

    fn keyframe(scan_seq: u64) -> Keyframe {
        Keyframe {
            scan_seq,
            timestamp_ns: 0,
            odom_from_robot: Pose2::identity(),
            run_from_robot: Pose2::identity(),
            motion_covariance: [[0.0; 3]; 3],
            ranges_m: Vec::new(),
        }
    }

    /// The words of observations as one text, cut before number `cut`.
    fn text(observations: &[Observation], cut: Option<usize>) -> Vec<Word> {
        let config = TextConfig::default();
        let mut builder = TextBuilder::new(Quantizer::uniform(5), &config);
        let mut words = Vec::new();
        for (idx, observation) in observations.iter().enumerate() {
            if cut == Some(idx) {
                words.extend(builder.cut());
            }
            words.extend(builder.push(observation));
        }
        words.extend(builder.finish());
        words
    }

    #[test]
    fn the_words_of_a_piece_are_those_of_a_run_of_its_own() {
        let observations: Vec<Observation> = (0..200).map(observation).collect();
        let words = text(&observations, Some(90));
        let keyframes: Vec<Keyframe> = (0..100).map(|idx| keyframe(2 * idx)).collect();
        let laser = laser();
        let run = RunRecord {
            geometry: &laser,
            observations: &observations,
            words: &words,
            keyframes: &keyframes,
            area: None,
        };
        let pieces = SitePieces::new(&[run, run], &[vec![90]]);
        let records = pieces.records();
        assert_eq!(records.len(), 3);
        assert_eq!(records[0].words, text(&observations[..90], None));
        assert_eq!(records[1].words, text(&observations[90..], None));
        assert!(records[1].words.len() > 10 && records[1].words[0].predecessors.is_empty());
        assert_eq!(records[2].words, words);
        assert_eq!((records[0].keyframes.len(), records[1].keyframes.len()), (45, 55));
        assert_eq!(records[1].keyframes[0].scan_seq, 90);
    }

    #[test]
    fn matches_are_told_of_runs_and_decisions_of_pieces() {
        let observations: Vec<Observation> = (0..200).map(observation).collect();
        let keyframes: Vec<Keyframe> = (0..100).map(|idx| keyframe(2 * idx)).collect();
        let laser = laser();
        let run = RunRecord {
            geometry: &laser,
            observations: &observations,
            words: &[],
            keyframes: &keyframes,
            area: None,
        };
        let pieces = SitePieces::new(&[run, run], &[vec![90], vec![]]);
        let interval = |run_idx, first, last| Interval { run_idx, first, last };
        let registration = Registration {
            earlier_keyframe: 3,
            later_keyframe: 4,
            earlier_from_later: Pose2::identity(),
            covariance: [[0.0; 3]; 3],
            agreement: 1.0,
        };
        let mut map = SiteMap::default();
        map.matches.push(PlaceMatch {
            earlier: interval(1, 5, 9),
            later: interval(2, 7, 8),
            direction: Direction::Same,
            channel: Channel::Spatial,
            evidence: Evidence { registration: Some(registration), ..Evidence::default() },
            probability: 1.0,
            state: MatchState::Verified,
        });
        pieces.tell_of_runs(&mut map);
        let told = &map.matches[0];
        assert_eq!((told.earlier, told.later), (interval(0, 95, 99), interval(1, 7, 8)));
        let registration = told.evidence.registration.as_ref().unwrap();
        assert_eq!((registration.earlier_keyframe, registration.later_keyframe), (48, 4));
        let decision = Decision {
            earlier: interval(0, 80, 99),
            later: interval(1, 7, 8),
            direction: Direction::Same,
            is_same_place: false,
        };
        let parts: Vec<Interval> = pieces.decisions(&[decision]).iter().map(|part| part.earlier).collect();
        assert_eq!(parts, [interval(0, 80, 89), interval(1, 0, 9)]);
    }
}
