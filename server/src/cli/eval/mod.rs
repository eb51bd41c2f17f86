//! `locution eval`: how well it works, measured as SPEC section 9 says, through the HTTP API.

use anyhow::Result;
use clap::{Args, Subcommand};

pub mod local_server;
mod map;
mod plot;
pub mod recognition;
mod stroke_font;

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
        }
    })
}
