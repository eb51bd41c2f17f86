//! Tests through the front door.
#![allow(clippy::unwrap_used)]

mod access;
mod bad_input;
mod batches;
mod changes;
mod crash;
mod damage;
mod disk_full;
mod documentation;
mod lasers;
mod maps;
mod power_cut;
mod sites;
mod wire;
mod words;
