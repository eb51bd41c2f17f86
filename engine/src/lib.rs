//! Place recognition by texts of free-space density: values in, values out.
//!
//! The science is Maffei's "Translating sensor measurements into texts for localization and mapping with mobile
//! robots". Everything here is a pure function or a plain value: no HTTP, no storage, no clock, no files, no global
//! randomness. The same input gives the same bytes. Units are metres, radians and seconds throughout.
//!
//! Read the rooms in the order of the data flow:
//! [`scan`] → [`sampling`], [`grid`] → [`density`] → [`text`] (joined by the [`translator`]) → [`index`] →
//! [`matching`], [`retrieval`] → [`registration`] → [`pose_graph`] → [`mapping`] → [`recording`], where a run
//! was driven in a map; beside it [`occupancy`], what is drawn of a map, [`locate`], [`recall`] and [`semantics`], which read it, and [`formats`].

#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod config;
pub mod config_error;
pub mod density;
pub mod formats;
pub mod geometry;
pub mod grid;
pub mod index;
pub mod locate;
pub mod mapping;
pub mod matching;
pub mod occupancy;
pub mod pose_graph;
pub mod recall;
pub mod recording;
pub mod registration;
pub mod retrieval;
pub mod sampling;
pub mod scan;
pub mod semantics;
pub mod text;
pub mod translator;
