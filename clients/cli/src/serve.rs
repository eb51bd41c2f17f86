//! `locution serve`: the server in the foreground until it is told to stop.

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use serde::Serialize;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use locution_server::config::{LogConfig, ServerConfig};
use locution_server::{StartError, start_server};

/// Flags win over the environment (`LOCUTION_…`), which wins over the file.
#[derive(Debug, Args, Serialize)]
pub struct ServeArguments {
    /// A TOML file with the configuration.
    #[arg(long, env = "LOCUTION_CONFIG")]
    #[serde(skip)]
    config: Option<PathBuf>,
    /// Where to listen [default: 127.0.0.1:7070].
    #[arg(long)]
    #[serde(skip_serializing_if = "Option::is_none")]
    address: Option<SocketAddr>,
    /// Directory of the embedded storage [default: locution-data].
    #[arg(long)]
    #[serde(skip_serializing_if = "Option::is_none")]
    data_directory: Option<PathBuf>,
    /// `s3://BUCKET/PREFIX` of an object store, in place of the data directory.
    #[arg(long)]
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "as_address")]
    storage: Option<String>,
    /// Print the effective configuration as TOML and exit.
    #[arg(long)]
    #[serde(skip)]
    print_config: bool,
}

/// As one field of the table, so that the flag leaves what a file says of the others.
fn as_address<S: serde::Serializer>(address: &Option<String>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map([("address", address)])
}

/// Serves until interrupted.
///
/// # Errors
/// A configuration that cannot work, a data directory or an address that cannot be used.
pub fn run(arguments: ServeArguments) -> anyhow::Result<()> {
    let load = || ServerConfig::load(arguments.config.as_deref(), &arguments);
    let config = load().context("configuration")?;
    if arguments.print_config {
        print!("{}", toml::to_string(&config)?);
        return Ok(());
    }
    start_logging(&config.log)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let outcome = runtime.block_on(async {
        let server = start_server(config).await?;
        // Scripts that start the server on port 0 read the address here.
        println!("listening on {}", server.url());
        until_interrupted(|| {
            let outcome = load().map_err(StartError::from).and_then(|config| server.reload(&config));
            match outcome {
                Ok(()) => tracing::info!("the configuration was read again"),
                Err(error) => tracing::error!(%error, "the configuration could not be read again"),
            }
        })
        .await?;
        tracing::info!("stopping");
        Ok(server.shutdown().await?)
    });
    // A build that is under way would hold up the exit; it is begun anew at the next start.
    runtime.shutdown_timeout(Duration::from_secs(2));
    outcome
}

/// Logs go to standard error, so that standard output stays for answers.
fn start_logging(config: &LogConfig) -> anyhow::Result<()> {
    let filter: Targets = config.filter.parse().context("log.filter")?;
    // Colours are for people; a file or another program gets plain text.
    let is_colored = std::io::stderr().is_terminal();
    let layer = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_ansi(is_colored);
    let layer = if config.is_json { layer.json().boxed() } else { layer.boxed() };
    // A second start in one process, as in tests, keeps the first subscriber.
    let _ = tracing_subscriber::registry().with(layer.with_filter(filter)).try_init();
    Ok(())
}

/// Returns when the process is told to end; does `reload` whenever it is told to read its configuration again.
async fn until_interrupted(reload: impl Fn()) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let mut terminated = signal(SignalKind::terminate())?;
        let mut hung_up = signal(SignalKind::hangup())?;
        loop {
            tokio::select! {
                outcome = tokio::signal::ctrl_c() => return outcome,
                _ = terminated.recv() => return Ok(()),
                _ = hung_up.recv() => reload(),
            }
        }
    }
    #[cfg(not(unix))]
    {
        let _ = reload;
        tokio::signal::ctrl_c().await
    }
}
