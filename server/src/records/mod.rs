//! What stands under which key of a site, and how it is read back. Storage below knows bytes only; the use cases above
//! ask for runs and maps.
//!
//! ```text
//! app ─► SiteReader: one store, one text generation ─► Run: observations · words · keyframes · scans
//!                                                   └► Map: poses · labels · places · rooms · matches
//!
//! keys                       where a value stands, in the order in which it is read
//! stored, stored_map, annotation, channel   plain values
//! series, scans, pieces      values that are cut into chunks
//! codec, packed_ranges       their bytes, with version and checksum
//! ```
//!
//! A reader is made once for a question: whoever asks for a run and then for its words gets both from one generation,
//! also when another begins to serve between the two.

mod annotation;
mod channel;
pub mod codec;
mod deletion;
mod keys;
mod map;
mod packed_ranges;
mod pieces;
mod reader;
mod run;
mod scans;
pub mod series;
mod stored;
mod stored_map;

pub use annotation::{Annotation, Shape};
pub use channel::{Channel, ChannelMove, RobotReport};
pub use deletion::delete_prefixes;
pub use keys::{Generation, Key, MapVersion, PartKind, RunIdx};
pub use map::{Map, PlacedRun, RunPlaces, Visit, append_places, append_rooms, match_chunks};
pub use pieces::{join_pieces, pieces};
pub use reader::SiteReader;
pub use run::Run;
pub use scans::{append_scans, find_receipt, is_same_scan, read_scans, read_stamps};
pub use stored::{
    JobKind, JobRecord, JobState, ReadingRules, Receipt, Retention, RunHead, RunRecord, SiteRecord,
    StoredKeyframe, TextHead,
};
pub use stored_map::{Digest, MapPose, MapRecord, MapRun, MatchPlace, StoredLabel, StretchPlace};
