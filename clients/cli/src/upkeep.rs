//! `locution check`, `repair` and `compact`: looking after a data directory that no server holds.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use locution_server::upkeep::{self, SiteReport};

/// Reads everything and says what is damaged; changes nothing.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Directory of the embedded storage.
    #[arg(long, default_value = "locution-data")]
    data_directory: PathBuf,
    /// This site only.
    #[arg(long)]
    site: Option<String>,
}

/// Names one site of a data directory.
#[derive(Debug, Args)]
pub struct SiteArguments {
    /// Directory of the embedded storage.
    #[arg(long, default_value = "locution-data")]
    data_directory: PathBuf,
    /// The site.
    #[arg(long)]
    site: String,
}

/// Checks every site, or one.
///
/// # Errors
/// When a server holds the directory, and when something is damaged.
pub fn check(arguments: &CheckArguments) -> anyhow::Result<()> {
    let reports = upkeep::check(&arguments.data_directory, arguments.site.as_deref())?;
    let num_damaged = reports.iter().filter(|report| !report.problems.is_empty()).count();
    reports.iter().for_each(tell);
    if num_damaged > 0 {
        bail!("{num_damaged} of {} sites are damaged", reports.len());
    }
    Ok(())
}

/// Keeps what can be read of a site.
///
/// # Errors
/// When a server holds the directory, and when nothing can be read.
pub fn repair(arguments: &SiteArguments) -> anyhow::Result<()> {
    let (report, kept) = upkeep::repair(&arguments.data_directory, &arguments.site)?;
    tell(&report);
    println!("the site as it was is kept in {}", kept.display());
    Ok(())
}

/// Writes a site anew without its garbage.
///
/// # Errors
/// When a server holds the directory, and when the site is damaged.
pub fn compact(arguments: &SiteArguments) -> anyhow::Result<()> {
    tell(&upkeep::compact(&arguments.data_directory, &arguments.site)?);
    Ok(())
}

fn tell(report: &SiteReport) {
    println!(
        "{}: {} records of {} commits ({} acknowledged), {} bytes on disk, {} before: {}",
        report.site,
        report.num_records,
        report.num_commits,
        report.num_acknowledged,
        report.num_bytes_after,
        report.num_bytes_before,
        if report.problems.is_empty() { "sound" } else { "DAMAGED" },
    );
    for problem in &report.problems {
        println!("  {problem}");
    }
}
