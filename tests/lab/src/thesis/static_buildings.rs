//! Chapter 4: n-grams of words while nothing changes. Figures 4.12 and 4.13, Table 4.2.

use std::path::Path;

use anyhow::Result;
use locution_engine::density::{KernelConfig, KernelProfile};
use locution_engine::matching::MatchingConfig;
use locution_engine::text::QuantizerConfig;
use locution_engine::translator::TranslatorConfig;

use super::pictures::{NamedCurve, plot_over_n, plot_over_time};
use super::published::Published;
use super::scenarios::{self, Scenario};
use super::text_sweep::{
    FoundChain, Texts, at_precision, at_threshold, chains_of, over_time, sweep_by_words, thesis_translator,
    translate,
};
use super::{BESIDE_HEADER, Measured, ThesisArguments, announce, beside, best_icp, measure};
use crate::report::table;

const SIZE_TOLERANCES: [(f64, [u8; 3]); 3] =
    [(0.1, [214, 39, 40]), (0.2, [31, 119, 180]), (0.3, [44, 160, 44])];
/// Figure 4.13 is drawn with this one.
const SIZE_TOLERANCE_OVER_TIME: f64 = 0.2;
const GRAMS_OF_TABLE: [u32; 7] = [1, 2, 4, 6, 9, 12, 20];
const GRAMS_OVER_TIME: [(usize, [u8; 3]); 4] =
    [(2, [214, 39, 40]), (6, [31, 119, 180]), (12, [44, 160, 44]), (20, [148, 103, 189])];
const NUM_TIMES: usize = 40;

/// Precision and recall of n-grams while n, tolerance, quantiser and kernel vary; ICP beside them.
///
/// # Errors
/// A scenario that cannot be simulated, or pictures that cannot be written.
pub(super) fn chapter_4(arguments: &ThesisArguments, published: &Published) -> Result<Vec<Measured>> {
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
            let curve = sweep_by_words(&texts, &chains, &[]);
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
            if size_tolerance == SIZE_TOLERANCE_OVER_TIME {
                figure_4_13(&arguments.out, &scenario, &texts, &chains)?;
            }
            curves.push((format!("{:.0} %", 100.0 * size_tolerance), color, curve));
        }
        print_grams(&curves);
        let file = format!("figure_4_12_{}", scenario.name.to_lowercase());
        plot_over_n(&arguments.out, &file, &format!("scenario {}", scenario.name), &curves, 20)?;
        measured.extend(quantizer_and_kernel_table(&scenario, &texts)?);
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
    let curve = sweep_by_words(texts, &chains, &[]);
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

/// Precision and recall while the recording grows, by gram size.
fn figure_4_13(out: &Path, scenario: &Scenario, texts: &Texts, chains: &[FoundChain]) -> Result<()> {
    let line = |&(grams, color): &(usize, [u8; 3])| {
        let points = over_time(texts, chains, |found| found.chain.pairs.len() >= grams, NUM_TIMES);
        (format!("{grams}-grams"), color, points)
    };
    let lines: Vec<_> = GRAMS_OVER_TIME.iter().map(line).collect();
    let file = format!("figure_4_13_{}", scenario.name.to_lowercase());
    plot_over_time(out, &file, &format!("scenario {}", scenario.name), &lines)
}

/// Other quantisers, kernels and bandwidths, sizes within 20 %.
fn quantizer_and_kernel_table(scenario: &Scenario, plain: &Texts) -> Result<Vec<Measured>> {
    let kernel = |profile, bandwidth_m| {
        let mut config = thesis_translator(bandwidth_m);
        config.density.kernels[0] = KernelConfig { profile, bandwidth_m };
        translate(scenario, &config)
    };
    let classes = |num_classes| {
        let mut config = thesis_translator(4.0);
        config.quantizer = QuantizerConfig::Uniform { num_classes };
        translate(scenario, &config)
    };
    let (shifted, num_modes) = plain.by_mean_shift(&thesis_translator(4.0).text)?;
    let variants = [
        ("uniform 4 m, 8 classes".to_owned(), plain.clone()),
        ("uniform 4 m, 5 classes".to_owned(), classes(5)?),
        ("uniform 4 m, 12 classes".to_owned(), classes(12)?),
        (format!("uniform 4 m, mean shift ({num_modes} classes)"), shifted),
        ("uniform 1.5 m, 8 classes".to_owned(), kernel(KernelProfile::Uniform, 1.5)?),
        ("uniform 2.5 m, 8 classes".to_owned(), kernel(KernelProfile::Uniform, 2.5)?),
        ("uniform 6 m, 8 classes".to_owned(), kernel(KernelProfile::Uniform, 6.0)?),
        ("Gaussian 4 m, 8 classes".to_owned(), kernel(KernelProfile::Gaussian, 4.0)?),
        ("inverted 4 m, 8 classes".to_owned(), kernel(KernelProfile::Inverted, 4.0)?),
    ];
    let (mut measured, mut rows) = (Vec::new(), Vec::new());
    for (what, texts) in &variants {
        let (chains, seconds) = chains_of(texts, &one_level(0.2));
        let curve = sweep_by_words(texts, &chains, &[]);
        let six = measure(&format!("4.{}", scenario.name), format!("{what}, n ≥ 6"), &curve, 6.0, seconds);
        let precise = at_precision(&curve, 0.95).unwrap_or_default();
        rows.push(vec![
            what.clone(),
            format!("{:.1}", texts.travel_m / texts.num_words(0).max(1) as f64),
            format!("{:.3} / {:.3}", six.precision, six.recall),
            format!("{:.3} (n ≥ {})", precise.recall_same, precise.threshold),
        ]);
        measured.push(six);
    }
    let header = ["", "metres a word", "n ≥ 6: precision / recall", "recall at precision 0.95"];
    println!("  kernels and quantisers, scenario {}\n{}", scenario.name, table(&header, &rows));
    Ok(measured)
}

fn one_level(size_tolerance: f64) -> MatchingConfig {
    let mut config = MatchingConfig { min_chain_words: vec![1], ..MatchingConfig::default() };
    config.tolerance.size_ratio = size_tolerance;
    config
}

/// Precision / recall for each number of words and each tolerance.
fn print_grams(curves: &[NamedCurve]) {
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
