//! `locution health`: whether a server is ready, for images that hold no other program that could ask.

use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use locution_client::Client;

/// Asks once.
#[derive(Debug, Args)]
pub struct HealthArguments {
    /// The server.
    #[arg(long, default_value = "http://127.0.0.1:7070", env = "LOCUTION_URL")]
    url: String,
    /// How long the answer may take, seconds.
    #[arg(long, default_value_t = 3)]
    timeout: u64,
}

/// Succeeds when the server is ready.
///
/// # Errors
/// It is not, or does not answer in time.
pub fn run(arguments: &HealthArguments) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let client = Client::new(&arguments.url)?;
        let patience = Duration::from_secs(arguments.timeout);
        if tokio::time::timeout(patience, client.is_ready()).await.unwrap_or(false) {
            return Ok(());
        }
        bail!("no server is ready at {}", client.base_url())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_that_is_not_there_is_not_ready() {
        // Nothing listens on the port of a listener that is gone.
        let address = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let arguments = HealthArguments { url: format!("http://{address}"), timeout: 3 };
        assert!(run(&arguments).unwrap_err().to_string().contains(&address.to_string()));
    }
}
