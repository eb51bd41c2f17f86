//! `locution simulate`: a CARMEN log and its truth from a robot driving through a map_server world.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use flate2::Compression;
use flate2::write::GzEncoder;
use locution_engine::formats::{carmen_header, carmen_scan_lines, truth_text};
use locution_engine::geometry::Point2;
use locution_lab::simulation::{SimulatedRun, SimulationConfig, Task, World, simulate_run};

use locution_lab::report::write_json;
use locution_lab::thesis::scenarios::Plan;
use locution_lab::worlds::read_world;

/// The same arguments give the same bytes.
#[derive(Debug, Args)]
pub struct SimulateArguments {
    /// YAML file of a ROS map_server world.
    #[arg(long, required_unless_present = "plan")]
    world: Option<PathBuf>,
    /// Instead of a world: a floor of corridors whose places are known; they are written to NAME.labels.json.
    #[arg(long, value_enum, conflicts_with_all = ["world", "second_world"])]
    plan: Option<Plan>,
    /// The same building with other doors or furniture, in the same frame; the task is driven there once more, as a
    /// second recording NAME-second.
    #[arg(long)]
    second_world: Option<PathBuf>,
    /// Waypoints in the world's frame, metres: "x,y x,y …".
    #[arg(long, conflicts_with = "wander")]
    route: Option<String>,
    /// Drive about to random places for this many metres.
    #[arg(long)]
    wander: Option<f64>,
    /// Where to begin to wander: "x,y" [default: at random].
    #[arg(long, requires = "wander")]
    start: Option<String>,
    /// Chooses one of the possible recordings.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Beginning of the names of the files written: NAME.log and NAME.truth.
    #[arg(long)]
    out: PathBuf,
    /// Write NAME.log.gz and NAME.truth.gz.
    #[arg(long)]
    gzip: bool,
    /// Field of view, degrees.
    #[arg(long, default_value_t = 180.0)]
    fov: f64,
    /// Readings per scan [default: one a degree].
    #[arg(long)]
    beams: Option<usize>,
    /// Largest range that gives a return, metres.
    #[arg(long, default_value_t = 30.0)]
    range_max: f64,
    /// Standard deviation of a reading, metres.
    #[arg(long, default_value_t = 0.02)]
    noise: f64,
    /// Odometry errors, as a multiple of a good two-wheeled robot's; 0 is perfect.
    #[arg(long, default_value_t = 1.0)]
    drift: f64,
    /// People who walk about.
    #[arg(long, default_value_t = 0)]
    people: usize,
    /// Top speed, metres per second.
    #[arg(long, default_value_t = 0.7)]
    speed: f64,
    /// Time from one scan to the next, seconds.
    #[arg(long, default_value_t = 0.1)]
    scan_period: f64,
}

impl SimulateArguments {
    fn task(&self) -> Result<Task> {
        match (&self.route, self.wander) {
            (Some(route), _) => Ok(Task::Route(parse_points(route)?)),
            (None, Some(length_m)) => {
                let start = self.start.as_deref().map(parse_points).transpose()?;
                ensure!(start.as_ref().is_none_or(|points| points.len() == 1), "--start is one point");
                Ok(Task::Wander { length_m, start: start.map(|points| points[0]) })
            }
            (None, None) => bail!("say where to drive: --route \"x,y x,y …\" or --wander METRES"),
        }
    }

    fn config(&self) -> SimulationConfig {
        let mut config = SimulationConfig::default();
        config.laser.field_of_view_deg = self.fov;
        let num_gaps = self.fov.clamp(1.0, 360.0).round() as usize;
        config.laser.num_ranges =
            self.beams.unwrap_or(if self.fov < 360.0 { num_gaps + 1 } else { num_gaps });
        config.laser.range_max_m = self.range_max;
        config.laser.range_noise_std_m = self.noise;
        config.odometry = config.odometry.scaled(self.drift);
        config.people.num_people = self.people;
        config.drive.speed_m_per_s = self.speed;
        config.drive.scan_period_s = self.scan_period;
        config
    }
}

