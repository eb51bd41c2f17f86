//! Changes on the wire.

use locution_engine::mapping::{Change, ChangeKind};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::places::PointDto;

/// Which runs to compare.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ChangesParams {
    /// Runs of the first session, separated by commas; all other runs that share the frame unless said.
    pub before: Option<String>,
    /// Runs of the second session, separated by commas; the latest run unless said.
    pub after: Option<String>,
    /// Version of the map; the serving one unless said.
    pub version: Option<u64>,
    /// Most items to answer; 100 unless said, at most 10000.
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    pub cursor: Option<String>,
}

/// Names separated by commas.
pub fn names(list: Option<&String>) -> Option<Vec<String>> {
    list.map(|list| list.split(',').map(|name| name.trim().to_owned()).collect())
}

/// An area that changed: something came or went.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ChangeDto {
    /// `appeared` or `disappeared`.
    #[schema(example = "appeared")]
    pub kind: String,
    /// Component of the map in whose frame the positions are.
    pub component: u32,
    /// Mean position of what changed.
    #[serde(rename = "centre")]
    pub center: PointDto,
    /// Lower left corner of the rectangle around it.
    pub low: PointDto,
    /// Upper right corner.
    pub high: PointDto,
    /// Surface that changed, square metres.
    pub area_m2: f64,
    /// Free-space density observed around it in the second session, minus the first; null where one did not pass.
    pub density_change: Option<f64>,
    /// How clearly the scans and densities of both sessions tell, from 0 to 1.
    pub confidence: f64,
}

impl ChangeDto {
    /// A change in a component.
    pub fn new(component: u32, change: &Change) -> Self {
        let kind = match change.kind {
            ChangeKind::Appeared => "appeared",
            ChangeKind::Disappeared => "disappeared",
        };
        Self {
            kind: kind.into(),
            component,
            center: (&change.center).into(),
            low: (&change.low).into(),
            high: (&change.high).into(),
            area_m2: change.area_m2,
            density_change: change.density_change,
            confidence: change.confidence,
        }
    }
}
