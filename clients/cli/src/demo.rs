//! `locution demo`: three simulated robots map one office floor together, over HTTP like anyone would.
//!
//! Each robot begins at a place of its own that nobody tells the server. What the server makes of their recordings
//! is judged against the simulator's truth, and the merged map is left to be looked at.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use futures::future::try_join_all;
use indicatif::MultiProgress;
use locution_client::Client;
use locution_engine::formats::{CarmenLog, parse_map_server_yaml};
use locution_engine::geometry::{Point2, Pose2};
use locution_lab::evaluation::{JudgedMatch, TrajectoryError, judge_recognition, judge_trajectory};
use locution_lab::simulation::{SimulatedRun, SimulationConfig, Task, World, simulate_run};

use super::eval::recognition::{judged_match, judged_run};
use super::upload::{UploadOptions, build_with_progress, progress_bar, upload_recording};
use locution_lab::recordings::Recording;
use locution_lab::report::table;
use locution_lab::worlds::decode_picture;
use locution_server::config::ServerConfig;
use locution_server::{RunningServer, StartError, start_server};

const SITE: &str = "office";
const PLAN_PICTURE: &[u8] = include_bytes!("../worlds/office.png");
const PLAN_YAML: &str = include_str!("../worlds/office.yaml");

/// A simulated robot.
struct Robot {
    name: &'static str,
    seed: u64,
    /// Metres in the plan's frame.
    waypoints: &'static [(f64, f64)],
}

/// The first knows the west, the second the east, and the third drives round
/// the whole floor the other way.
const ROBOTS: [Robot; 3] = [
    Robot {
        name: "porter-1",
        seed: 11,
        waypoints: &[
            (9.5, 13.0),
            (9.5, 24.3),
            (22.6, 24.3),
            (22.6, 27.4),
            (29.3, 24.3),
            (29.3, 10.7),
            (9.5, 10.7),
            (9.5, 24.3),
            (29.3, 24.3),
            (29.9, 33.0),
            (29.3, 24.3),
            (29.3, 10.7),
            (16.0, 10.7),
        ],
    },
    Robot {
        name: "porter-2",
        seed: 12,
        waypoints: &[
            (41.0, 19.0),
            (34.6, 13.0),
            (38.0, 10.7),
            (50.2, 10.7),
            (50.2, 24.3),
            (29.3, 24.3),
            (29.3, 10.7),
            (50.2, 10.7),
            (50.2, 24.3),
            (38.4, 24.3),
            (38.4, 21.5),
            (32.0, 16.2),
            (29.3, 16.2),
            (29.3, 10.7),
            (42.0, 10.7),
        ],
    },
    Robot {
        name: "cleaner",
        seed: 13,
        waypoints: &[
            (29.0, 3.0),
            (29.3, 10.7),
            (50.2, 10.7),
            (50.2, 24.3),
            (9.5, 24.3),
            (9.5, 10.7),
            (29.3, 10.7),
            (29.3, 24.3),
            (50.2, 24.3),
            (50.2, 10.7),
            (29.3, 10.7),
            (9.5, 10.7),
            (9.5, 22.0),
        ],
    },
];

/// Runs on a fresh machine, without any file but the binary.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Exit when everything is written instead of serving on.
    #[arg(long)]
    once: bool,
    /// Directory for the server's data and the map; what an earlier demo left in it is replaced.
    #[arg(long, default_value = "demo-out")]
    directory: PathBuf,
}

/// Drives the robots, prints what was recognised and serves the map.
///
/// # Errors
/// The directory or the port cannot be used; the server refused something.
pub fn run(arguments: &DemoArguments) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(demo(arguments))
}

async fn demo(arguments: &DemoArguments) -> Result<()> {
    let began = Instant::now();
    let directory = &arguments.directory;
    let server = serve(&directory.join("data")).await?;
    let client = Client::new(&server.url())?;
    println!(
        "Locution serves on {}. Three robots are about to drive through an office floor of 60 × 35 m.\n",
        server.url()
    );

    let simulated = tokio::task::spawn_blocking(simulate).await??;
    let recordings: Vec<Recording> =
        ROBOTS.iter().zip(&simulated).map(|(robot, run)| recording(robot.name, run)).collect();
    send(&client, &recordings).await?;
    let built = Instant::now();
    build_with_progress(&client, SITE).await?;
    println!("The map was built in {:.1} s.\n", built.elapsed().as_secs_f64());

    report(&client, &recordings, &simulated).await?;
    write_map(&client, directory).await?;
    println!("\nThe demo took {:.1} s.", began.elapsed().as_secs_f64());
    if !arguments.once {
        print_addresses(&server.url());
        tokio::signal::ctrl_c().await?;
    }
    Ok(server.shutdown().await?)
}

