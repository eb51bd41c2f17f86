//! `locution eval thesis`: scenarios of the kind of chapters 4 and 5, our figures beside the published ones.

mod corridor_graph;
mod floor_plan;
mod icp_baseline;
mod localization;
mod published;
pub(in crate::cli) mod scenarios;
mod text_sweep;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use locution_engine::config::TranslatorConfig;
use locution_engine::density::{KernelConfig, KernelProfile};
use locution_engine::evaluation::CurvePoint;
use locution_engine::matching::MatchingConfig;
use serde::Serialize;

use super::plot::{Line, Plot};
use crate::cli::output::{table, write_json};
use published::Published;
use scenarios::Scenario;
use text_sweep::{FoundChain, Texts, at_threshold, chains_of, sweep, thesis_translator, translate};

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

const SIZE_TOLERANCES: [(f64, [u8; 3]); 3] =
    [(0.1, [214, 39, 40]), (0.2, [31, 119, 180]), (0.3, [44, 160, 44])];
const GRAMS_OF_TABLE: [u32; 7] = [1, 2, 4, 6, 9, 12, 20];

pub(super) fn run(arguments: &ThesisArguments) -> Result<()> {
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
        measured.extend(chapter_4(arguments, &published)?);
    }
    if is_wanted(Chapter::Changing) {
        measured.extend(chapter_5(arguments, &published)?);
    }
    write_json(&arguments.out.join("thesis.json"), &measured)
}

fn chapter_4(arguments: &ThesisArguments, published: &Published) -> Result<Vec<Measured>> {
    println!("Chapter 4: n-grams of words, uniform kernel of 4 m, matches driven the same way");
    let config = thesis_translator(4.0);
    let mut measured = Vec::new();
    for make in [scenarios::four_loops, scenarios::nested_loops, scenarios::two_loops] {
        let scenario = make()?;
        let texts = translate(&scenario, &config)?;
        announce(&scenario, &texts);
        let mut curves = Vec::new();
        for (size_tolerance, color) in SIZE_TOLERANCES {
            let (chains, seconds) = chains_of(&texts, &one_level(size_tolerance));
            let curve = sweep(&texts, &chains, |chain| Some(chain.pairs.len() as f64));
            for grams in GRAMS_OF_TABLE {
                let what = format!("n ≥ {grams}, sizes within {:.0} %", 100.0 * size_tolerance);
                measured.push(measure(
                    &format!("4.{}", scenario.name),
                    what,
                    &curve,
                    f64::from(grams),
                    seconds,
                ));
            }
            curves.push((format!("{:.0} %", 100.0 * size_tolerance), color, curve));
        }
        print_grams(&curves);
        let file = format!("figure_4_12_{}", scenario.name.to_lowercase());
        plot_over_n(&arguments.out, &file, &format!("scenario {}", scenario.name), &curves, 20)?;
        measured.extend(quantiser_and_kernel_table(&scenario)?);
        if scenario.name == "C" {
            measured.extend(table_4_2(arguments, published, &scenario, &texts, &config)?);
        }
    }
    Ok(measured)
}

/// ICP against the longest n-grams in scenario C.
fn table_4_2(
    arguments: &ThesisArguments,
    published: &Published,
    scenario: &Scenario,
    texts: &Texts,
    config: &TranslatorConfig,
) -> Result<Vec<Measured>> {
    let (chains, seconds) = chains_of(texts, &one_level(0.3));
    let curve = sweep(texts, &chains, |chain| Some(chain.pairs.len() as f64));
    let twenty = measure("4.C", "n ≥ 20".into(), &curve, 20.0, seconds);
    let theirs = published.pair("/table_4_2/ngram_20");
    // The thesis shows one n; the smallest one that is as precise says more of the method.
    let wanted = theirs.map_or(0.98, |pair| pair.0);
    let shortest = curve.iter().filter(|point| point.precision >= wanted).map(|point| point.threshold);
    let shortest = shortest.fold(f64::INFINITY, f64::min);
    let short = measure("4.C", format!("n ≥ {shortest}"), &curve, shortest, seconds);
    let mut rows = vec![beside(&twenty, theirs), beside(&short, theirs)];
    let mut measured = vec![twenty, short];
    if !arguments.without_icp {
        let icp = best_icp("4.C", scenario, texts, config)?;
        rows.push(beside(&icp, published.pair("/table_4_2/icp_100pts")));
        measured.push(icp);
    }
    println!("  Table 4.2, scenario C\n{}", table(&BESIDE_HEADER, &rows));
    Ok(measured)
}

