//! Writes `openapi/openapi.json` from the server's code; with `--check` fails when it is stale.

use std::path::Path;

use anyhow::{Context, bail};

fn main() -> anyhow::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi.json");
    let current = locution_server::document_json();
    if std::env::args().any(|argument| argument == "--check") {
        let checked_in = std::fs::read_to_string(&path).context("openapi.json has not been written")?;
        if checked_in != current {
            bail!(
                "openapi.json is stale: run `cargo build --workspace`, then `target/debug/locution-openapi`, and look \
                 at the difference"
            );
        }
        return Ok(());
    }
    std::fs::write(&path, current).context("openapi.json cannot be written")?;
    Ok(())
}
