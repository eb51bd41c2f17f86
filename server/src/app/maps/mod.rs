//! Map versions: written whole, then served; what they hold, and the forms in which other tools read them.

mod annotations;
mod changes;
mod channels;
mod exports;
mod grids;
mod labels;
mod matches;
mod mcap;
mod places;
mod regions;
mod rooms;
mod write;

pub use annotations::{
    GivenAnnotation, PlacedAnnotation, an_annotation, annotate, annotations, change_annotation,
    delete_annotation, keep_annotations,
};
pub use changes::{ChangeVisit, DatedChange, NoSessions, Sessions};
pub use channels::{
    a_channel, channel_robots, channels, delete_channel, move_channel, note_robot, roll_back,
};
pub use exports::{PictureForm, graph_as_g2o, gray_image, ways_of_runs};
pub use grids::GridKey;
pub use labels::{DrivenStretch, LabelAnswer, find_labels, labels};
pub use matches::{
    MatchFilter, MatchOrder, MatchStateKind, NumberedMatch, a_match, decide, matches, undecide,
};
pub use mcap::map_as_mcap;
pub use places::{find_route, places};
pub use regions::{Topology, topology};
pub use rooms::{names_of_rooms, rooms, rooms_before};
pub use write::{MapDraft, WrittenRun, drop_versions, note_made_of, serve_map};
