//! `locution key new`: an API key, and the entry by which the server's configuration knows it.

use std::io::Write;

use anyhow::{Context, Result};
use clap::{Args, Subcommand, ValueEnum};
use locution_server::config::{ApiKeyConfig, Scope};
use rand::TryRng;
use rand::rngs::SysRng;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// Keys for servers that are reached from other machines.
#[derive(Debug, Args)]
pub struct KeyArguments {
    #[command(subcommand)]
    action: KeyAction,
}

#[derive(Debug, Subcommand)]
enum KeyAction {
    /// Make a key: it is printed once, with its entry for the server's configuration.
    New(NewKeyArguments),
}

#[derive(Debug, Args)]
struct NewKeyArguments {
    /// What the server's log calls the key.
    #[arg(long, default_value = "robots")]
    name: String,
    /// What the key may do.
    #[arg(long, value_enum, default_value = "write")]
    scope: ScopeArgument,
    /// Sites that it may be used for.
    #[arg(long = "site", default_value = "*")]
    sites: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ScopeArgument {
    /// Look, query, localise.
    Read,
    /// Also send runs, build maps and decide on matches.
    Write,
    /// Also make and delete sites.
    Admin,
}

impl From<ScopeArgument> for Scope {
    fn from(scope: ScopeArgument) -> Self {
        match scope {
            ScopeArgument::Read => Self::Read,
            ScopeArgument::Write => Self::Write,
            ScopeArgument::Admin => Self::Admin,
        }
    }
}

/// The part of the server's configuration that holds keys.
#[derive(Serialize)]
struct Keys {
    keys: [ApiKeyConfig; 1],
}

/// Makes a key. The key alone goes to standard output, so that it can be piped; the rest to standard error.
///
/// # Errors
/// The system gives no random bytes, or the output is closed.
pub fn run(arguments: &KeyArguments) -> Result<()> {
    let KeyAction::New(new) = &arguments.action;
    let mut secret = [0; 32];
    SysRng.try_fill_bytes(&mut secret).context("the system gives no random bytes")?;
    let (key, entry) = describe(&secret, new)?;
    eprintln!(
        "Add this to the file of `locution serve --config FILE`; the key itself is shown only now:\n\n{entry}"
    );
    writeln!(std::io::stdout(), "{key}")?;
    Ok(())
}

/// The key and its entry.
fn describe(secret: &[u8; 32], new: &NewKeyArguments) -> Result<(String, String)> {
    let key = format!("locution_{}", hexadecimal(secret));
    let entry = ApiKeyConfig {
        name: new.name.clone(),
        sha256: hexadecimal(&Sha256::digest(key.as_bytes())),
        scope: new.scope.into(),
        sites: new.sites.clone(),
        ..ApiKeyConfig::default()
    };
    Ok((key, toml::to_string(&Keys { keys: [entry] })?))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use locution_server::config::ServerConfig;

    #[test]
    fn the_entry_is_configuration_that_knows_the_key() {
        let new = NewKeyArguments {
            name: "fleet \"north\"".into(),
            scope: ScopeArgument::Read,
            sites: vec!["hall-1".into(), "hall-2".into()],
        };
        let (key, entry) = describe(&[7; 32], &new).unwrap();
        let config: ServerConfig = toml::from_str(&entry).unwrap();
        config.validate().unwrap();
        let found = &config.keys[0];
        assert_eq!(found.sha256, hexadecimal(&Sha256::digest(key.as_bytes())));
        assert_eq!((found.scope, &found.name, &found.sites), (Scope::Read, &new.name, &new.sites));
        assert_ne!(describe(&[8; 32], &new).unwrap().0, key);
    }
}
