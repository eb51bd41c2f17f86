//! All anchors of a site: every few metres of each run one keyframe that stands for its neighborhood.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::config::MappingConfig;
use super::indices::{AnchorIdx, BodyIdx, KeyframeIdx, RunIdx};
use super::run::{Keyframe, RunRecord};
use crate::geometry::Pose2;
use crate::registration::{Submap, SubmapScan};
use crate::text::Interval;

/// A keyframe that stands for its neighborhood; a node of the coarse graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Anchor {
    /// The run that it belongs to.
    pub run: RunIdx,
    /// Where it lies in the run.
    pub keyframe: KeyframeIdx,
    /// Travel from the beginning of the run, metres.
    pub travel_m: f64,
    /// Pose in the run's frame.
    pub run_from_anchor: Pose2,
    /// Names the content of the submap: equal content, equal number.
    pub fingerprint: u64,
}

/// The runs of a site in an order that does not depend on their arrival, with their anchors and submaps.
///
/// What the map builder decides between two runs may depend on which comes first, by a rounding at least. So runs are
/// ordered by what they recorded, and whoever makes the same recordings in another order gets the same map.
///
/// Exemplars of the foundation count as runs here and come before all others. The frame of an exemplar is that of its body.
pub(crate) struct SiteAnchors<'a> {
    pub config: &'a MappingConfig,
    runs: Vec<RunRecord<'a>>,
    /// For each run its place in the list that the map builder was given.
    told: Vec<usize>,
    /// For each run the body of which it is an exemplar, if it is one.
    bodies: Vec<Option<BodyIdx>>,
    anchors: Vec<Anchor>,
    /// Covariance of the refined odometry from each anchor to the next of its run.
    steps: Vec<Matrix3<f64>>,
    /// Made when they are first looked at: most pairs are known from earlier builds.
    submaps: Vec<OnceLock<Submap>>,
    /// For each run where its anchors begin; one more entry than runs.
    starts: Vec<usize>,
    /// For each run the travel at each keyframe, metres.
    travels_m: Vec<Vec<f64>>,
}

impl<'a> SiteAnchors<'a> {
    /// Orders the runs and chooses their anchors; `exemplars` are those of each body, and are told before the others.
    pub fn new(exemplars: &[Vec<RunRecord<'a>>], given: &[RunRecord<'a>], config: &'a MappingConfig) -> Self {
        let of_body =
            |(body, exemplars): (usize, &Vec<RunRecord<'a>>)| vec![Some(BodyIdx::new(body)); exemplars.len()];
        let mut bodies: Vec<Option<BodyIdx>> = exemplars.iter().enumerate().flat_map(of_body).collect();
        let num_exemplars = bodies.len();
        bodies.resize(num_exemplars + given.len(), None);
        let mut runs: Vec<RunRecord<'a>> = exemplars.iter().flatten().copied().collect();
        let order = order_of(given);
        runs.extend(order.iter().map(|&place| given[place]));
        let told = (0..num_exemplars).chain(order.iter().map(|place| num_exemplars + place)).collect();
        let travels_m: Vec<Vec<f64>> = runs.iter().map(|run| travel_of(run.keyframes)).collect();
        let mut chosen = Vec::new();
        let mut starts = vec![0];
        for (run, travel_m) in travels_m.iter().enumerate() {
            let mut next_m = 0.0;
            for (keyframe, &travel) in travel_m.iter().enumerate() {
                if travel >= next_m || keyframe + 1 == travel_m.len() {
                    chosen.push((run, keyframe));
                    next_m = travel + config.anchor_spacing_m;
                }
            }
            starts.push(chosen.len());
        }
        let anchor = |&(run, keyframe): &(usize, usize)| {
            let anchor_pose = runs[run].keyframes[keyframe].run_from_robot;
            Anchor {
                run: RunIdx::new(run),
                keyframe: KeyframeIdx::new(keyframe),
                travel_m: travels_m[run][keyframe],
                run_from_anchor: anchor_pose,
                fingerprint: fingerprint(
                    &surroundings(runs[run].keyframes, &travels_m[run], keyframe, config),
                    &anchor_pose,
                ),
            }
        };
        let anchors: Vec<Anchor> = chosen.par_iter().map(anchor).collect();
        let steps = (0..anchors.len()).map(|from| step_covariance(&anchors, from, &runs, config)).collect();
        let submaps = anchors.iter().map(|_| OnceLock::new()).collect();
        Self { config, runs, told, bodies, anchors, steps, submaps, starts, travels_m }
    }

    /// All runs.
    pub fn runs(&self) -> impl DoubleEndedIterator<Item = RunIdx> + ExactSizeIterator + use<> {
        (0..self.runs.len()).map(RunIdx::new)
    }

    /// The runs that moved far enough to be placed, apart from the foundation.
    pub fn driven(&self) -> Vec<RunIdx> {
        self.runs().filter(|&run| self.body_of(run).is_none() && !self.of_run(run).is_empty()).collect()
    }

    /// The body of the foundation of which a run is an exemplar, if it is one.
    pub fn body_of(&self, run: RunIdx) -> Option<BodyIdx> {
        self.bodies[run.at()]
    }

    /// Exemplars of a body, ascending.
    pub fn exemplars_of(&self, body: BodyIdx) -> Vec<RunIdx> {
        self.runs().filter(|&run| self.body_of(run) == Some(body)).collect()
    }

    /// True when where two runs lie to each other is settled: they are exemplars of one body.
    pub fn are_settled(&self, a: RunIdx, b: RunIdx) -> bool {
        self.body_of(a).is_some() && self.body_of(a) == self.body_of(b)
    }

    /// What was recorded in a run.
    pub fn record(&self, run: RunIdx) -> &RunRecord<'a> {
        &self.runs[run.at()]
    }

