//! Text formats to values and back: CARMEN, g2o, TORO, TUM, relations. No files, only text.

mod carmen;
mod carmen_writer;
mod decimal_time;
mod fields;
mod labels;
mod map_server;
mod relations;
mod truth;

pub use carmen::{
    CarmenLog, CarmenMessage, CarmenOptions, CarmenReader, CarmenScan, parse_carmen_line, read_carmen_log,
};
pub use carmen_writer::{carmen_header, carmen_scan_lines};
pub use decimal_time::{format_seconds, parse_seconds_ns};
use fields::Fields;
pub use fields::FormatError;
pub use labels::{LabeledPlaces, LabeledRegion};
pub use map_server::{GrayImage, MapServerYaml, parse_map_server_yaml, parse_pgm, write_pgm};
pub use relations::{Relation, parse_relations};
pub use truth::{TruthPose, parse_truth, truth_text};
mod g2o;
mod graph_text;
mod toro;
mod tum;

pub use g2o::{read_g2o, write_g2o};
pub use graph_text::{GraphDocument, GraphTextError};
pub use toro::{read_toro, write_toro};
pub use tum::write_tum;
