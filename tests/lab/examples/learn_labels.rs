//! Learned place labels: what they are worth in buildings left out, and their weights.
//!
//! `cargo run --release -p locution-lab --example learn_labels -- evaluate [OUT.json]` trains without each building in
//! turn and judges the labels there, beside those of the rules and those of a model that has seen the building.
//! `… -- train engine/src/semantics/labels.model` trains on all buildings and writes the weights that come with the
//! engine, `both` does one after the other. All take every labelled recording and plan of the data sets, whose folder is LOCUTION_DATASETS, and the labels
//! in tests/lab/data/labels. The seeds are fixed: the same command gives the same bytes.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use locution_engine::semantics::SemanticsConfig;
use locution_lab::evaluation::LabelReport;
use locution_lab::place_learning::{
    BuildingTrial, Learned, Sources, TrainingConfig, leave_buildings_out, pooled, read_numbers, train,
};
use locution_lab::report::{table, write_json};

/// Seeds of the simulated drives through every plan.
const DRIVE_SEEDS: [u64; 1] = [1];
/// Plans are left out in so many groups.
const NUM_FOLDS: usize = 4;
const LABELS: [&str; 5] = ["bifurcation", "corner", "corridor", "dead-end", "hall"];

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let config = SemanticsConfig::default();
    let training = TrainingConfig::default();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["evaluate", out @ ..] => {
            let trials = leave_buildings_out(&drives(&config)?, &config, &training, NUM_FOLDS);
            report(&trials);
            out.first().map_or(Ok(()), |path| write_json(&PathBuf::from(path), &trials))
        }
        ["train", path] => write_weights(&drives(&config)?, &config, &training, path),
        ["both", path, out] => {
            let drives = drives(&config)?;
            write_weights(&drives, &config, &training, path)?;
            let trials = leave_buildings_out(&drives, &config, &training, NUM_FOLDS);
            report(&trials);
            write_json(&PathBuf::from(out), &trials)
        }
        _ => bail!("say `evaluate [OUT.json]`, `train OUT` or `both OUT OUT.json`"),
    }
}

fn write_weights(
    drives: &[Learned],
    config: &SemanticsConfig,
    training: &TrainingConfig,
    path: &str,
) -> Result<()> {
    let model = train(&drives.iter().collect::<Vec<_>>(), config, training);
    std::fs::write(path, model.to_text()).with_context(|| format!("cannot write {path}"))
}

fn drives(config: &SemanticsConfig) -> Result<Vec<Learned>> {
    let datasets = std::env::var_os("LOCUTION_DATASETS").context("LOCUTION_DATASETS is not set")?;
    let sources = Sources {
        datasets: PathBuf::from(datasets),
        own_labels: PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data/labels"),
    };
    let mut drives = sources.recorded()?;
    for seed in DRIVE_SEEDS {
        drives.extend(sources.simulated(seed)?);
    }
    Ok(read_numbers(drives, config))
}

fn report(trials: &[BuildingTrial]) {
    let row = |name: &str, way: &str, report: &LabelReport| {
        let cell = |label: &&str| match report.labels.get(*label) {
            Some(score) => format!("{:.0} / {:.0}", 100.0 * score.precision, 100.0 * score.recall),
            None => "-".into(),
        };
        [name.to_owned(), way.to_owned()].into_iter().chain(LABELS.iter().map(cell)).collect::<Vec<String>>()
    };
    let mut rows = Vec::new();
    for trial in trials {
        rows.push(row(&trial.building, "rules", &trial.tree));
        rows.push(row("", "learned, unseen", &trial.unseen));
        rows.push(row("", "learned, seen", &trial.seen));
    }
    for (name, is_real) in [("all recordings", true), ("all plans", false)] {
        let of = || trials.iter().filter(move |trial| trial.is_real == is_real);
        rows.push(row(name, "rules", &pooled(of().map(|trial| &trial.tree))));
        rows.push(row("", "learned, unseen", &pooled(of().map(|trial| &trial.unseen))));
        rows.push(row("", "learned, seen", &pooled(of().map(|trial| &trial.seen))));
    }
    let mut header = vec!["building", "labels by"];
    header.extend(LABELS);
    println!("{}", table(&header, &rows));
}
