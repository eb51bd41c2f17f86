//! Chains of matching words and what they are worth (thesis 4.2.3, 5.2.3, 5.2.4).

mod alignment;
mod chain;
mod claim;
mod config;
mod evidence;
mod rows;
mod run_match;
mod trace;

#[cfg(test)]
mod chain_tests;

pub use alignment::{Alignment, align_words};
pub use chain::{Chain, ChainFinder, Relation, find_chains, find_chains_in};
pub(crate) use claim::claimed_between;
pub use claim::{ObservationPair, aligned_nodes, chain_stretches, claimed_pairs};
pub use config::MatchingConfig;
pub use evidence::{ChainEvidence, TextStatistics};
pub use run_match::{RunMatch, match_run};
