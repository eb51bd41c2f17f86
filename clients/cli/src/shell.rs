//! `locution completions` and `locution man`: what a shell and its manual need to know of the command line.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;

/// To be read by the shell, such as `source <(locution completions bash)`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// The manual page of `locution`, or a page for every command.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Write a page for every command into this directory, such as locution-replay.1.
    #[arg(long)]
    directory: Option<PathBuf>,
}

/// Prints a completion script.
///
/// # Errors
/// The output is closed.
pub fn print_completions(mut command: Command, arguments: &CompletionsArguments) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "locution", &mut script);
    Ok(std::io::stdout().write_all(&script)?)
}

/// Prints the manual page or writes all of them.
///
/// # Errors
/// The directory cannot be written to.
pub fn write_manual(command: Command, arguments: &ManArguments) -> Result<()> {
    let Some(directory) = &arguments.directory else {
        return Ok(Man::new(command).render(&mut std::io::stdout())?);
    };
    let cannot_write = || format!("cannot write to {}", directory.display());
    std::fs::create_dir_all(directory).with_context(cannot_write)?;
    clap_mangen::generate_to(command, directory).with_context(cannot_write)
}
