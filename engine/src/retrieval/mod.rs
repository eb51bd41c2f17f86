//! Density profiles as a second way to retrieve places (SPEC section 4).
//!
//! Exact chains of words break where a door stands open. The raw densities under the words still resemble each other,
//! so a window of them is slid along everything that was driven, in both directions.

mod config;
mod index;
mod profile;
mod search;

pub use config::RetrievalConfig;
pub use index::{ProfileCandidate, ProfileIndex};
pub use profile::RunProfile;
