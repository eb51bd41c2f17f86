//! Chapter 5: words of several levels while doors open and close. Figures 5.9 and 5.10, Table 5.1.

use std::path::Path;

use crate::evaluation::CurvePoint;
use anyhow::Result;
use locution_engine::matching::MatchingConfig;

use super::pictures::{NamedCurve, plot_over_n, plot_precision_over_recall};
use super::published::Published;
use super::scenarios::{self, Scenario};
use super::text_sweep::{
    FoundChain, Texts, at_precision, at_recall, at_threshold, chains_of, sweep, sweep_by_evidence,
    sweep_by_words, thesis_translator, translate,
};
use super::{BESIDE_HEADER, Measured, ThesisArguments, announce, beside, best_icp, measure};
use crate::report::table;

/// Bandwidth of the kernel (thesis 5.3.1).
const KERNEL_M: f64 = 2.5;
/// A lap of the circuit.
const LAP_M: f64 = 120.0;
/// Words that a chain needs, by the highest level of its words (Table 5.1).
const MIN_WORDS: [u16; 3] = [7, 10, 13];
/// What levels 1 and 2 need more than level 0, so that one number moves all three thresholds.
const EXTRA_WORDS: [usize; 3] = [0, 3, 6];
/// Shortest chains of a curve.
const SHORTEST: u16 = 3;
/// Figures 5.9 and 5.10 end here.
const LONGEST_OF_FIGURE: u32 = 18;
const GRAY: [u8; 3] = [120, 120, 120];
const RED: [u8; 3] = [214, 39, 40];
const BLUE: [u8; 3] = [31, 119, 180];
const GREEN: [u8; 3] = [44, 160, 44];

