//! Questions about where: by words, by a short recording, and by a robot that drives while it asks.

mod examples;
mod localizations;
mod words;

pub use examples::{ExampleInfo, PlaceIndexes};
pub use localizations::{Declared, LocalizationInfo, Localizations};
pub use words::{WordAnswer, find_words};
