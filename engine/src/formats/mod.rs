//! Text formats to values and back: CARMEN, g2o, TORO, TUM, relations. No files, only text.

mod g2o;
mod graph_text;
mod toro;
mod tum;

pub use g2o::{read_g2o, write_g2o};
pub use graph_text::{GraphDocument, GraphTextError};
pub use toro::{read_toro, write_toro};
pub use tum::{read_tum, write_tum};