/// Table 5.1 at the published thresholds, and whole curves over the number of words and over evidence.
///
/// # Errors
/// A scenario that cannot be simulated, or pictures that cannot be written.
pub(super) fn chapter_5(arguments: &ThesisArguments, published: &Published) -> Result<Vec<Measured>> {
    println!(
        "Chapter 5: words of several levels, uniform kernel of 2.5 m, sizes within 25 %, turns within 30°"
    );
    let config = thesis_translator(KERNEL_M);
    let (mut measured, mut rows, mut curve_rows) = (Vec::new(), Vec::new(), Vec::new());
    for scenario in
        [scenarios::busy_corridors()?, scenarios::changing_doors(false)?, scenarios::changing_doors(true)?]
    {
        let texts = translate(&scenario, &config)?;
        announce(&scenario, &texts);
        let num_laps = texts.travel_m / LAP_M;
        for num_levels in 1..=MIN_WORDS.len() {
            let matching = matching_with(MIN_WORDS[..num_levels].to_vec());
            let (chains, seconds) = chains_of(&texts, &matching);
            let curve = sweep(&texts, &chains, |_| Some(1.0));
            let what = levels_name(num_levels);
            let seconds = seconds / num_laps;
            let ours = measure(&format!("5.{}", scenario.name), what.clone(), &curve, 1.0, seconds);
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
        curve_rows.extend(precision_over_recall(&arguments.out, &scenario, &texts, published)?);
        figures_5_9_and_5_10(&arguments.out, &scenario, &texts)?;
    }
    println!("  Table 5.1; time is per lap\n{}", table(&BESIDE_HEADER, &rows));
    let header = ["", "published", "recall at that precision", "precision at that recall", "E ≤ 0.1"];
    println!("  The whole curves, precision / recall\n{}", table(&header, &curve_rows));
    Ok(measured)
}

fn matching_with(min_chain_words: Vec<u16>) -> MatchingConfig {
    MatchingConfig { min_chain_words, ..MatchingConfig::default() }
}

/// As the published table names it.
fn levels_name(num_levels: usize) -> String {
    if num_levels == 1 { "1-level".to_owned() } else { format!("{num_levels}-levels") }
}

/// Ranks chains by their number of words and by their evidence, and compares both curves with the published points.
/// Two levels are enough: classes that follow one another are neighbours, so words of level 2, which begin and end in
/// one class with two words between, hardly ever arise.
fn precision_over_recall(
    out: &Path,
    scenario: &Scenario,
    texts: &Texts,
    published: &Published,
) -> Result<Vec<Vec<String>>> {
    let (mut curves, mut points, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for (num_levels, color) in [(1, GRAY), (2, BLUE)] {
        let matching = matching_with(vec![SHORTEST; num_levels]);
        let (chains, _) = chains_of(texts, &matching);
        let name = levels_name(num_levels);
        let by_words = sweep_by_words(texts, &chains, &EXTRA_WORDS);
        let by_evidence = sweep_by_evidence(texts, &chains, &matching);
        let theirs = published.pair(&format!("/table_5_1/{name}/{}", scenario.name));
        for (how, curve) in [("words", &by_words), ("evidence", &by_evidence)] {
            let what = format!("5.{} {name}, by {how}", scenario.name);
            rows.push(curve_row(what, curve, theirs, how == "evidence"));
        }
        points.extend(theirs.map(|pair| (format!("thesis {num_levels}"), color, pair)));
        let light = color.map(|channel| channel / 2 + 127);
        curves.push((format!("{num_levels} n"), light, by_words));
        curves.push((format!("{num_levels} E"), color, by_evidence));
    }
    rows.extend(with_mean_shift(scenario, texts, published)?);
    let file = format!("precision_recall_5_{}", scenario.name.to_lowercase());
    let title = format!("scenario {}: levels, by words (n) or evidence (E)", scenario.name);
    plot_precision_over_recall(out, &file, &title, (&curves, &points))?;
    Ok(rows)
}

/// Two levels of words whose classes are the modes of the densities.
fn with_mean_shift(scenario: &Scenario, texts: &Texts, published: &Published) -> Result<Vec<Vec<String>>> {
    let (texts, num_classes) = texts.by_mean_shift(&thesis_translator(KERNEL_M).text)?;
    let matching = matching_with(vec![SHORTEST; 2]);
    let (chains, _) = chains_of(&texts, &matching);
    let name = levels_name(2);
    let meters = texts.travel_m / texts.num_words(0).max(1) as f64;
    let what = format!("5.{} {name}, mean shift: {num_classes} classes, {meters:.1} m a word", scenario.name);
    let theirs = published.pair(&format!("/table_5_1/{name}/{}", scenario.name));
    let by_words = sweep_by_words(&texts, &chains, &EXTRA_WORDS);
    let by_evidence = sweep_by_evidence(&texts, &chains, &matching);
    Ok(vec![
        curve_row(format!("{what}, by words"), &by_words, theirs, false),
        curve_row(format!("{what}, by evidence"), &by_evidence, theirs, true),
    ])
}

fn curve_row(
    what: String,
    curve: &[CurvePoint],
    theirs: Option<(f64, f64)>,
    is_evidence: bool,
) -> Vec<String> {
    let none = || "-".to_owned();
    let pair = |point: CurvePoint| format!("{:.3} / {:.3}", point.precision, point.recall_same);
    let same_precision = theirs.and_then(|(precision, _)| at_precision(curve, precision));
    let same_recall = theirs.and_then(|(_, recall)| at_recall(curve, recall));
    // One false chain is expected in ten runs.
    let automatic = if is_evidence { at_threshold(curve, 1.0) } else { None };
    vec![
        what,
        theirs.map_or_else(none, |(precision, recall)| format!("{precision:.3} / {recall:.3}")),
        same_precision.map_or_else(none, pair),
        same_recall.map_or_else(none, pair),
        automatic.map_or_else(none, pair),
    ]
}

/// Single level against two levels: level 0 with a fixed threshold, level 1 with all.
fn figures_5_9_and_5_10(out: &Path, scenario: &Scenario, texts: &Texts) -> Result<()> {
    let (chains, _) = chains_of(texts, &matching_with(vec![SHORTEST; 2]));
    let words = |found: &FoundChain| found.chain.pairs.len();
    let single = sweep(texts, &chains, |found| (found.chain.max_level == 0).then_some(words(found) as f64));
    let longest = chains.iter().map(words).max().unwrap_or(1) as f64;
    let mut curves: Vec<NamedCurve> = vec![("1 level".to_owned(), GRAY, single)];
    for (fixed, color) in [(4, RED), (6, BLUE), (8, GREEN)] {
        // Chains of level 0 that reach the fixed threshold always count; the rest by their length.
        let curve = sweep(texts, &chains, |found| match (found.chain.max_level, words(found)) {
            (0, length) if length >= fixed => Some(longest + 1.0),
            (0, _) => None,
            (_, length) => Some(length as f64),
        });
        curves.push((format!("level 0 at {fixed}"), color, curve));
    }
    let lower = scenario.name.to_lowercase();
    let title = format!("scenario {}", scenario.name);
    plot_over_n(out, &format!("figure_5_10_{lower}"), &title, &curves[1..], LONGEST_OF_FIGURE)?;
    for (_, _, curve) in &mut curves {
        curve.retain(|point| point.threshold <= f64::from(LONGEST_OF_FIGURE));
    }
    plot_precision_over_recall(out, &format!("figure_5_9_{lower}"), &title, (&curves, &[]))
}
