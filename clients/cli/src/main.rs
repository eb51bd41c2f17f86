//! The binary `locution`: `locution serve` and its companions, one file each.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod demo;
mod eval;
mod optimize;
mod replay;
mod serve;
mod simulate;
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
}

/// Reads the arguments, runs the command and says what went wrong.
fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Serve(arguments) => serve::run(arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Optimize(arguments) => optimize::run(&arguments),
        Command::Eval(arguments) => eval::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
