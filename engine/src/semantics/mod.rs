//! Place labels: corridor, corner, bifurcation, dead-end, hall (thesis chapter 6).
//!
//! ```text
//! observations of one run ─► segments ─► decision tree                        the thesis' way
//!
//! runs at their poses in the map ─► blocks of occupancy ─► signature of each position ─► rules ────────┐
//!                                   (what all runs saw)    (passages that leave it,                    │
//!                                          │                bends, driven ways, halls)                 ├─► labels
//!                                          └─► numbers of each position ─► learned trees ─► chain ─────┘ (all passes vote)
//!                                              (turned maps give the same)              along the run       │
//!                                    routes, stretches of one label ◄─ places of the map ◄──────────────────┘
//! ```
//! [`label_runs`] is the conductor of the second row, [`LabelModel`] chooses who decides; [`PlaceMap`] holds what becomes
//! of it, and [`MapLabels`] does both for every component of a map. [`find_rooms`] needs no run: it divides a served grid
//! into rooms and doors, which [`MapRooms`] numbers through all versions of a map. [`Anchor`]s tie what a person draws to
//! the keyframes around it.

mod anchors;
mod block;
mod config;
mod decision_tree;
mod features;
mod flood;
mod label;
mod label_map;
mod learned;
mod map_labels;
mod outline;
mod passages;
mod places;
mod rooms;
mod route;
mod rules;
mod segmentation;
mod signature;
mod stretches;
#[cfg(test)]
mod tests;
mod weights;

pub use anchors::{Anchor, MovedPose, anchors_near, carry_point};
pub use config::{LabelModel, SemanticsConfig};
pub use decision_tree::{DecisionTreeConfig, label_by_tree};
pub use label::PlaceLabel;
pub use label_map::{DrivenRun, LabeledRun, label_numbers, label_runs, place_numbers};
pub use learned::{LearnedLabels, TreeNode};
pub use map_labels::MapLabels;
pub use passages::NamedRooms;
pub use places::{Place, PlaceMap, Spot, Visit};
pub use rooms::{
    ComponentRooms, Door, KnownDoor, KnownRoom, MapRooms, Room, RoomKind, RoomMap, RoomsBefore, RoomsConfig,
    find_rooms,
};
pub use route::{Route, RouteStep, Turn, route};
pub use rules::label_of;
pub use segmentation::{Segment, SegmentationConfig, segments};
pub use signature::PlaceSignature;
pub use stretches::{LabelPattern, LabeledStretch, PatternMatch, find_pattern, labeled_stretches};
