//! `locution optimize`: the least-squares poses of a graph in a file, robust against wrong closures if asked.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use locution_engine::formats::{GraphDocument, read_g2o, read_toro, write_g2o, write_toro};
use locution_engine::pose_graph::{Kernel, PoseGraphConfig, RobustConfig, Start, optimize_robust};
use serde::Serialize;

/// Reads and writes g2o and TORO, plain or as .gz; the input's format is told by its content, the output's by its
/// name (`.graph` and `.toro` are TORO) and else that of the input.
#[derive(Debug, Args)]
pub struct OptimizeArguments {
    /// The graph to optimise.
    input: PathBuf,
    /// Where the optimised graph goes.
    #[arg(long)]
    output: Option<PathBuf>,
    /// How edges between vertices that do not follow one another are weighed: they may be wrong.
    #[arg(long, value_enum, default_value_t = Robust::None)]
    robust: Robust,
    /// Where to begin.
    #[arg(long, value_enum, default_value_t = StartArgument::Best)]
    start: StartArgument,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Robust {
    /// Every edge counts fully.
    None,
    /// Graduated non-convexity.
    Gnc,
    /// Dynamic covariance scaling.
    Dcs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum StartArgument {
    /// The file's poses, unless they are poor and the chordal start is better.
    Best,
    /// The file's poses, or odometry where it has none.
    Given,
    /// Rotations by a linear relaxation, then positions.
    Chordal,
}

/// What `--json` prints; the keys of the specification first.
#[derive(Debug, Serialize)]
struct OptimizeSummary {
    chi2_initial: f64,
    chi2: f64,
    iterations: u32,
    solve_ms: f64,
    components: usize,
    poses: usize,
    edges: usize,
    rejected_edges: usize,
    used_chordal_start: bool,
    stop_reason: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GraphFormat {
    G2o,
    Toro,
}

/// Optimises the graph, writes it and says what was done.
///
/// # Errors
/// A file that cannot be read or written, a line that is no graph, a graph that cannot be solved.
pub fn run(arguments: &OptimizeArguments) -> Result<()> {
    let text = read_text(&arguments.input)?;
    let format = format_of(&text);
    let mut document = match format {
        GraphFormat::G2o => read_g2o(&text),
        GraphFormat::Toro => read_toro(&text),
    }
    .with_context(|| format!("cannot read {}", arguments.input.display()))?;
    let summary = solve(&mut document, arguments)?;
    if let Some(output) = &arguments.output {
        write_graph(output, &document, format)?;
    }
    if arguments.json {
        println!("{}", serde_json::to_string(&summary)?);
    } else {
        print_summary(&summary);
    }
    Ok(())
}

fn solve(document: &mut GraphDocument, arguments: &OptimizeArguments) -> Result<OptimizeSummary> {
    let start = match arguments.start {
        StartArgument::Best => Start::Best,
        StartArgument::Given => Start::Given,
        StartArgument::Chordal => Start::Chordal,
    };
    let kernel = match arguments.robust {
        Robust::None => Kernel::None,
        Robust::Gnc => Kernel::GraduatedNonConvexity,
        Robust::Dcs => Kernel::DynamicCovarianceScaling,
    };
    let config = PoseGraphConfig { start, ..PoseGraphConfig::default() };
    let robust = RobustConfig { kernel, ..RobustConfig::default() };
    let began = Instant::now();
    let outcome = optimize_robust(&mut document.graph, &config, &robust)
        .with_context(|| format!("cannot optimise {}", arguments.input.display()))?;
    let solve_ms = began.elapsed().as_secs_f64() * 1e3;
    let report = outcome.report;
    Ok(OptimizeSummary {
        chi2_initial: report.chi2_initial,
        chi2: report.chi2,
        iterations: report.iterations,
        solve_ms,
        components: report.num_components,
        poses: document.graph.poses().len(),
        edges: document.graph.constraints().len(),
        rejected_edges: outcome.num_rejected,
        used_chordal_start: report.used_chordal_start,
        stop_reason: format!("{:?}", report.stop_reason),
    })
}

fn print_summary(summary: &OptimizeSummary) {
    let start = if summary.used_chordal_start { " from the chordal start" } else { "" };
    println!("{} poses, {} edges, {} component(s)", summary.poses, summary.edges, summary.components);
    println!("chi2 {} -> {}", summary.chi2_initial, summary.chi2);
    println!(
        "{} iterations{start} in {:.1} ms, {}; {} edges rejected",
        summary.iterations, summary.solve_ms, summary.stop_reason, summary.rejected_edges
    );
}

/// The first line that names something decides; an empty file is an empty g2o graph.
fn format_of(text: &str) -> GraphFormat {
    let first_tag = text
        .lines()
        .filter_map(|line| line.split_ascii_whitespace().next())
        .find(|tag| !tag.starts_with('#'));
    match first_tag {
        Some("VERTEX2" | "VERTEX" | "EDGE2" | "EDGE" | "EQUIV") => GraphFormat::Toro,
        _ => GraphFormat::G2o,
    }
}

/// The text of a file, unpacked if it begins with the two bytes of gzip.
fn read_text(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let unpacked = if bytes.starts_with(&[0x1f, 0x8b]) {
        let mut unpacked = Vec::new();
        GzDecoder::new(bytes.as_slice())
            .read_to_end(&mut unpacked)
            .with_context(|| format!("cannot unpack {}", path.display()))?;
        unpacked
    } else {
        bytes
    };
    String::from_utf8(unpacked).with_context(|| format!("{} is not text", path.display()))
}

fn write_graph(path: &Path, document: &GraphDocument, input_format: GraphFormat) -> Result<()> {
    let name = path.to_string_lossy();
    let is_packed = name.ends_with(".gz");
    let name = name.trim_end_matches(".gz");
    let format = if name.ends_with(".g2o") {
        GraphFormat::G2o
    } else if name.ends_with(".graph") || name.ends_with(".toro") {
        GraphFormat::Toro
    } else {
        input_format
    };
    let text = match format {
        GraphFormat::G2o => write_g2o(document),
        GraphFormat::Toro => write_toro(document),
    };
    let cannot_write = || format!("cannot write {}", path.display());
    if is_packed {
        let file = File::create(path).with_context(cannot_write)?;
        let mut packer = GzEncoder::new(file, Compression::default());
        packer.write_all(text.as_bytes()).and_then(|()| packer.finish().map(drop)).with_context(cannot_write)
    } else {
        std::fs::write(path, text).with_context(cannot_write)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "EDGE2 0 1 1 0 2.0943951 1 0 1 1 0 0\nEDGE2 1 2 1 0 2.0943951 1 0 1 1 0 0\n\
        EDGE2 2 0 1.1 0 2.0943951 1 0 1 1 0 0\n";

    fn arguments(input: PathBuf, output: PathBuf) -> OptimizeArguments {
        OptimizeArguments {
            input,
            output: Some(output),
            robust: Robust::None,
            start: StartArgument::Best,
            json: true,
        }
    }

    #[test]
    fn reads_toro_and_writes_packed_g2o() {
        let folder = tempfile::tempdir().unwrap();
        let (input, output) = (folder.path().join("in.graph"), folder.path().join("out.g2o.gz"));
        std::fs::write(&input, TRIANGLE).unwrap();
        run(&arguments(input, output.clone())).unwrap();
        let written = read_text(&output).unwrap();
        assert_eq!(format_of(&written), GraphFormat::G2o);
        assert_eq!(read_g2o(&written).unwrap().graph.constraints().len(), 3);
    }

    #[test]
    fn errors_name_the_file_and_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("in.g2o");
        std::fs::write(&input, "VERTEX_SE2 0 0 0\n").unwrap();
        let error = run(&arguments(input, folder.path().join("out.g2o"))).unwrap_err();
        let message = format!("{error:#}");
        assert!(message.contains("in.g2o") && message.contains("line 1"), "{message}");
    }
}
