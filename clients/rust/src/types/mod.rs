//! Bodies of requests and answers, by their names in the API's document.
//!
//! Answers may gain members in later versions of the server; what is not known here is passed over.

mod channels;
mod events;
mod jobs;
mod keys;
mod localizations;
mod maps;
mod matches;
mod rooms;
mod runs;
mod sites;
mod texts;
mod values;

pub use channels::{ChannelMove, ChannelRobot, ChannelTarget, MapChannel, RobotReport, VdaMap};
pub use events::{Event, RunChange};
pub use jobs::{Job, JobKind, JobState};
pub use keys::{IssuedKey, Key, Keys, NewKey, Scope};
pub use localizations::{
    ExampleAnswer, ExampleEvidence, ExamplePlace, Hypothesis, Localization, LocalizationState, Missing,
    NewLocalization, PosePrior,
};
pub use maps::{
    Change, ChangeKind, ChangeVisit, Component, Connection, ConnectionKind, Grid, GridHeader, GridInfo,
    KeyframePose, Label, LabelAnswer, LabelPattern, LabelQuery, Map, MapRun, MapStatistics, Place,
    PlaceLabel, Region, RosPoint, RosPose, RosQuaternion, RosTime, Route, RouteStep, RouteTurn, Turn,
};
pub use matches::{
    Channel, DecisionKind, Evidence, Interval, Match, MatchState, Registration, RejectionReason,
};
pub use rooms::{Annotation, Door, NewAnnotation, Room, RoomLabel, Shape};
pub use runs::{CutReason, Geometry, NewRun, Receipt, Run, RunPiece, RunState, Scan, StoredScan};
pub use sites::{ChangedSite, Retention, Site, SiteChange, SiteState, SiteSummary};
pub use texts::{
    Frame, Observation, StampedPose, Trajectory, Word, WordAnswer, WordId, WordPattern, WordQuery,
};
pub use values::{Direction, Point, Pose};
