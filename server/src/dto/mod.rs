//! What goes over the wire: plain types with units in their names, and the one gate into the engine's types.

pub mod batches;
pub mod changes;
pub mod common;
pub mod jobs;
pub mod labels;
pub mod localizations;
pub mod maps;
pub mod places;
pub mod queries;
pub mod runs;
pub mod sites;
pub mod texts;
