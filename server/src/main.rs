//! The `locution` binary: arguments, configuration, logging, start; nothing else.

fn main() {}