    /// Where a run stands in the list that the map builder was given.
    pub fn told(&self, run: RunIdx) -> usize {
        self.told[run.at()]
    }

    /// The run that stands at this place of the list that the map builder was given.
    pub fn run_told(&self, place: usize) -> Option<RunIdx> {
        self.told.iter().position(|&other| other == place).map(RunIdx::new)
    }

    /// Anchors of a run in order of travel.
    pub fn of_run(&self, run: RunIdx) -> Range<usize> {
        self.starts[run.at()]..self.starts[run.at() + 1]
    }

    /// Anchors of the same run up to so many before and behind one.
    pub fn beside(&self, anchor: AnchorIdx, num: usize) -> Range<usize> {
        let range = self.of_run(self.run_of(anchor));
        anchor.at().saturating_sub(num).max(range.start)..(anchor.at() + num + 1).min(range.end)
    }

    /// An anchor.
    pub fn anchor(&self, anchor: AnchorIdx) -> &Anchor {
        &self.anchors[anchor.at()]
    }

    /// The run of an anchor.
    pub fn run_of(&self, anchor: AnchorIdx) -> RunIdx {
        self.anchors[anchor.at()].run
    }

    /// What was seen around an anchor.
    pub fn submap(&self, anchor: AnchorIdx) -> &Submap {
        self.submaps[anchor.at()].get_or_init(|| {
            let Anchor { run, keyframe, .. } = self.anchors[anchor.at()];
            let run = run.at();
            let used =
                surroundings(self.runs[run].keyframes, &self.travels_m[run], keyframe.at(), self.config);
            let scans: Vec<SubmapScan<'_>> = used
                .iter()
                .map(|keyframe| SubmapScan {
                    frame_from_robot: keyframe.run_from_robot,
                    ranges_m: &keyframe.ranges_m,
                })
                .collect();
            let anchor_pose = self.anchors[anchor.at()].run_from_anchor;
            Submap::new(self.runs[run].geometry, &scans, &anchor_pose, &self.config.submap)
        })
    }

    /// Covariance of the refined odometry from an anchor to the next one of its run.
    pub fn step_covariance(&self, from: AnchorIdx) -> &Matrix3<f64> {
        &self.steps[from.at()]
    }

    /// Travel of a run at a keyframe, metres.
    pub fn travel_m(&self, run: RunIdx, keyframe: usize) -> f64 {
        self.travels_m[run.at()].get(keyframe).copied().unwrap_or_default()
    }

    /// The anchor of a run that is nearest along the travel.
    pub fn nearest(&self, run: RunIdx, travel_m: f64) -> Option<AnchorIdx> {
        let range = self.of_run(run);
        if range.is_empty() {
            return None;
        }
        let after =
            range.start + self.anchors[range.clone()].partition_point(|anchor| anchor.travel_m < travel_m);
        let before = after.saturating_sub(1).max(range.start);
        let after = after.min(range.end - 1);
        let gap = |index: usize| (self.anchors[index].travel_m - travel_m).abs();
        Some(AnchorIdx::new(if gap(before) <= gap(after) { before } else { after }))
    }

    /// The anchor nearest to the middle of an interval of a run, and the pose of that middle in the run's frame.
    pub fn at_middle(&self, run: RunIdx, interval: &Interval) -> Option<(AnchorIdx, Pose2)> {
        let middle = (interval.first + interval.last) / 2;
        let observation = self.record(run).observations.get(middle as usize)?;
        Some((self.nearest(run, self.travel_at(run, middle)?)?, observation.run_from_robot))
    }

    /// Travel of a run at an observation, metres; none when the run does not hold it.
    pub fn travel_at(&self, run: RunIdx, observation: u32) -> Option<f64> {
        let record = self.record(run);
        let scan_seq = record.observations.get(observation as usize)?.scan_seq;
        let after = record.keyframes.partition_point(|keyframe| keyframe.scan_seq < scan_seq);
        Some(self.travel_m(run, after.min(record.keyframes.len().checked_sub(1)?)))
    }

