//! From densities to text: observations become regions, regions become words (thesis sections 4.2 and 5.2).

mod builder;
mod config;
mod observation;
mod quantizer;
#[cfg(test)]
mod reference;
mod stretch;
mod word;

pub use builder::{TextBuilder, reversed_text};
pub use config::{QuantizerConfig, TextConfig};
pub use observation::Observation;
pub use quantizer::{DensityHistogram, Quantizer};
pub use stretch::{Direction, Interval};
pub use word::{Word, WordId};
