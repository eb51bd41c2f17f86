//! Rust client of the Locution HTTP API.