/// Other quantisers, kernels and bandwidths, 6-grams with sizes within 20 %.
fn quantiser_and_kernel_table(scenario: &Scenario) -> Result<Vec<Measured>> {
    let kernel = |profile, bandwidth_m| {
        let mut config = thesis_translator(bandwidth_m);
        config.density.kernels[0] = KernelConfig { profile, bandwidth_m };
        config
    };
    let classes = |num_classes| {
        let mut config = thesis_translator(4.0);
        config.quantizer = locution_engine::text::QuantizerConfig::Uniform { num_classes };
        config
    };
    let variants = [
        ("uniform 2.5 m, 8 classes", kernel(KernelProfile::Uniform, 2.5)),
        ("uniform 4 m, 8 classes", kernel(KernelProfile::Uniform, 4.0)),
        ("uniform 4 m, 5 classes", classes(5)),
        ("uniform 4 m, 12 classes", classes(12)),
        ("Gaussian 4 m, 8 classes", kernel(KernelProfile::Gaussian, 4.0)),
        ("inverted 4 m, 8 classes", kernel(KernelProfile::Inverted, 4.0)),
    ];
    let mut measured = Vec::new();
    for (what, config) in variants {
        let texts = translate(scenario, &config)?;
        let (chains, seconds) = chains_of(&texts, &one_level(0.2));
        let curve = sweep(&texts, &chains, |chain| Some(chain.pairs.len() as f64));
        let what = format!("{what}, n ≥ 6");
        measured.push(measure(&format!("4.{}", scenario.name), what, &curve, 6.0, seconds));
    }
    let rows: Vec<Vec<String>> = measured.iter().map(own_row).collect();
    println!("  kernels and quantisers, scenario {}\n{}", scenario.name, table(&OWN_HEADER, &rows));
    Ok(measured)
}

fn chapter_5(arguments: &ThesisArguments, published: &Published) -> Result<Vec<Measured>> {
    println!(
        "Chapter 5: words of several levels, uniform kernel of 2.5 m, sizes within 25 %, turns within 30°"
    );
    let config = thesis_translator(2.5);
    let mut measured = Vec::new();
    let mut rows = Vec::new();
    for scenario in
        [scenarios::busy_corridors()?, scenarios::changing_doors(false)?, scenarios::changing_doors(true)?]
    {
        let texts = translate(&scenario, &config)?;
        announce(&scenario, &texts);
        let num_laps = texts.travel_m / 120.0;
        for num_levels in 1..=3 {
            let thresholds = [7, 10, 13][..num_levels].to_vec();
            let matching = MatchingConfig { min_chain_words: thresholds, ..MatchingConfig::default() };
            let (chains, seconds) = chains_of(&texts, &matching);
            let curve = sweep(&texts, &chains, |_| Some(1.0));
            let what = if num_levels == 1 { "1-level".to_owned() } else { format!("{num_levels}-levels") };
            let ours =
                measure(&format!("5.{}", scenario.name), what.clone(), &curve, 1.0, seconds / num_laps);
            let theirs = published.pair(&format!("/table_5_1/{what}/{}", scenario.name));
            rows.push(beside(&ours, theirs));
            measured.push(ours);
        }
        if !arguments.without_icp {
            let ours = best_icp(&format!("5.{}", scenario.name), &scenario, &texts, &config)?;
            let ours = Measured { seconds: ours.seconds / num_laps, ..ours };
            rows.push(beside(&ours, published.pair(&format!("/table_5_1/icp/{}", scenario.name))));
            measured.push(ours);
        }
        figures_5_9_and_5_10(&arguments.out, &scenario, &texts)?;
    }
    println!("  Table 5.1; time is per lap\n{}", table(&BESIDE_HEADER, &rows));
    Ok(measured)
}

