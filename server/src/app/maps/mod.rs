//! Map versions: written whole, then served; what they hold, and the forms in which other tools read them.

mod changes;
mod exports;
mod grids;
mod labels;
mod matches;
mod places;
mod regions;
mod write;

pub use changes::{NoSessions, Sessions};
pub use exports::{PictureForm, graph_as_g2o, gray_image, map_trajectories};
pub use grids::GridKey;
pub use labels::{DrivenStretch, LabelAnswer, find_labels, labels};
pub use matches::{
    MatchFilter, MatchOrder, MatchStateKind, NumberedMatch, a_match, decide, matches, undecide,
};
pub use places::{find_route, places};
pub use regions::{Topology, topology};
pub use write::{MapDraft, WrittenRun, drop_versions, note_made_of, serve_map};