/// The server on its usual port, or on a free one when that is taken.
async fn serve(data_directory: &Path) -> Result<RunningServer> {
    if data_directory.exists() {
        let problem = || format!("cannot replace {}", data_directory.display());
        std::fs::remove_dir_all(data_directory).with_context(problem)?;
    }
    let mut config = ServerConfig { data_directory: data_directory.to_owned(), ..ServerConfig::default() };
    // The demo asks for its one map itself, when all robots are back.
    config.builds.is_automatic = false;
    match start_server(config.clone()).await {
        Err(StartError::Listen { .. }) => {
            config.address.set_port(0);
            Ok(start_server(config).await?)
        }
        started => Ok(started?),
    }
}

fn simulate() -> Result<Vec<SimulatedRun>> {
    let yaml = parse_map_server_yaml(PLAN_YAML)?;
    let world = World::from_map_server(&decode_picture(PLAN_PICTURE)?, &yaml)?;
    let mut config = SimulationConfig::default();
    config.people.num_people = 2;
    let mut runs = Vec::new();
    for Robot { name, seed, waypoints } in ROBOTS {
        let route = Task::Route(waypoints.iter().map(|&(x, y)| Point2::new(x, y)).collect());
        let run = simulate_run(&world, &route, &config, seed)?;
        let poses: Vec<Pose2> = run.truth.iter().map(|pose| pose.truth_from_robot).collect();
        let driven_m: f64 = poses.windows(2).map(|pair| pair[0].distance(&pair[1])).sum();
        println!("  {name:<10} will drive {driven_m:.0} m and scan {} times", run.scans.len());
        runs.push(run);
    }
    println!();
    Ok(runs)
}

fn recording(name: &str, run: &SimulatedRun) -> Recording {
    let log = CarmenLog { geometry: run.geometry.clone(), scans: run.scans.clone(), skipped: Vec::new() };
    Recording { name: name.to_owned(), log }
}

/// All robots at once, each posting its own scans.
async fn send(client: &Client, recordings: &[Recording]) -> Result<()> {
    client.put_site(SITE, None).await?;
    let (bars, options) = (MultiProgress::new(), UploadOptions::default());
    let uploads = recordings.iter().map(|recording| {
        let bar = progress_bar(&bars, &recording.name, recording.log.scans.len());
        let options = &options;
        async move {
            let names = (SITE, recording.name.as_str(), recording.name.as_str());
            upload_recording(client, names, &recording.log, options, &bar).await
        }
    });
    let uploads = try_join_all(uploads).await?;
    let rows: Vec<Vec<String>> = recordings
        .iter()
        .zip(&uploads)
        .map(|(recording, uploaded)| {
            let numbers = [uploaded.num_scans, uploaded.num_observations, uploaded.num_words];
            let numbers = numbers.iter().map(u64::to_string);
            let rate = format!("{:.0}", uploaded.num_scans as f64 / uploaded.duration_s.max(1e-9));
            std::iter::once(recording.name.clone()).chain(numbers).chain([rate]).collect()
        })
        .collect();
    println!("\n{}", table(&["robot", "scans", "observations", "words", "scans/s"], &rows));
    Ok(())
}