/// Single level against two levels: level 0 with a fixed threshold, level 1 with all from 3 words on.
fn figures_5_9_and_5_10(out: &Path, scenario: &Scenario, texts: &Texts) -> Result<()> {
    let two_levels = MatchingConfig { min_chain_words: vec![2, 3], ..MatchingConfig::default() };
    let (chains, _) = chains_of(texts, &two_levels);
    let words = |found: &FoundChain| found.chain.pairs.len();
    let single = sweep(texts, &chains, |chain| (chain.max_level == 0).then_some(chain.pairs.len() as f64));
    let longest = chains.iter().map(words).max().unwrap_or(1) as f64;
    let mut curves = vec![("1 level".to_owned(), [120, 120, 120], single)];
    for (fixed, color) in [(4, [214, 39, 40]), (6, [31, 119, 180]), (8, [44, 160, 44])] {
        // Chains of level 0 that reach the fixed threshold always count; the rest by their length.
        let curve = sweep(texts, &chains, |chain| match (chain.max_level, chain.pairs.len()) {
            (0, length) if length >= fixed => Some(longest + 1.0),
            (0, _) => None,
            (_, length) => Some(length as f64),
        });
        curves.push((format!("level 0 at {fixed}"), color, curve));
    }
    let lower = scenario.name.to_lowercase();
    let title = format!("scenario {}", scenario.name);
    plot_over_n(out, &format!("figure_5_10_{lower}"), &title, &curves[1..], 18)?;
    let lines = curves
        .iter()
        .map(|(name, color, curve)| {
            let kept = curve.iter().filter(|point| point.threshold <= 18.0);
            let points = kept.map(|point| (point.recall_same, point.precision)).collect();
            Line { name: name.clone(), color: *color, points, has_markers: true }
        })
        .collect();
    let plot = Plot {
        title,
        x_label: "recall".into(),
        y_label: "precision".into(),
        x_range: (0.0, 1.0),
        y_range: (0.0, 1.0),
        lines,
    };
    write_picture(out, &format!("figure_5_9_{lower}"), &plot)
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

fn one_level(size_tolerance: f64) -> MatchingConfig {
    let mut config = MatchingConfig { min_chain_words: vec![1], ..MatchingConfig::default() };
    config.tolerance.size_ratio = size_tolerance;
    config
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
    let num_words: usize = texts.lattices.iter().map(locution_engine::index::Lattice::num_nodes).sum();
    let num_observations: usize = texts.observations.iter().map(Vec::len).sum();
    println!(
        "\n  Scenario {}: {}; {:.0} m in {} runs, {num_observations} observations, {num_words} words of level 0",
        scenario.name,
        scenario.what,
        texts.travel_m,
        scenario.runs.len()
    );
}

const OWN_HEADER: [&str; 4] = ["", "precision", "recall", "s"];
const BESIDE_HEADER: [&str; 6] = ["", "precision", "published", "recall", "published", "s"];

fn own_row(ours: &Measured) -> Vec<String> {
    let number = |value: f64| format!("{value:.3}");
    vec![ours.what.clone(), number(ours.precision), number(ours.recall), format!("{:.2}", ours.seconds)]
}

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

/// Precision / recall for each number of words and each tolerance.
fn print_grams(curves: &[(String, [u8; 3], Vec<CurvePoint>)]) {
    let rows: Vec<Vec<String>> = GRAMS_OF_TABLE
        .iter()
        .map(|&grams| {
            let cells = curves.iter().map(|(_, _, curve)| match at_threshold(curve, f64::from(grams)) {
                Some(point) => format!("{:.3} / {:.3}", point.precision, point.recall_same),
                None => "none".to_owned(),
            });
            std::iter::once(format!("n ≥ {grams}")).chain(cells).collect()
        })
        .collect();
    println!("  precision / recall by gram size and size tolerance");
    println!("{}", table(&["", "10 %", "20 %", "30 %"], &rows));
}

/// Two pictures: precision and recall over the number of words.
fn plot_over_n(
    out: &Path,
    file: &str,
    title: &str,
    curves: &[(String, [u8; 3], Vec<CurvePoint>)],
    largest_n: u32,
) -> Result<()> {
    for (what, value) in [
        ("precision", (|point: CurvePoint| point.precision) as fn(CurvePoint) -> f64),
        ("recall", |point| point.recall_same),
    ] {
        let lines = curves
            .iter()
            .map(|(name, color, curve)| {
                let points = (1..=largest_n)
                    .filter_map(|n| Some((f64::from(n), value(at_threshold(curve, f64::from(n))?))));
                Line { name: name.clone(), color: *color, points: points.collect(), has_markers: true }
            })
            .collect();
        let plot = Plot {
            title: title.to_owned(),
            x_label: "words of a match (n)".into(),
            y_label: what.into(),
            x_range: (0.0, f64::from(largest_n)),
            y_range: (0.0, 1.0),
            lines,
        };
        write_picture(out, &format!("{file}_{what}"), &plot)?;
    }
    Ok(())
}

fn write_picture(out: &Path, name: &str, plot: &Plot) -> Result<()> {
    let path = out.join(format!("{name}.png"));
    std::fs::write(&path, plot.to_png()?).with_context(|| format!("cannot write {}", path.display()))
}
