//! Exemplars of runs that stand for a place once it is settled: what was recorded there, in the frame of its body.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::run::{Keyframe, RunRecord};
use crate::geometry::Pose2;
use crate::scan::ScanGeometry;
use crate::text::{Observation, Word};

/// Where an exemplar was cut from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Source {
    /// The run, by its place in the list of a site.
    pub run: u32,
    /// Its first observation in the run.
    pub first_observation: u32,
    /// Its first keyframe in the run.
    pub first_keyframe: u32,
}

/// A stretch of a run that is kept with all that it saw. Poses are given in the frame of its body and stay.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Exemplar {
    pub source: Source,
    /// True when nothing else was there before: it keeps the place where it is, whatever comes later.
    pub is_founder: bool,
    geometry: ScanGeometry,
    area: Option<String>,
    observations: Vec<Observation>,
    words: Vec<Word>,
    keyframes: Vec<Keyframe>,
}

/// A part of an exemplar of about equal length, with what stands for it.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    pub keyframes: Range<usize>,
    /// A pose for every anchor spacing, with the travel from the beginning of the exemplar, metres.
    pub places: Vec<(Pose2, f64)>,
}

impl Exemplar {
    /// A whole run where the map puts it.
    pub fn whole(run: u32, record: &RunRecord<'_>, map_from_keyframes: &[Pose2], observed: &[Pose2]) -> Self {
        let keyframe =
            |(keyframe, pose): (&Keyframe, &Pose2)| Keyframe { run_from_robot: *pose, ..keyframe.clone() };
        let observation =
            |(seen, pose): (&Observation, &Pose2)| Observation { run_from_robot: *pose, ..seen.clone() };
        Self {
            source: Source { run, first_observation: 0, first_keyframe: 0 },
            is_founder: false,
            geometry: record.geometry.clone(),
            area: record.area.map(str::to_owned),
            observations: record.observations.iter().zip(observed).map(observation).collect(),
            words: record.words.to_vec(),
            keyframes: record.keyframes.iter().zip(map_from_keyframes).map(keyframe).collect(),
        }
    }

    /// The same in another frame; to the bit the same when the frame is.
    pub fn moved(&self, there_from_here: &Pose2) -> Self {
        let mut moved = self.clone();
        if *there_from_here != Pose2::identity() {
            let poses = (moved.keyframes.iter_mut().map(|keyframe| &mut keyframe.run_from_robot))
                .chain(moved.observations.iter_mut().map(|observation| &mut observation.run_from_robot));
            poses.for_each(|pose| *pose = there_from_here.compose(pose));
        }
        moved
    }

    /// The same, in an area.
    pub fn in_area(self, area: Option<String>) -> Self {
        Self { area, ..self }
    }

    /// Where it belongs, when somebody said.
    pub fn area(&self) -> Option<&str> {
        self.area.as_deref()
    }

    /// As the map builder reads it: a run whose frame is that of the body.
    pub fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: self.area(),
        }
    }

    /// Number of its observations.
    pub fn num_observations(&self) -> u32 {
        self.observations.len() as u32
    }

    /// Cuts it at every `length_m` of travel, the rest included when it is short, with a place every `spacing_m`.
    pub fn chunks(&self, length_m: f64, spacing_m: f64) -> Vec<Chunk> {
        let mut chunks: Vec<Chunk> = Vec::new();
        let (mut travel_m, mut next_m) = (0.0, 0.0);
        for (index, keyframe) in self.keyframes.iter().enumerate() {
            let pose = keyframe.run_from_robot;
            if index > 0 {
                travel_m += self.keyframes[index - 1].run_from_robot.distance(&pose);
            }
            if travel_m >= chunks.len() as f64 * length_m {
                chunks.push(Chunk { keyframes: index..index, places: Vec::new() });
            }
            let Some(chunk) = chunks.last_mut() else { continue };
            chunk.keyframes.end = index + 1;
            if travel_m >= next_m {
                chunk.places.push((pose, travel_m));
                next_m = travel_m + spacing_m;
            }
        }
        let is_short = |chunk: &Chunk| (chunk.places.len() as f64) * spacing_m < 0.5 * length_m;
        if chunks.len() > 1 && chunks.last().is_some_and(is_short) {
            let rest = chunks.pop();
            if let Some((before, rest)) = chunks.last_mut().zip(rest) {
                before.keyframes.end = rest.keyframes.end;
                before.places.extend(rest.places);
            }
        }
        chunks
    }

    /// The part with these keyframes, and with the observations and words between the first of them and what follows.
    pub fn part(&self, keyframes: Range<usize>, is_founder: bool) -> Self {
        let before = |index: usize| match self.keyframes.get(index) {
            Some(keyframe) if index > 0 => {
                self.observations.partition_point(|seen| seen.scan_seq < keyframe.scan_seq)
            }
            Some(_) => 0,
            None => self.observations.len(),
        };
        let observations = before(keyframes.start)..before(keyframes.end);
        Self {
            source: Source {
                run: self.source.run,
                first_observation: self.source.first_observation + observations.start as u32,
                first_keyframe: self.source.first_keyframe + keyframes.start as u32,
            },
            is_founder,
            geometry: self.geometry.clone(),
            area: self.area.clone(),
            words: words_within(&self.words, &observations),
            observations: self.observations[observations].to_vec(),
            keyframes: self.keyframes[keyframes].to_vec(),
        }
    }
}

/// Words that lie within a range of observations, named anew.
fn words_within(words: &[Word], observations: &Range<usize>) -> Vec<Word> {
    let is_within = |word: &&Word| {
        let (first, last) = word.observations;
        observations.start <= first as usize && (last as usize) < observations.end
    };
    let num_levels = words.iter().map(|word| usize::from(word.id.level) + 1).max().unwrap_or(0);
    let mut firsts = vec![u32::MAX; num_levels];
    for word in words.iter().filter(is_within) {
        let first = &mut firsts[usize::from(word.id.level)];
        *first = word.id.index.min(*first);
    }
    let start = observations.start as u32;
    let renamed = |word: &Word| {
        let mut word = word.clone();
        word.id.index -= firsts[usize::from(word.id.level)];
        word.observations = (word.observations.0 - start, word.observations.1 - start);
        // Nobody reads them of a finished text, and those before the exemplar have no name in it.
        word.predecessors = Vec::new();
        word
    };
    words.iter().filter(is_within).map(renamed).collect()
}
