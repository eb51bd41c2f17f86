//! `locution eval thesis`: scenarios of the kind of chapters 4 and 5, our figures beside the published ones.

mod changing_buildings;
mod corridor_graph;
mod floor_plan;
mod icp_baseline;
mod localization;
mod pictures;
mod published;
pub mod scenarios;
mod static_buildings;
mod text_sweep;

use std::path::PathBuf;
use std::time::Instant;

use crate::evaluation::CurvePoint;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use locution_engine::translator::TranslatorConfig;
use serde::Serialize;

use crate::report::write_json;
use pictures::write_picture;
use published::Published;
use scenarios::Scenario;
use text_sweep::{Texts, at_threshold};

/// Which part of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Chapter {
    /// Particles weighed by densities: Figures 3.5 and 3.6.
    #[value(name = "3")]
    Localization,
    /// n-grams of words in static buildings: Figure 4.12, Table 4.2.
    #[value(name = "4")]
    Static,
    /// Words of several levels while doors open and close: Figures 5.9, 5.10, Table 5.1.
    #[value(name = "5")]
    Changing,
}

/// Simulates, matches and compares; takes some minutes.
#[derive(Debug, Args)]
pub struct ThesisArguments {
    /// Only this chapter.
    #[arg(long, value_enum)]
    chapter: Option<Chapter>,
    /// Directory for pictures and the JSON report.
    #[arg(long, default_value = "thesis-out")]
    out: PathBuf,
    /// The published numbers [default: thesis_results.json in the folder that LOCUTION_GOLDEN names or in
    /// ../shared/golden].
    #[arg(long)]
    published: Option<PathBuf>,
    /// Leave out the ICP baseline, which takes most of the time.
    #[arg(long)]
    without_icp: bool,
    /// Seeds of each particle filter of chapter 3 (thesis: 15).
    #[arg(long, default_value_t = 15)]
    seeds: u64,
}

/// One row of a table: what, and precision and recall.
#[derive(Clone, Debug, Serialize)]
struct Measured {
    scenario: String,
    what: String,
    precision: f64,
    recall: f64,
    seconds: f64,
}

/// Simulates, matches, prints and writes what the arguments ask for.
///
/// # Errors
/// Files that cannot be read or written; scenarios that cannot be driven.
pub fn run(arguments: &ThesisArguments) -> Result<()> {
    std::fs::create_dir_all(&arguments.out)
        .with_context(|| format!("cannot make {}", arguments.out.display()))?;
    let published = Published::load(arguments.published.as_deref());
    let is_wanted = |chapter| arguments.chapter.is_none_or(|only| only == chapter);
    if is_wanted(Chapter::Localization) {
        let results = localization::chapter_3(&arguments.out, arguments.seeds.max(1))?;
        write_json(&arguments.out.join("thesis_localization.json"), &results)?;
    }
    let mut measured = Vec::new();
    if is_wanted(Chapter::Static) {
        measured.extend(static_buildings::chapter_4(arguments, &published)?);
    }
    if is_wanted(Chapter::Changing) {
        measured.extend(changing_buildings::chapter_5(arguments, &published)?);
    }
    write_json(&arguments.out.join("thesis.json"), &measured)
}

/// The acceptance threshold with the best harmonic mean of precision and recall.
fn best_icp(name: &str, scenario: &Scenario, texts: &Texts, config: &TranslatorConfig) -> Result<Measured> {
    let began = Instant::now();
    let curve = icp_baseline::icp_curve(scenario, texts, config)?;
    let seconds = began.elapsed().as_secs_f64();
    let balance = |point: &CurvePoint| {
        2.0 * point.precision * point.recall_same / (point.precision + point.recall_same).max(1e-9)
    };
    let best = curve.iter().max_by(|a, b| balance(a).total_cmp(&balance(b))).copied().unwrap_or_default();
    Ok(Measured {
        scenario: name.to_owned(),
        what: format!("ICP, fit under {:.3} m", -best.threshold),
        precision: best.precision,
        recall: best.recall_same,
        seconds,
    })
}

fn measure(scenario: &str, what: String, curve: &[CurvePoint], threshold: f64, seconds: f64) -> Measured {
    let point = at_threshold(curve, threshold).unwrap_or_default();
    Measured {
        scenario: scenario.to_owned(),
        what,
        precision: point.precision,
        recall: point.recall_same,
        seconds,
    }
}

fn announce(scenario: &Scenario, texts: &Texts) {
    let num_words = texts.num_words(0);
    let num_observations: usize = texts.observations.iter().map(Vec::len).sum();
    println!(
        "\n  Scenario {}: {}; {:.0} m in {} runs, {num_observations} observations, {num_words} words of \
         level 0 ({:.1} m each), {} of level 1, {} of level 2",
        scenario.name,
        scenario.what,
        texts.travel_m,
        scenario.runs.len(),
        texts.travel_m / num_words.max(1) as f64,
        texts.num_words(1),
        texts.num_words(2)
    );
}

const BESIDE_HEADER: [&str; 6] = ["", "precision", "published", "recall", "published", "s"];

fn beside(ours: &Measured, theirs: Option<(f64, f64)>) -> Vec<String> {
    let number = |value: f64| format!("{value:.3}");
    let published = |value: Option<f64>| value.map_or("-".to_owned(), number);
    vec![
        format!("{} {}", ours.scenario, ours.what),
        number(ours.precision),
        published(theirs.map(|pair| pair.0)),
        number(ours.recall),
        published(theirs.map(|pair| pair.1)),
        format!("{:.3}", ours.seconds),
    ]
}
