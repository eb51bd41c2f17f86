//! From densities to text: observations become regions, regions become words (thesis sections 4.2 and 5.2).

mod observation;
mod stretch;
mod word;

pub use observation::Observation;
pub use stretch::{Direction, Interval};
pub use word::{Word, WordId};
