//! Rust client of the Locution HTTP API.
//!
//! Speaks only what the API document says; it shares no code with the server. Metres, radians, integer
//! nanoseconds.
//!
//! ```no_run
//! # async fn example(geometry: locution_client::Geometry, scans: Vec<locution_client::Scan>)
//! # -> Result<(), locution_client::ClientError> {
//! use locution_client::{Client, Encoding, NewRun};
//!
//! let client = Client::new("http://127.0.0.1:7070")?;
//! client.put_site("office", None).await?;
//! let run = NewRun { robot: Some("robot-1".into()), geometry, area: None };
//! let mut upload = client.start_upload("office", "monday", &run, Encoding::Cbor).await?;
//! // After an interruption the upload begins where the server's copy ends.
//! for batch in scans[upload.next_sequence() as usize..].chunks(100) {
//!     upload.post(batch).await?;
//! }
//! client.finish_run("office", "monday").await?;
//! client.build_map("office").await?;
//! # Ok(())
//! # }
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod annotations;
mod channels;
mod client;
mod error;
mod events;
mod jobs;
mod keys;
mod localizations;
mod maps;
mod matches;
mod pages;
mod queries;
mod routes;
mod runs;
mod sites;
mod types;
mod upload;

#[cfg(test)]
mod document_tests;

pub use client::{Client, RetryPolicy, choose_ciphers};
pub use error::{ClientError, Problem};
pub use events::Events;
pub use maps::{MapAt, MapForm};
pub use matches::{MatchFilter, MatchOrder};
pub use types::*;
pub use upload::{Encoding, RunUpload};