    /// True when two anchors may be matched: other runs, or far enough apart along the travel.
    pub fn may_match(&self, a: AnchorIdx, b: AnchorIdx) -> bool {
        let (a, b) = (self.anchor(a), self.anchor(b));
        if self.are_settled(a.run, b.run) {
            return false;
        }
        a.run != b.run || (a.travel_m - b.travel_m).abs() >= self.config.min_gap_m
    }

    /// True when two anchors lie within this much travel of each other in one run.
    pub fn are_near_along(&self, a: AnchorIdx, b: AnchorIdx, travel_m: f64) -> bool {
        let (a, b) = (self.anchor(a), self.anchor(b));
        a.run == b.run && (a.travel_m - b.travel_m).abs() <= travel_m
    }

    /// The later of two anchors of one run seen from the earlier, by odometry alone.
    pub fn step(&self, from: AnchorIdx, to: AnchorIdx) -> Pose2 {
        self.anchor(from).run_from_anchor.between(&self.anchor(to).run_from_anchor)
    }
}

/// Places of the runs in an order that follows from what was recorded: by their beginnings, which stay when a run
/// grows, then by all of it.
fn order_of(given: &[RunRecord<'_>]) -> Vec<usize> {
    let name = |run: &RunRecord<'_>| {
        let beginning: Vec<&Keyframe> = run.keyframes.iter().take(10).collect();
        let all: Vec<&Keyframe> = run.keyframes.iter().collect();
        (fingerprint(&beginning, &Pose2::identity()), fingerprint(&all, &Pose2::identity()))
    };
    let names: Vec<(u64, u64)> = given.par_iter().map(name).collect();
    let mut places: Vec<usize> = (0..given.len()).collect();
    places.sort_by_key(|&place| (names[place], place));
    places
}

fn travel_of(keyframes: &[Keyframe]) -> Vec<f64> {
    let mut travel_m = 0.0;
    let mut all = Vec::with_capacity(keyframes.len());
    for (index, keyframe) in keyframes.iter().enumerate() {
        if index > 0 {
            travel_m += keyframes[index - 1].run_from_robot.distance(&keyframe.run_from_robot);
        }
        all.push(travel_m);
    }
    all
}

/// The keyframes before and behind an anchor whose scans make its submap.
fn surroundings<'k>(
    keyframes: &'k [Keyframe],
    travel_m: &[f64],
    keyframe: usize,
    config: &MappingConfig,
) -> Vec<&'k Keyframe> {
    let here_m = travel_m[keyframe];
    let first = travel_m.partition_point(|&travel| travel < here_m - config.submap_half_length_m);
    let last = travel_m.partition_point(|&travel| travel <= here_m + config.submap_half_length_m);
    let stride = (last - first).div_ceil(config.max_submap_scans).max(1);
    keyframes[first..last].iter().step_by(stride).collect()
}

fn step_covariance(
    anchors: &[Anchor],
    from: usize,
    runs: &[RunRecord<'_>],
    config: &MappingConfig,
) -> Matrix3<f64> {
    let a = &anchors[from];
    let Some(b) = anchors.get(from + 1).filter(|next| next.run == a.run) else { return Matrix3::identity() };
    let keyframes = &runs[a.run.at()].keyframes[a.keyframe.at()..=b.keyframe.at()];
    let mut pose = Pose2::identity();
    let mut covariance = Matrix3::zeros();
    let mut turned = 0.0;
    for pair in keyframes.windows(2) {
        let motion = pair[0].run_from_robot.between(&pair[1].run_from_robot);
        let step = Matrix3::from_fn(|row, column| pair[1].motion_covariance[row][column]);
        covariance = pose.compose_covariance(&covariance, &motion, &step);
        pose = pose.compose(&motion);
        turned += motion.theta.abs();
    }
    let length_m = (b.travel_m - a.travel_m).max(0.05);
    let place = config.fit_floor_m.max(config.drift_per_m * length_m);
    let turn = (config.drift_turn_rad * length_m.sqrt()).hypot(config.drift_turn_per_rad * turned);
    covariance + Matrix3::from_diagonal(&Vector3::new(place * place, place * place, turn * turn))
}

/// FNV-1a over everything that shapes a submap.
fn fingerprint(keyframes: &[&Keyframe], anchor_pose: &Pose2) -> u64 {
    let mut hash = 0xCBF2_9CE4_8422_2325u64;
    let mut add = |value: u64| hash = (hash ^ value).wrapping_mul(0x0000_0100_0000_01B3);
    for keyframe in keyframes {
        let relative = anchor_pose.between(&keyframe.run_from_robot);
        for value in [relative.x, relative.y, relative.theta] {
            add(value.to_bits());
        }
        for range in &keyframe.ranges_m {
            add(u64::from(range.to_bits()));
        }
    }
    hash
}
