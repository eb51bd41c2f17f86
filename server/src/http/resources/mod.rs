//! One file per resource: parameters, bodies, handlers, in that order. A body's conversion is the one gate into the
//! types of the use cases; a handler extracts, calls one use case and wraps the answer.

pub(super) mod annotations;
pub(super) mod backups;
pub(super) mod batches;
pub(super) mod changes;
pub(super) mod channels;
pub(super) mod events;
pub(super) mod jobs;
pub(super) mod keys;
pub(super) mod labels;
pub(super) mod localizations;
pub(super) mod maps;
pub(super) mod matches;
pub(super) mod operations;
pub(super) mod places;
pub(super) mod rooms;
pub(super) mod runs;
pub(super) mod sites;
pub(super) mod texts;
pub(super) mod word_queries;