/// Simulates and writes one recording, or two with a second world.
///
/// # Errors
/// Files that cannot be read or written; a task that cannot be driven.
pub fn run(arguments: &SimulateArguments) -> Result<()> {
    let name = arguments.out.to_string_lossy().into_owned();
    if let Some(plan) = arguments.plan {
        let (world, places) = plan.draw()?;
        drive(arguments, &world, &name, arguments.seed)?;
        return write_json(Path::new(&format!("{name}.labels.json")), &places);
    }
    let second =
        arguments.second_world.iter().map(|world| (world, format!("{name}-second"), arguments.seed + 1));
    let first = arguments.world.iter().map(|world| (world, name.clone(), arguments.seed));
    for (world_path, name, seed) in first.chain(second) {
        drive(arguments, &read_world(world_path)?, &name, seed)
            .with_context(|| world_path.display().to_string())?;
    }
    Ok(())
}

/// Simulates one recording and writes it.
fn drive(arguments: &SimulateArguments, world: &World, name: &str, seed: u64) -> Result<()> {
    let simulated = simulate_run(world, &arguments.task()?, &arguments.config(), seed)?;
    let written = write_recording(&simulated, name, arguments.gzip)?;
    let poses = &simulated.truth;
    let driven_m: f64 =
        poses.windows(2).map(|pair| pair[0].truth_from_robot.distance(&pair[1].truth_from_robot)).sum();
    println!("{}: {} scans over {driven_m:.1} m", written.join(", "), simulated.scans.len());
    Ok(())
}

/// Writes NAME.log and NAME.truth; answers the names of the files.
fn write_recording(simulated: &SimulatedRun, name: &str, is_gzipped: bool) -> Result<Vec<String>> {
    let ending = if is_gzipped { ".gz" } else { "" };
    let (log_path, truth_path) = (format!("{name}.log{ending}"), format!("{name}.truth{ending}"));
    let mut log = create(Path::new(&log_path), is_gzipped)?;
    log.write_all(carmen_header("simulated").as_bytes())?;
    for scan in &simulated.scans {
        log.write_all(carmen_scan_lines(&simulated.geometry, scan, "simulated").as_bytes())?;
    }
    log.flush()?;
    let mut truth = create(Path::new(&truth_path), is_gzipped)?;
    truth.write_all(truth_text(&simulated.truth).as_bytes())?;
    truth.flush()?;
    Ok(vec![log_path, truth_path])
}

fn create(path: &Path, is_gzipped: bool) -> Result<Box<dyn Write>> {
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    let plain = BufWriter::new(file);
    Ok(if is_gzipped { Box::new(GzEncoder::new(plain, Compression::default())) } else { Box::new(plain) })
}

/// Points "x,y x,y …", separated by spaces or semicolons.
fn parse_points(text: &str) -> Result<Vec<Point2>> {
    let words = text.split([' ', ';']).filter(|word| !word.is_empty());
    words
        .map(|word| {
            let (x, y) = word.split_once(',').with_context(|| format!("'{word}' is not of the form x,y"))?;
            let number = |part: &str| part.trim().parse::<f64>().with_context(|| format!("'{word}'"));
            let point = Point2::new(number(x)?, number(y)?);
            ensure!(point.x.is_finite() && point.y.is_finite(), "'{word}' is not finite");
            Ok(point)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_or_refused() {
        assert_eq!(
            parse_points("1,2 -3.5,4;5,6").unwrap(),
            [Point2::new(1.0, 2.0), Point2::new(-3.5, 4.0), Point2::new(5.0, 6.0)]
        );
        for bad in ["1 2", "1,x", "nan,1", "1,2,3"] {
            assert!(parse_points(bad).is_err(), "{bad}");
        }
    }
}
