//! `locution eval robust`: pose graphs into which wrong closures are forged, as the papers on robust back ends do.
//!
//! A draw is survived when the poses are as good as without the wrong closures: within 5 % of the clean graph's error
//! where the truth is known, and else within 5 cm of the clean graph's solution (root mean square).

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use locution_engine::geometry::Pose2;
use locution_engine::pose_graph::{
    Kernel, PoseGraph, PoseGraphConfig, RobustConfig, Trust, optimize, optimize_robust,
};
use locution_lab::evaluation::{Generator, OutlierDraw, rms_error_m, spoil};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::optimize::read_graph;
use locution_lab::recordings::read_text;
use locution_lab::report::{table, write_json};

/// Shares are those of the wrong closures among all closures.
#[derive(Debug, Args)]
pub struct RobustArguments {
    /// Graphs in g2o or TORO, plain or gzipped.
    #[arg(long = "graph", required = true, num_args = 1..)]
    graphs: Vec<PathBuf>,
    /// True poses of a single graph: lines of x y theta.
    #[arg(long)]
    truth: Option<PathBuf>,
    /// Who draws the wrong closures.
    #[arg(long, value_enum, num_args = 1.., default_values = ["vertigo-random", "vertigo-local", "risam-random", "risam-close"])]
    generators: Vec<GeneratorArgument>,
    /// Wrong closures in a row that agree with one another.
    #[arg(long, num_args = 1.., default_values_t = [1, 10, 50])]
    groups: Vec<u32>,
    /// Percent of wrong closures.
    #[arg(long, num_args = 1.., default_values_t = [10, 20, 30, 40, 50, 60, 70, 80, 90])]
    shares: Vec<u32>,
    /// Draws of each kind.
    #[arg(long, default_value_t = 10)]
    draws: u64,
    /// Write the report here.
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GeneratorArgument {
    /// Vertigo (IPC, TACO): near the identity, ends anywhere.
    VertigoRandom,
    /// Vertigo, ends at most 20 poses apart.
    VertigoLocal,
    /// riSAM: the identity, ends anywhere.
    RisamRandom,
    /// riSAM, ends within 10 m.
    RisamClose,
}

impl From<GeneratorArgument> for Generator {
    fn from(generator: GeneratorArgument) -> Self {
        match generator {
            GeneratorArgument::VertigoRandom => Self::VertigoRandom,
            GeneratorArgument::VertigoLocal => Self::VertigoLocal,
            GeneratorArgument::RisamRandom => Self::RisamRandom,
            GeneratorArgument::RisamClose => Self::RisamClose,
        }
    }
}

/// Draws of one kind into one graph.
#[derive(Debug, Serialize)]
struct Row {
    graph: String,
    #[serde(flatten)]
    draw: OutlierDraw,
    percent: u32,
    survived: usize,
    draws: usize,
    /// Error of each draw, metres.
    errors_m: Vec<f64>,
    /// Wrong closures that were kept, over all draws.
    wrong_kept: usize,
    wrong: usize,
    /// Right closures that were rejected, over all draws.
    right_lost: usize,
    right: usize,
    seconds: f64,
}

#[derive(Debug, Serialize)]
struct RobustReport {
    rows: Vec<Row>,
}

/// Largest error of a survived draw: of the clean error, or metres where there is no truth.
const SURVIVED_FACTOR: f64 = 1.05;
const SURVIVED_M: f64 = 0.05;

/// A graph, its solution without wrong closures, and how good that is.
struct Clean {
    name: String,
    graph: PoseGraph,
    solution: Vec<Pose2>,
    truth: Vec<Pose2>,
    tolerated_m: f64,
}

impl Clean {
    fn read(path: &Path, truth: Option<&Path>) -> Result<Self> {
        let graph = read_graph(path)?.0.graph;
        let mut solved = graph.clone();
        optimize(&mut solved, &PoseGraphConfig::default()).with_context(|| path.display().to_string())?;
        let solution = solved.poses().to_vec();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.split('.').next().unwrap_or_default().to_owned();
        let (truth, tolerated_m) = match truth {
            None => (solution.clone(), SURVIVED_M),
            Some(path) => {
                let truth = read_poses(path)?;
                ensure!(truth.len() == solution.len(), "{} has another number of poses", path.display());
                let clean_m = rms_error_m(&solution, &truth);
                println!("{name}: {clean_m:.3} m without wrong closures");
                (truth, SURVIVED_FACTOR * clean_m)
            }
        };
        Ok(Self { name, graph, solution, truth, tolerated_m })
    }

