//! The command line: `locution serve` and its companions, one file each.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod serve;

/// Place recognition for robots with a 2D laser.
#[derive(Debug, Parser)]
#[command(name = "locution", version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Start the server.
    Serve(serve::ServeArguments),
}

/// Reads the arguments, runs the command and says what went wrong.
pub fn run() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Serve(arguments) => serve::run(arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
