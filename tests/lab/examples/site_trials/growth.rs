//! Growth: a site gets one run after the other, and every build may use what the builds before it remembered.

use std::time::Instant;

use locution_engine::config::EngineConfig;
use locution_engine::mapping::{
    Extended, Foundation, MapSettings, MatchState, RegistrationMemo, RunRecord, SiteMap, Watch,
};
use serde::Serialize;

use crate::Failure;
use crate::driven::Driven;
use crate::fleets::world_from_map;

/// Metres of each run.
const LENGTH_M: f64 = 80.0;
/// People who walk about meanwhile.
const NUM_PEOPLE: usize = 3;
/// Seed of the first run.
const FIRST_SEED: u64 = 500;

/// What the site is like once it holds so many runs.
#[derive(Clone, Debug, Serialize)]
struct Grown {
    num_runs: usize,
    /// Seconds of the build that adds the last run, texts weighed, and of all cores together while it was made.
    seconds: f64,
    core_seconds: f64,
    resident_mib: f64,
    num_remembered: usize,
    /// Runs that are settled, and keyframes that stand for them.
    num_settled: usize,
    num_kept: usize,
    num_components: u32,
    num_matches: usize,
    num_verified: usize,
    num_refused: usize,
    error_m: ErrorM,
}

/// Distance of keyframes from the truth when each component is laid over it, metres.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct ErrorM {
    mean: f64,
    p95: f64,
}

/// Adds the runs of a world and its furnished twin in turns, then maps all of them from nothing.
pub fn grow(num_runs: u64, world: &str) -> Result<(), Failure> {
    let mut runs: Vec<Driven> = Vec::new();
    let (mut site, mut latest) = (Site::default(), SiteMap::default());
    for run in 0..num_runs {
        let world = if run % 2 == 0 { world.to_owned() } else { format!("{world}-furniture") };
        let mut driven = Driven::wandering(&world, LENGTH_M, NUM_PEOPLE, FIRST_SEED + run)?;
        driven.place = "same".to_owned();
        runs.push(driven);
        let (map, grown) = site.built(&runs)?;
        println!("{}", serde_json::to_string(&grown)?);
        latest = map;
    }
    let (began, cores_before) = (Instant::now(), core_seconds());
    let mut site = Site::default();
    let mut at_once = SiteMap::default();
    for end in (0..=runs.len()).filter(|end| end % GENERATION == 0 || *end == runs.len()).skip(1) {
        at_once = site.built(&runs[..end])?.0;
    }
    println!(
        "{num_runs} runs from nothing: {:.1} s, {:.1} s of all cores together, {} as run by run",
        began.elapsed().as_secs_f64(),
        core_seconds() - cores_before,
        if at_once == latest { "the same map" } else { "NOT the same map" }
    );
    Ok(())
}

/// Runs of a generation, as the defaults have it.
const GENERATION: usize = 10;

/// What the builds of a site remember.
#[derive(Default)]
struct Site {
    memo: RegistrationMemo,
    foundation: Foundation,
}

impl Site {
    /// Maps the runs, of which all but those of the last generation are settled.
    fn built(&mut self, runs: &[Driven]) -> Result<(SiteMap, Grown), Failure> {
        let config = EngineConfig::default();
        let (began, cores_before) = (Instant::now(), core_seconds());
        let records: Vec<RunRecord<'_>> =
            runs[self.foundation.num_runs()..].iter().map(Driven::record).collect();
        let settings = MapSettings { mapping: &config.mapping, matching: Some(&config.matching) };
        let Extended { map, foundation } =
            self.foundation.extended(settings, &records, &[], &mut self.memo, Watch::nobody())?;
        self.foundation = foundation.unwrap_or_else(|| std::mem::take(&mut self.foundation));
        let is_verified = |state: MatchState| state == MatchState::Verified;
        let grown = Grown {
            num_runs: runs.len(),
            seconds: began.elapsed().as_secs_f64(),
            core_seconds: core_seconds() - cores_before,
            resident_mib: resident_mib(),
            num_remembered: self.memo.len(),
            num_settled: self.foundation.num_runs(),
            num_kept: self.foundation.num_keyframes(),
            num_components: map.num_components,
            num_matches: map.matches.len(),
            num_verified: map.matches.iter().filter(|found| is_verified(found.state)).count(),
            num_refused: map.refused.len(),
            error_m: error_m(runs, &map),
        };
        Ok((map, grown))
    }
}

fn error_m(runs: &[Driven], map: &SiteMap) -> ErrorM {
    let mut errors_m = Vec::new();
    for component in 0..map.num_components {
        let members = || runs.iter().zip(&map.runs).filter(move |(_, mapped)| mapped.component == component);
        let truth: Vec<_> = members().flat_map(|(run, _)| run.truth.iter().copied()).collect();
        let poses: Vec<_> =
            members().flat_map(|(_, mapped)| mapped.map_from_keyframes.iter().copied()).collect();
        let world_from_map = world_from_map(&truth, &poses);
        let distance_m = |(pose, truth)| world_from_map.compose(pose).distance(truth);
        errors_m.extend(poses.iter().zip(&truth).map(distance_m));
    }
    errors_m.sort_by(f64::total_cmp);
    ErrorM {
        mean: errors_m.iter().sum::<f64>() / errors_m.len().max(1) as f64,
        p95: errors_m.get(errors_m.len() * 95 / 100).copied().unwrap_or_default(),
    }
}

/// Resident memory of this program; 0 where the system does not tell.
fn resident_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or_default() / 1024.0
}

/// Seconds that this program has kept cores busy, whatever else the machine does; 0 where the system does not tell.
fn core_seconds() -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name, which may hold anything, user and system time are the twelfth and the thirteenth field.
    let fields: Vec<&str> =
        stat.rsplit_once(')').map_or(Vec::new(), |(_, fields)| fields.split_whitespace().collect());
    let ticks = |field: &&str| field.parse::<f64>().unwrap_or_default();
    fields.iter().skip(11).take(2).map(ticks).sum::<f64>() / TICKS_PER_SECOND
}