    fn judge(&self, draw: OutlierDraw, percent: u32, num_draws: u64) -> Result<Row> {
        let began = Instant::now();
        let num_right = self.graph.constraints().len();
        let robust = RobustConfig { kernel: Kernel::GraduatedNonConvexity, ..RobustConfig::default() };
        let outcomes = (0..num_draws).into_par_iter().map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(1000 * u64::from(percent) + seed);
            let mut graph = spoil(&self.graph, &self.solution, draw, percent, &mut rng)?;
            let report = optimize_robust(&mut graph, &PoseGraphConfig::default(), &robust)?;
            let num_kept = |weights: &[f64]| weights.iter().filter(|&&weight| weight > 0.0).count();
            let (right, wrong) = report.inlier_weights.split_at(num_right);
            let error_m = rms_error_m(graph.poses(), &self.truth);
            Ok((error_m, num_kept(wrong), wrong.len(), num_right - num_kept(right)))
        });
        let outcomes: Vec<(f64, usize, usize, usize)> = outcomes.collect::<Result<_>>()?;
        let num_closures = self.graph.trusts().iter().filter(|&&trust| trust == Trust::Doubtful).count();
        Ok(Row {
            graph: self.name.clone(),
            draw,
            percent,
            survived: outcomes.iter().filter(|outcome| outcome.0 <= self.tolerated_m).count(),
            draws: outcomes.len(),
            errors_m: outcomes.iter().map(|outcome| outcome.0).collect(),
            wrong_kept: outcomes.iter().map(|outcome| outcome.1).sum(),
            wrong: outcomes.iter().map(|outcome| outcome.2).sum(),
            right_lost: outcomes.iter().map(|outcome| outcome.3).sum(),
            right: num_closures * outcomes.len(),
            seconds: began.elapsed().as_secs_f64(),
        })
    }
}

pub(super) fn run(arguments: &RobustArguments) -> Result<()> {
    ensure!(
        arguments.truth.is_none() || arguments.graphs.len() == 1,
        "--truth belongs to one graph, but there are several"
    );
    ensure!(arguments.shares.iter().all(|share| (1..100).contains(share)), "--shares are between 1 and 99 %");
    ensure!(arguments.groups.iter().all(|&size| size > 0), "--groups are above zero");
    let mut rows = Vec::new();
    for path in &arguments.graphs {
        let clean = Clean::read(path, arguments.truth.as_deref())?;
        let first = rows.len();
        for &generator in &arguments.generators {
            for &group_size in &arguments.groups {
                for &percent in &arguments.shares {
                    let draw = OutlierDraw { generator: generator.into(), group_size };
                    rows.push(clean.judge(draw, percent, arguments.draws)?);
                }
            }
        }
        print_rows(&clean.name, &rows[first..], &arguments.shares);
    }
    if let Some(path) = &arguments.json {
        write_json(path, &RobustReport { rows })?;
    }
    Ok(())
}

/// One line for each kind of draw, one column for each share.
fn print_rows(graph: &str, rows: &[Row], shares: &[u32]) {
    let mut header = vec![format!("{graph}: draws survived")];
    header.extend(shares.iter().map(|share| format!("{share} %")));
    header.extend(["worst m", "wrong kept", "right lost", "s/draw"].map(str::to_owned));
    let lines: Vec<Vec<String>> = rows
        .chunks(shares.len())
        .map(|kind| {
            let sum = |of: fn(&Row) -> usize| kind.iter().map(of).sum::<usize>();
            let worst_m =
                kind.iter().flat_map(|row| &row.errors_m).fold(0.0_f64, |worst, &error| worst.max(error));
            let seconds: f64 = kind.iter().map(|row| row.seconds).sum();
            let mut line =
                vec![format!("{:?}, groups of {}", kind[0].draw.generator, kind[0].draw.group_size)];
            line.extend(kind.iter().map(|row| format!("{}/{}", row.survived, row.draws)));
            line.extend([
                format!("{worst_m:.2}"),
                format!(
                    "{:.2} %",
                    100.0 * sum(|row| row.wrong_kept) as f64 / sum(|row| row.wrong).max(1) as f64
                ),
                format!(
                    "{:.2} %",
                    100.0 * sum(|row| row.right_lost) as f64 / sum(|row| row.right).max(1) as f64
                ),
                format!("{:.2}", seconds / sum(|row| row.draws).max(1) as f64),
            ]);
            line
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    println!("{}", table(&header, &lines));
}

/// Lines of x y theta.
fn read_poses(path: &Path) -> Result<Vec<Pose2>> {
    let text = read_text(path)?;
    let pose = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [x, y, theta] = numbers[..] else {
            return Err(anyhow::anyhow!("{}: '{line}' is not x y theta", path.display()));
        };
        Ok(Pose2::new(x, y, theta))
    };
    text.lines().filter(|line| !line.trim().is_empty()).map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_with_one_wrong_closure_in_ten_is_survived() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ring.g2o");
        // Three laps of a square, closed at every second pose.
        let vertices: String =
            (0..120).map(|k| format!("VERTEX_SE2 {k} {} {} {}\n", f64::from(k % 40), 0.0, 0.0)).collect();
        let mut edges: String = (1..120)
            .map(|k| {
                let turn = if k % 10 == 0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
                format!("EDGE_SE2 {} {k} 1 0 {turn} 400 0 0 400 0 4000\n", k - 1)
            })
            .collect();
        edges += &(0..80)
            .step_by(2)
            .map(|k| format!("EDGE_SE2 {k} {} 0 0 0 400 0 0 400 0 4000\n", k + 40))
            .collect::<String>();
        std::fs::write(&path, vertices + &edges).unwrap();
        let clean = Clean::read(&path, None).unwrap();
        let draw = OutlierDraw { generator: Generator::VertigoRandom, group_size: 1 };
        let row = clean.judge(draw, 10, 3).unwrap();
        assert_eq!((row.survived, row.draws, row.wrong), (3, 3, 12), "{row:?}");
    }
}
