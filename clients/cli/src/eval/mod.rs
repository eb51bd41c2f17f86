//! `locution eval`: how well it works, measured as SPEC section 9 says, through the HTTP API.

use anyhow::Result;
use clap::{Args, Subcommand};

mod labels;
pub mod local_server;
mod localization;
mod map;
mod query;
pub mod recognition;
mod robust;

/// Prints tables and writes JSON.
#[derive(Debug, Args)]
pub struct EvalArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Precision and recall of place recognition against true poses.
    Recognition(recognition::RecognitionArguments),
    /// Error of the map against hand-verified relative poses.
    Map(map::MapArguments),
    /// Confusion of place labels against labelled regions.
    Labels(labels::LabelsArguments),
    /// Robots switched on at random moments: found, wrongly sure or honestly unsure.
    Localization(localization::LocalizationArguments),
    /// Short recordings that are not stored: found in the map, or honestly not here.
    Query(query::QueryArguments),
    /// Robots on maps of their own building, of a part of it, and of others, without a server: ever wrongly sure, found.
    OpenWorld(locution_lab::open_world::OpenWorldArguments),
    /// Pose graphs with forged closures: how often the optimizer is not misled.
    Robust(robust::RobustArguments),
    /// The thesis' experiments in scenarios of the same kind, beside the published numbers.
    Thesis(locution_lab::thesis::ThesisArguments),
}

/// Runs one evaluation.
///
/// # Errors
/// Files that cannot be read or written; a server that refuses.
pub fn run(arguments: &EvalArguments) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        match &arguments.what {
            What::Recognition(arguments) => recognition::run(arguments).await,
            What::Map(arguments) => map::run(arguments).await,
            What::Labels(arguments) => labels::run(arguments).await,
            What::Localization(arguments) => localization::run(arguments).await,
            What::Query(arguments) => query::run(arguments).await,
            What::OpenWorld(arguments) => locution_lab::open_world::run(arguments),
            What::Robust(arguments) => robust::run(arguments),
            What::Thesis(arguments) => locution_lab::thesis::run(arguments),
        }
    })
}
