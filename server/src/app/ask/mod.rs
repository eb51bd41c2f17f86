//! Questions about where: by words, by a short recording, and by a robot that drives while it asks.

mod examples;
mod localizations;
mod words;

pub use examples::{ExampleInfo, ExamplePlace, PlaceIndexes};
pub use localizations::{LocalizationInfo, Localizations, LocatedHypothesis};
pub use words::{WordAnswer, find_words};
