//! The `locution` binary: arguments, configuration, logging, start; nothing else.

use std::process::ExitCode;

fn main() -> ExitCode {
    locution_server::cli::run()
}
