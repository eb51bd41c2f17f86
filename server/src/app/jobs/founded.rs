//! The engine's part of a build, generation after generation: what is settled is remembered and not made again.

use std::ops::ControlFlow;

use locution_engine::config::EngineConfig;
use locution_engine::mapping::{
    Decision, Extended, Foundation, MapSettings, MapStage, MapStep, MappingError, RunRecord, SiteMap, Watch,
};

use crate::app::AppError;
use crate::app::site::{BuildMemory, BuildStage, Progress};
use crate::records::Digest;

/// Share of a generation's work that is done before its runs are laid over each other.
const SETTLING_SHARE: f64 = 0.5;
/// The foundation of the served map, and that of the next one if the last generation is full.
const NUM_FOUNDATIONS_MAX: usize = 2;

/// What a map is made of.
pub struct MadeFrom<'a> {
    pub config: &'a EngineConfig,
    pub runs: &'a [RunRecord<'a>],
    pub decisions: &'a [Decision],
    /// Names everything that the first so many runs amount to.
    pub settled_digest: &'a dyn Fn(usize) -> Digest,
}

/// The map of a site. It follows from what it is made of, whatever is remembered.
///
/// # Errors
/// [`AppError::Stopping`] when it has to end before; what was settled until then is remembered.
pub fn founded_map(
    memory: &mut BuildMemory,
    from: &MadeFrom<'_>,
    progress: &Progress,
) -> Result<SiteMap, AppError> {
    let num_of_generation = from.config.mapping.generation_runs.max(1);
    let num_runs = from.runs.len();
    let num_settled_max = num_runs.saturating_sub(1) / num_of_generation * num_of_generation;
    forget_others(memory, from, num_settled_max);
    let first = memory.foundations.last().map_or(0, |(_, foundation)| foundation.num_runs());
    let num_generations = ((num_settled_max - first) / num_of_generation + 1) as f64;
    let mut num_done = 0.0;
    loop {
        let nothing = Foundation::default();
        let foundation = memory.foundations.last().map_or(&nothing, |(_, foundation)| foundation);
        let num_settled = foundation.num_runs();
        let end = (num_settled + num_of_generation).min(num_runs);
        let is_last = num_settled >= num_settled_max;
        let told = |step: MapStep| {
            let (stage, share) = stage_of_all(&step, num_done, num_generations);
            match progress.at(stage, share) {
                Ok(()) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        };
        let settings = MapSettings { mapping: &from.config.mapping, matching: Some(&from.config.matching) };
        let runs = &from.runs[num_settled..end];
        let Extended { map, foundation } = foundation
            .extended(settings, runs, from.decisions, &mut memory.registrations, Watch::new(&told))
            .map_err(|error| match error {
                MappingError::Stopped => AppError::Stopping,
                MappingError::Graph(error) => AppError::internal(error),
            })?;
        if let Some(next) = foundation {
            let digest = (from.settled_digest)(next.num_runs());
            memory.foundations.push((digest, next));
            let num_stale = memory.foundations.len().saturating_sub(NUM_FOUNDATIONS_MAX);
            memory.foundations.drain(..num_stale);
        }
        if is_last {
            return Ok(map);
        }
        num_done += 1.0;
    }
}

/// Keeps the foundation that these runs go on from, if it is remembered.
fn forget_others(memory: &mut BuildMemory, from: &MadeFrom<'_>, num_settled_max: usize) {
    memory.foundations.retain(|(digest, foundation)| {
        let num_runs = foundation.num_runs();
        num_runs <= num_settled_max && (from.settled_digest)(num_runs) == *digest
    });
}

/// A step within a generation as one within all of them.
fn stage_of_all(step: &MapStep, num_done: f64, num_generations: f64) -> (BuildStage, f64) {
    let within = match step.stage {
        MapStage::Settling => SETTLING_SHARE * step.share,
        MapStage::Joining => SETTLING_SHARE + (1.0 - SETTLING_SHARE) * step.share,
    };
    let share = (num_done + within) / num_generations;
    match share < SETTLING_SHARE || (num_done == 0.0 && step.stage == MapStage::Settling) {
        true => (BuildStage::Settling, (share / SETTLING_SHARE).min(1.0)),
        false => (BuildStage::Joining, ((share - SETTLING_SHARE) / (1.0 - SETTLING_SHARE)).max(0.0)),
    }
}

#[cfg(test)]
mod tests {
    use locution_engine::geometry::Pose2;
    use locution_engine::scan::ScanGeometry;

    use super::*;

    /// Maps runs that never moved, of which each has a version; returns of how many runs foundations are remembered.
    fn built(memory: &mut BuildMemory, versions: &[u8]) -> Vec<usize> {
        let geometry = ScanGeometry {
            num_ranges: 1,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        };
        let record =
            RunRecord { geometry: &geometry, observations: &[], words: &[], keyframes: &[], area: None };
        let mut config = EngineConfig::default();
        config.mapping.generation_runs = 2;
        let settled_digest = |num_runs: usize| {
            let mut digest = Digest::default();
            digest[..num_runs].copy_from_slice(&versions[..num_runs]);
            digest
        };
        let from = MadeFrom {
            config: &config,
            runs: &vec![record; versions.len()],
            decisions: &[],
            settled_digest: &settled_digest,
        };
        let map = founded_map(memory, &from, &Progress::unwatched()).unwrap();
        assert_eq!((map.runs.len(), map.num_components as usize), (versions.len(), versions.len()));
        memory.foundations.iter().map(|(_, foundation)| foundation.num_runs()).collect()
    }

    #[test]
    fn a_build_goes_on_from_what_is_settled_and_a_changed_run_makes_it_begin_before_it() {
        let mut memory = BuildMemory::default();
        assert_eq!(built(&mut memory, &[1]), [0; 0]);
        assert_eq!(built(&mut memory, &[1, 1, 1]), [2]);
        assert_eq!(built(&mut memory, &[1, 1, 1, 1, 1, 1, 1]), [4, 6]);
        let digest_before = memory.foundations[0].0;
        // The open generation and the last full one may change; what lies before stays.
        assert_eq!(built(&mut memory, &[1, 1, 1, 1, 1, 2, 2]), [4, 6]);
        assert_eq!(memory.foundations[0].0, digest_before);
        assert_eq!(built(&mut memory, &[1, 1, 2, 1, 1, 2, 2]), [4, 6]);
        assert_ne!(memory.foundations[0].0, digest_before);
        assert_eq!(
            built(&mut memory, &[1, 1, 2]),
            [2],
            "a generation that is not full any more is open again"
        );
    }
}
