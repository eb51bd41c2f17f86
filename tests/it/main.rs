//! Tests through the front door.
#![allow(clippy::unwrap_used)]

mod access;
mod bad_input;
mod batches;
mod changes;
mod crash;
mod documentation;
mod maps;
mod sites;
mod wire;
mod words;
