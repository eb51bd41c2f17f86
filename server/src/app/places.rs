//! Places of a map and the ways between them, as the engine gathers them per component.

use locution_engine::geometry::Point2;
use locution_engine::semantics::{PlaceMap, Route, route};

use super::maps::MapRecord;
use super::site::Site;
use super::{AppError, on_blocking_thread};
use crate::storage::keys::{Key, MapVersion};
use crate::storage::{Batch, StorageError, codec};

/// Places stand under this kind of map part, as JSON in pieces.
const PLACES: u8 = 3;
const PIECE_BYTES: usize = 512 << 10;
/// A position farther than this from any driven ground is not on the map, metres.
const REACH_M: f64 = 5.0;

/// Writes the places of a component into a batch.
pub(super) fn append_places(
    batch: &mut Batch,
    version: MapVersion,
    component: u32,
    places: &PlaceMap,
) -> Result<(), AppError> {
    let json = serde_json::to_vec(places).map_err(AppError::internal)?;
    for (idx, piece) in json.chunks(PIECE_BYTES).enumerate() {
        let number = u64::from(component) << 32 | idx as u64;
        batch.put(Key::MapPart(version, PLACES, number).encode(), codec::encode(&piece.to_vec()));
    }
    Ok(())
}

impl Site {
    /// The places of a component of a version.
    ///
    /// # Errors
    /// [`AppError::NotFound`] for a component without places.
    pub async fn places(&self, map: &MapRecord, component: u32) -> Result<PlaceMap, AppError> {
        let mut prefix = Key::all_map_parts(map.version, PLACES);
        prefix.extend(component.to_be_bytes());
        let pieces = self.store().scan(&prefix, &[], usize::MAX).await?;
        if pieces.is_empty() {
            return Err(AppError::not_found("component", component));
        }
        let mut json = Vec::new();
        for (_, piece) in pieces {
            json.extend(codec::decode::<Vec<u8>>(&piece, "places")?);
        }
        let corrupt = |error: serde_json::Error| StorageError::Corrupt { what: format!("places: {error}") };
        Ok(serde_json::from_slice(&json).map_err(corrupt)?)
    }

    /// A way from one position of a component to another.
    ///
    /// # Errors
    /// [`AppError::NotFound`] when no way is known or a position is off the map.
    pub async fn route(
        &self,
        map: &MapRecord,
        component: u32,
        from: Point2,
        to: Point2,
    ) -> Result<Route, AppError> {
        let places = self.places(map, component).await?;
        let found = on_blocking_thread(move || route(&places, &from, &to, REACH_M)).await?;
        found.ok_or_else(|| {
            AppError::not_found("way", format!("({}, {}) → ({}, {})", from.x, from.y, to.x, to.y))
        })
    }
}
