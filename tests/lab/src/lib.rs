//! The laboratory: what measures the product or sets it beside the thesis. No robot needs any of it.
//!
//! - [`simulation`]: robots, people and lasers in drawn worlds, seeded
//! - [`evaluation`]: the figures of the specification's reports, as pure functions
//! - [`density_field`], [`particle_filter`]: Monte-Carlo localisation as the thesis has it (chapter 3)
//! - [`thesis`]: its scenarios and tables
//! - [`open_world`]: robots on maps of their own building, of a part of it, and of others, without a server
//! - [`place_learning`]: labeled drives, training of place labels, and buildings left out
//! - [`room_trials`]: rooms and doors of plans, judged
//! - [`recordings`], [`worlds`], [`report`], [`plot`]: files in, tables and pictures out
//!
//! `examples/` holds programs that map recordings and worlds without a server, and a load generator.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod density_field;
pub mod evaluation;
pub mod open_world;
pub mod particle_filter;
pub mod place_learning;
pub mod plot;
pub mod recordings;
pub mod report;
pub mod room_trials;
pub mod simulation;
pub mod small_building;
mod stroke_font;
pub mod thesis;
mod turns;
mod unpacked;
pub mod worlds;
