//! Tests through the front door.
#![allow(clippy::unwrap_used)]

mod access;
mod anew;
mod bad_input;
mod batches;
mod changes;
mod channels;
mod crash;
mod damage;
mod disk_full;
mod documentation;
mod drawn;
mod headers;
mod jobs;
mod lasers;
mod lists;
mod maps;
mod memory;
mod power_cut;
mod rooms;
mod shares;
mod sites;
mod soak;
mod stalls;
mod tls;
mod upgrade;
mod wire;
mod words;