/// What was recognised and how good the map is, by the simulator's truth.
async fn report(client: &Client, recordings: &[Recording], simulated: &[SimulatedRun]) -> Result<()> {
    let names: Vec<&str> = recordings.iter().map(|recording| recording.name.as_str()).collect();
    let mut runs = Vec::new();
    for (recording, run) in recordings.iter().zip(simulated) {
        let observations = client.observations(SITE, &recording.name).await?;
        runs.push(judged_run(recording, &observations, &run.truth, 0));
    }
    let matches = client.matches(SITE, "").await?;
    let judged: Vec<JudgedMatch> = matches.iter().filter_map(|found| judged_match(found, &names)).collect();
    let recognition = judge_recognition(&runs, &judged);
    let num_verified = judged.iter().filter(|found| found.is_verified).count();
    let num_between =
        matches.iter().filter(|found| found.state == "verified" && found.earlier.run != found.later.run);
    println!("What was recognised (against the simulator's truth)");
    println!("  candidates          {}", judged.len());
    println!("  verified matches    {num_verified}, {} of them between two robots", num_between.count());
    println!(
        "  revisits            {} the same way, {} the opposite way",
        recognition.revisits.same, recognition.revisits.opposite
    );
    println!("  verified precision  {:.1} %", 100.0 * recognition.verified.precision);
    println!("  verified recall     {:.1} %", 100.0 * recognition.verified.recall_all);

    let before = trajectory_errors(client, &names, simulated, "odom").await?;
    let after = trajectory_errors(client, &names, simulated, "map").await?;
    let rows: Vec<Vec<String>> =
        [("odometry, each robot by itself", before), ("map, all robots together", after)]
            .into_iter()
            .flat_map(|(what, errors)| {
                errors.into_iter().map(move |(part, error)| {
                    vec![
                        format!("{what}: {part}"),
                        format!("{:.3} ± {:.3}", error.translation_m.mean, error.translation_m.sd),
                        format!("{:.3}", error.translation_max_m),
                        format!("{:.2}", error.rotation_deg.mean),
                    ]
                })
            })
            .collect();
    println!("\nMap error before and after optimisation");
    println!("{}", table(&["", "position m", "largest m", "heading °"], &rows));
    Ok(())
}

/// Robots that share a frame, with their (estimated, true) poses.
struct MapPart<'a> {
    component: u64,
    names: Vec<&'a str>,
    pairs: Vec<(Pose2, Pose2)>,
}

/// Error of the trajectories in one frame; runs of one component of the map share its frame and are judged together.
async fn trajectory_errors(
    client: &Client,
    names: &[&str],
    simulated: &[SimulatedRun],
    frame: &str,
) -> Result<Vec<(String, TrajectoryError)>> {
    let mut parts: Vec<MapPart<'_>> = Vec::new();
    for (idx, (&name, run)) in names.iter().zip(simulated).enumerate() {
        let trajectory = client.trajectory(SITE, name, frame).await?;
        let component = trajectory.component.unwrap_or(idx as u64);
        let pairs = trajectory.poses.iter().filter_map(|pose| {
            let truth = run.truth.get(usize::try_from(pose.scan_seq).ok()?)?;
            Some((Pose2::new(pose.x, pose.y, pose.theta), truth.truth_from_robot))
        });
        match parts.iter_mut().find(|part| part.component == component) {
            Some(part) => {
                part.names.push(name);
                part.pairs.extend(pairs);
            }
            None => parts.push(MapPart { component, names: vec![name], pairs: pairs.collect() }),
        }
    }
    Ok(parts.into_iter().map(|part| (part.names.join(" + "), judge_trajectory(&part.pairs))).collect())
}

async fn write_map(client: &Client, directory: &Path) -> Result<()> {
    println!("Written");
    for (path, accept, file) in [
        ("map", "application/json", "map.json"),
        ("map/picture.png", "image/png", "map.png"),
        ("map/grid.pgm", "image/x-portable-graymap", "grid.pgm"),
        ("map/grid.yaml", "application/yaml", "grid.yaml"),
        ("map/graph.g2o", "text/plain", "graph.g2o"),
    ] {
        let bytes = client.download(&format!("/v1/sites/{SITE}/{path}"), accept).await?;
        let target = directory.join(file);
        std::fs::write(&target, &bytes).with_context(|| format!("cannot write {}", target.display()))?;
        println!("  {}  ({} bytes)", target.display(), bytes.len());
    }
    Ok(())
}

fn print_addresses(url: &str) {
    println!("\nThe server stays up; stop it with ctrl-c. To look at:");
    for path in [
        "/ui",
        "/v1/sites/office/map/picture.png",
        "/v1/sites/office/map",
        "/v1/sites/office/matches?state=verified",
        "/docs",
        "/metrics",
    ] {
        println!("  {url}{path}");
    }
}
