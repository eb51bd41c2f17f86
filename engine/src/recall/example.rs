//! A short recording, translated and made ready to be looked for.

use super::config::RecallConfig;
use crate::config_error::ConfigError;
use crate::geometry::{Point2, Pose2};
use crate::registration::{AreaSearch, Submap, SubmapScan};
use crate::retrieval::RunProfile;
use crate::scan::{Scan, ScanGeometry};
use crate::text::Observation;
use crate::translator::Translator;
use crate::translator::TranslatorConfig;

/// Travel at the end of a recording that settles where exactly it ends, metres.
const TAIL_M: f64 = 5.0;
/// Scans of that at most.
const NUM_TAIL_SCANS_MAX: usize = 30;

/// Points of the sketch, few enough to be tried in many places, and how they are.
pub(super) const SKETCH: (usize, AreaSearch) =
    (60, AreaSearch { reach_m: 8.0, turn_step_rad: 0.05, min_share: 0.45 });
/// Points of the outline, which covers all of the surroundings.
pub(super) const OUTLINE: (usize, AreaSearch) =
    (250, AreaSearch { reach_m: 16.0, turn_step_rad: 0.02, min_share: 0.45 });

/// A short recording as it is looked for.
#[derive(Clone, Debug)]
pub struct Example {
    /// Densities along the drive.
    pub(super) observations: Vec<Observation>,
    pub(super) profile: RunProfile,
    /// What it saw, in the frame of the keyframe in the middle.
    pub(super) submap: Submap,
    pub(super) run_from_submap: Pose2,
    pub(super) sketch: Vec<Point2>,
    pub(super) outline: Vec<Point2>,
    /// What its last metres saw, in the frame of the last keyframe.
    pub(super) tail: Submap,
    pub(super) run_from_tail: Pose2,
    pub(super) run_from_robot: Pose2,
    travel_m: f64,
}

/// A scan that goes into the submap.
struct Keyframe {
    scan: usize,
    run_from_robot: Pose2,
    travel_m: f64,
}

impl Example {
    /// Translates a recording as a run would be; none when it holds nothing to look for.
    ///
    /// # Errors
    /// A config or geometry that cannot work.
    pub fn read(
        translator: &TranslatorConfig,
        geometry: &ScanGeometry,
        scans: &[Scan],
        config: &RecallConfig,
    ) -> Result<Option<Self>, ConfigError> {
        let scans = last_meters(scans, config.length_max_m);
        let mut translator = Translator::new(translator, geometry.clone())?;
        let mut observations: Vec<Observation> = Vec::new();
        let mut keyframes: Vec<Keyframe> = Vec::new();
        let (mut travel_m, mut run_from_robot) = (0.0, Pose2::identity());
        for (scan_idx, scan) in scans.iter().enumerate() {
            let read = translator.push(scan);
            run_from_robot = read.run_from_robot;
            if let Some(cut) = read.cut {
                // Only what was driven since is one place.
                keyframes.clear();
                observations.clear();
                travel_m = 0.0;
                observations
                    .extend(read.observations.into_iter().filter(|seen| seen.scan_seq >= cut.scan_seq));
            } else {
                observations.extend(read.observations);
            }
            if read.keyframe.is_some() {
                travel_m +=
                    keyframes.last().map_or(0.0, |last| last.run_from_robot.distance(&run_from_robot));
                keyframes.push(Keyframe { scan: scan_idx, run_from_robot, travel_m });
            }
        }
        observations.extend(translator.finish().observations);
        let middle = keyframes.partition_point(|keyframe| keyframe.travel_m < 0.5 * travel_m);
        let (Some(middle), Some(last)) = (keyframes.get(middle), keyframes.last()) else { return Ok(None) };
        let submap = |keyframes: &[Keyframe], num_max: usize, frame: &Pose2| {
            let stride = keyframes.len().div_ceil(num_max).max(1);
            let members: Vec<SubmapScan<'_>> = keyframes
                .iter()
                .step_by(stride)
                .map(|keyframe| SubmapScan {
                    frame_from_robot: keyframe.run_from_robot,
                    ranges_m: &scans[keyframe.scan].ranges_m,
                })
                .collect();
            Submap::new(geometry, &members, frame, &config.submap)
        };
        let tail_first = keyframes.partition_point(|keyframe| keyframe.travel_m < travel_m - TAIL_M);
        let whole = submap(&keyframes, config.max_scans, &middle.run_from_robot);
        Ok(Some(Self {
            profile: RunProfile::from_observations(&observations, config.retrieval.sample_spacing_m),
            observations,
            sketch: whole.search_points(SKETCH.1.reach_m, SKETCH.0),
            outline: whole.search_points(OUTLINE.1.reach_m, OUTLINE.0),
            submap: whole,
            run_from_submap: middle.run_from_robot,
            tail: submap(&keyframes[tail_first..], NUM_TAIL_SCANS_MAX, &last.run_from_robot),
            run_from_tail: last.run_from_robot,
            run_from_robot,
            travel_m,
        }))
    }

    /// Metres that it drives.
    pub const fn travel_m(&self) -> f64 {
        self.travel_m
    }
}

/// The scans of the last so many metres of odometry.
fn last_meters(scans: &[Scan], length_m: f64) -> &[Scan] {
    let mut travel_m = 0.0;
    let mut first = scans.len().saturating_sub(1);
    while first > 0 && travel_m <= length_m {
        travel_m += scans[first - 1].odom_from_robot.distance(&scans[first].odom_from_robot);
        first -= 1;
    }
    &scans[first..]
}
