//! The Locution server: HTTP in front of the engine, with storage underneath.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod app;
pub mod config;
pub mod storage;
