//! Tests through the front door.
#![allow(clippy::unwrap_used)]

mod access;
mod anew;
mod bad_input;
mod batches;
mod changes;
mod crash;
mod damage;
mod disk_full;
mod documentation;
mod headers;
mod jobs;
mod lists;
mod maps;
mod memory;
mod power_cut;
mod sites;
mod stalls;
mod tls;
mod wire;
mod words;
