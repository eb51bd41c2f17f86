//! The binary `locution`: `locution serve` and its companions, one file each.
#![cfg_attr(test, allow(clippy::unwrap_used))]

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

mod bags;
mod demo;
mod environment;
mod eval;
mod health;
mod key;
mod optimize;
mod replay;
mod serve;
mod shell;
mod simulate;
mod upkeep;
mod upload;
mod wire;

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
    /// Say whether a server is ready, by the exit code; for containers and scripts.
    Health(health::HealthArguments),
    /// Read everything in a data directory and say what is damaged.
    Check(upkeep::CheckArguments),
    /// Keep what can be read of a damaged site, and say what was lost.
    Repair(upkeep::SiteArguments),
    /// Write a site anew without its garbage.
    Compact(upkeep::SiteArguments),
    /// Let three simulated robots map an office floor, and show what was recognised.
    Demo(demo::DemoArguments),
    /// Post recordings to a running server.
    Replay(replay::ReplayArguments),
    /// Write a recording and its truth from a robot driving through a world.
    Simulate(simulate::SimulateArguments),
    /// Optimise a pose graph in g2o or TORO text.
    Optimize(optimize::OptimizeArguments),
    /// Measure how well it works.
    Eval(eval::EvalArguments),
    /// Make keys for servers that are reached from other machines.
    Key(key::KeyArguments),
    /// Print completions for a shell.
    Completions(shell::CompletionsArguments),
    /// Print the manual page, or write the pages of all commands.
    Man(shell::ManArguments),
}

/// Reads the arguments, runs the command and says what went wrong.
fn main() -> ExitCode {
    let command = Arguments::parse().command;
    environment::warn_of_unknown_variables();
    let outcome = match command {
        Command::Serve(arguments) => serve::run(arguments),
        Command::Health(arguments) => health::run(&arguments),
        Command::Check(arguments) => upkeep::check(&arguments),
        Command::Repair(arguments) => upkeep::repair(&arguments),
        Command::Compact(arguments) => upkeep::compact(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Optimize(arguments) => optimize::run(&arguments),
        Command::Eval(arguments) => eval::run(&arguments),
        Command::Key(arguments) => key::run(&arguments),
        Command::Completions(arguments) => shell::print_completions(Arguments::command(), &arguments),
        Command::Man(arguments) => shell::write_manual(Arguments::command(), &arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
