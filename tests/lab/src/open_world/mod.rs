//! `locution eval open-world`: robots switched on in maps of their own building, of a part of it, and of others.
//!
//! Everything runs in the engine, without a server: a session per robot, asked after every half metre.

mod features;
mod prepared;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::Args;
use locution_engine::config::EngineConfig;
use locution_engine::geometry::{Pose2, angle_between};
use locution_engine::locate::{LocalizationState, SessionConfig, SiteSession};
use locution_engine::scan::Scan;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use self::features::FeatureLog;
pub use self::prepared::{Part, PreparedMap};
use crate::evaluation::{OpenWorldReport, OpenWorldStep, OpenWorldTrial, judge_open_world};
use crate::report::{table, write_json};

/// A robot asks where it is each time it has driven so far, metres.
const ASK_EVERY_M: f64 = 0.5;
/// Nearer than this is right.
const RIGHT_M: f64 = 0.5;
/// A heading closer than this is right.
const RIGHT_DEG: f64 = 10.0;

/// Which robots on which maps.
#[derive(Debug, Args)]
pub struct OpenWorldArguments {
    /// Pairs MAP:ROBOTS of recordings; a recording is NAME or NAME@FROM,TO, shares of its scans.
    #[arg(required = true)]
    pairs: Vec<String>,
    /// Folder of NAME.log.gz and NAME.truth.gz.
    #[arg(long)]
    recordings: PathBuf,
    /// Robots switched on in each pair.
    #[arg(long, default_value_t = 100)]
    starts: usize,
    /// Metres that each of them drives.
    #[arg(long, default_value_t = 20.0)]
    meters: f64,
    /// Carry each robot to another place after half of its way; its odometry does not notice.
    #[arg(long)]
    carried: bool,
    /// Chooses the moments.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// JSON file with the engine's configuration, whole or in part [default: the defaults].
    #[arg(long)]
    config: Option<PathBuf>,
    /// Folder in which poses of maps are kept from one call to the next.
    #[arg(long)]
    cache: Option<PathBuf>,
    /// Write what speaks for and against every place that was judged here, a JSON line a judgement.
    #[arg(long)]
    features: Option<PathBuf>,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct PairReport {
    map: String,
    robots: String,
    #[serde(flatten)]
    outcome: OpenWorldReport,
}

/// Runs the trials of all pairs and prints a table.
///
/// # Errors
/// Recordings that cannot be read; files that cannot be written.
pub fn run(arguments: &OpenWorldArguments) -> Result<()> {
    let config: EngineConfig = match &arguments.config {
        Some(path) => serde_json::from_slice(&std::fs::read(path)?)?,
        None => EngineConfig::default(),
    };
    let session_config = Arc::new(config.session());
    let mut log = FeatureLog::create(arguments.features.as_ref())?;
    let mut parts: BTreeMap<&str, Part> = BTreeMap::new();
    let mut maps: BTreeMap<&str, PreparedMap> = BTreeMap::new();
    let mut reports = Vec::new();
    for pair in &arguments.pairs {
        let (map, robots) = pair.split_once(':').context("a pair is MAP:ROBOTS")?;
        for name in [map, robots] {
            if !parts.contains_key(name) {
                parts.insert(name, Part::read(&arguments.recordings, name)?);
            }
        }
        if !maps.contains_key(map) {
            maps.insert(map, PreparedMap::of(&parts[map], &config, arguments.cache.as_ref())?);
        }
        log.begin(map, robots);
        let trials = trials(&maps[map], &parts[robots], &session_config, arguments, &mut log)?;
        let outcome = judge_open_world(&trials);
        reports.push(PairReport { map: map.to_owned(), robots: robots.to_owned(), outcome });
        eprintln!("{pair}: {:.3} of {} ever wrongly sure", outcome.ever_wrongly_sure, outcome.trials);
    }
    print!("{}", report_table(&reports));
    match &arguments.json {
        Some(path) => write_json(path, &reports),
        None => Ok(()),
    }
}

fn trials(
    map: &PreparedMap,
    robots: &Part,
    config: &Arc<SessionConfig>,
    arguments: &OpenWorldArguments,
    log: &mut FeatureLog,
) -> Result<Vec<OpenWorldTrial>> {
    let end_m = robots.length_m();
    // A recording that is too short for the whole way gives shorter ones.
    let drive_m = arguments.meters.min(0.6 * end_m);
    let num_starts = robots.travel_m.partition_point(|&at_m| at_m <= end_m - drive_m);
    ensure!(num_starts > 0, "{} is too short", robots.name);
    let mut rng = ChaCha8Rng::seed_from_u64(arguments.seed);
    let walk = |from: usize, length_m: f64| {
        (from..robots.scans.len())
            .take_while(move |&idx| robots.travel_m[idx] - robots.travel_m[from] <= length_m)
    };
    let mut all = Vec::new();
    for trial in 0..arguments.starts {
        let start = rng.random_range(0..num_starts);
        let carried_to = arguments.carried.then(|| rng.random_range(0..num_starts));
        let way: Vec<usize> = match carried_to {
            Some(other) => walk(start, 0.5 * drive_m).chain(walk(other, 0.5 * drive_m)).collect(),
            None => walk(start, drive_m).collect(),
        };
        log.trial = trial;
        all.push(drive(map, robots, &way, config, log)?);
    }
    Ok(all)
}

/// Switches a robot on and drives it along scans; where they do not follow one another it is carried.
fn drive(
    map: &PreparedMap,
    robots: &Part,
    way: &[usize],
    config: &Arc<SessionConfig>,
    log: &mut FeatureLog,
) -> Result<OpenWorldTrial> {
    let mut session =
        SiteSession::new(robots.geometry.clone(), Arc::clone(config), map.session_map.clone(), None);
    let mut trial = OpenWorldTrial::default();
    let mut odom_from_recorded = Pose2::identity();
    let mut before: Option<(usize, Pose2)> = None;
    let mut asked_m = 0.0;
    for &idx in way {
        let scan = &robots.scans[idx];
        if let Some((last, odom_from_robot)) = before
            && idx != last + 1
        {
            odom_from_recorded = odom_from_robot.compose(&scan.odom_from_robot.inverse());
            trial.carried_at_m = Some(session.travel_m());
        }
        let odom_from_robot = odom_from_recorded.compose(&scan.odom_from_robot);
        before = Some((idx, odom_from_robot));
        session.push(&Scan { odom_from_robot, ..scan.clone() });
        if session.travel_m() - asked_m < ASK_EVERY_M {
            continue;
        }
        asked_m = session.travel_m();
        let expected = map.expected(robots, idx);
        trial.steps.push(step(&session, expected));
        log.write(&session, expected, |pose| is_right(pose, expected))?;
    }
    Ok(trial)
}

fn step(session: &SiteSession, expected: Option<Option<Pose2>>) -> OpenWorldStep {
    let best = session.judged().first().map(|best| best.map_from_robot.compose(&session.since_judged()));
    OpenWorldStep {
        travel_m: session.travel_m(),
        is_on_map: expected.map(|pose| pose.is_some()),
        is_sure: session.state() == LocalizationState::Converged,
        is_right: best.is_some_and(|pose| is_right(&pose, expected)),
    }
}

fn is_right(pose: &Pose2, expected: Option<Option<Pose2>>) -> bool {
    expected.flatten().is_some_and(|expected| {
        pose.distance(&expected) < RIGHT_M
            && angle_between(pose.theta, expected.theta) < RIGHT_DEG.to_radians()
    })
}

fn report_table(reports: &[PairReport]) -> String {
    let meters = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
    let row = |report: &PairReport| {
        let outcome = &report.outcome;
        vec![
            format!("{}, {}", report.map, report.robots),
            outcome.trials.to_string(),
            format!("{:.1} %", 100.0 * outcome.ever_wrongly_sure),
            format!("{:.1}", outcome.wrongly_sure_m),
            outcome.on_map.to_string(),
            format!("{:.1} %", 100.0 * outcome.found),
            format!("{:.1} %", 100.0 * outcome.found_within_15_m),
            meters(outcome.meters_to_converge.median),
            meters(outcome.meters_to_converge.p90),
            meters(outcome.carried_wrongly_sure_m),
        ]
    };
    let header = [
        "map, robots",
        "robots",
        "ever wrong",
        "m wrong",
        "on map",
        "found",
        "in 15 m",
        "median m",
        "p90 m",
        "carried m",
    ];
    table(&header, &reports.iter().map(row).collect::<Vec<_>>())
}
