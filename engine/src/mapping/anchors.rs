//! Anchors: every few metres of each run one keyframe that stands for its neighbourhood.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::config::MappingConfig;
use super::run::{Keyframe, RunRecord};
use crate::geometry::Pose2;
use crate::registration::{Submap, SubmapScan};

/// A keyframe that stands for its neighbourhood; a node of the coarse graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Anchor {
    /// Position of the run in the list given to the map builder.
    pub run_idx: u32,
    /// Index into the run's keyframes.
    pub keyframe: u32,
    /// Travel from the beginning of the run, metres.
    pub travel_m: f64,
    /// Pose in the run's frame.
    pub run_from_anchor: Pose2,
    /// Names the content of the submap: equal content, equal number.
    pub fingerprint: u64,
}

/// All anchors of a site in order of runs and travel, with their submaps.
pub(crate) struct AnchorSet {
    pub anchors: Vec<Anchor>,
    pub submaps: Vec<Submap>,
    /// For each run where its anchors begin; one more entry than runs.
    pub starts: Vec<usize>,
    /// For each run the travel at each keyframe, metres.
    pub travels_m: Vec<Vec<f64>>,
}

impl AnchorSet {
    /// Chooses anchors and builds their submaps.
    pub fn build(runs: &[RunRecord<'_>], config: &MappingConfig) -> Self {
        let travels_m: Vec<Vec<f64>> = runs.iter().map(|run| travel_of(run.keyframes)).collect();
        let mut chosen = Vec::new();
        let mut starts = vec![0];
        for (run_idx, travel_m) in travels_m.iter().enumerate() {
            let mut next_m = 0.0;
            for (keyframe, &travel) in travel_m.iter().enumerate() {
                if travel >= next_m || keyframe + 1 == travel_m.len() {
                    chosen.push((run_idx, keyframe));
                    next_m = travel + config.anchor_spacing_m;
                }
            }
            starts.push(chosen.len());
        }
        let built: Vec<(Anchor, Submap)> = chosen
            .par_iter()
            .map(|&(run_idx, keyframe)| {
                build_anchor(&runs[run_idx], run_idx, keyframe, &travels_m[run_idx], config)
            })
            .collect();
        let (anchors, submaps) = built.into_iter().unzip();
        Self { anchors, submaps, starts, travels_m }
    }

    /// Indices of a run's anchors.
    pub fn of_run(&self, run_idx: usize) -> std::ops::Range<usize> {
        self.starts[run_idx]..self.starts[run_idx + 1]
    }

    /// The anchor of a run that is nearest along the travel.
    pub fn nearest(&self, run_idx: usize, travel_m: f64) -> Option<usize> {
        let range = self.of_run(run_idx);
        let after =
            range.start + self.anchors[range.clone()].partition_point(|anchor| anchor.travel_m < travel_m);
        let before = after.saturating_sub(1).max(range.start);
        if range.is_empty() {
            return None;
        }
        let after = after.min(range.end - 1);
        let gap = |index: usize| (self.anchors[index].travel_m - travel_m).abs();
        Some(if gap(before) <= gap(after) { before } else { after })
    }

    /// True when two anchors may be matched: other runs, or far enough apart along the travel.
    pub fn may_match(&self, a: usize, b: usize, min_gap_m: f64) -> bool {
        let (a, b) = (&self.anchors[a], &self.anchors[b]);
        a.run_idx != b.run_idx || (a.travel_m - b.travel_m).abs() >= min_gap_m
    }

    /// Covariance of the refined odometry between two anchors that follow each other.
    pub fn step_covariance(
        &self,
        from: usize,
        runs: &[RunRecord<'_>],
        config: &MappingConfig,
    ) -> Matrix3<f64> {
        let (a, b) = (&self.anchors[from], &self.anchors[from + 1]);
        let keyframes = &runs[a.run_idx as usize].keyframes[a.keyframe as usize..=b.keyframe as usize];
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
        covariance
            + Matrix3::from_diagonal(&nalgebra::Vector3::new(place * place, place * place, turn * turn))
    }
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

fn build_anchor(
    run: &RunRecord<'_>,
    run_idx: usize,
    keyframe: usize,
    travel_m: &[f64],
    config: &MappingConfig,
) -> (Anchor, Submap) {
    let here_m = travel_m[keyframe];
    let first = travel_m.partition_point(|&travel| travel < here_m - config.submap_half_length_m);
    let last = travel_m.partition_point(|&travel| travel <= here_m + config.submap_half_length_m);
    let members = last - first;
    let stride = members.div_ceil(config.max_submap_scans).max(1);
    let used: Vec<&Keyframe> = run.keyframes[first..last].iter().step_by(stride).collect();
    let anchor_pose = run.keyframes[keyframe].run_from_robot;
    let scans: Vec<SubmapScan<'_>> = used
        .iter()
        .map(|keyframe| SubmapScan {
            frame_from_robot: keyframe.run_from_robot,
            ranges_m: &keyframe.ranges_m,
        })
        .collect();
    let anchor = Anchor {
        run_idx: run_idx as u32,
        keyframe: keyframe as u32,
        travel_m: here_m,
        run_from_anchor: anchor_pose,
        fingerprint: fingerprint(&used, &anchor_pose),
    };
    (anchor, Submap::new(run.geometry, &scans, &anchor_pose, &config.submap))
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
