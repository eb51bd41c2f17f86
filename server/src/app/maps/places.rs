//! Ways between the places of a map.

use locution_engine::geometry::Point2;
use locution_engine::semantics::{NamedRooms, PlaceMap, Route, route};

use super::rooms::names_of_rooms;
use crate::app::{AppError, on_blocking_thread};
use crate::records::Map;

/// A position farther than this from any driven ground is not on the map, metres.
const REACH_M: f64 = 5.0;

/// The places of a component.
///
/// # Errors
/// [`AppError::NotFound`] for a component without places.
pub async fn places(map: &Map, component: u32) -> Result<PlaceMap, AppError> {
    map.places(component).await?.ok_or_else(|| AppError::not_found("component", component))
}

/// A way from one position of a component to another.
///
/// # Errors
/// [`AppError::NotFound`] when no way is known or a position is off the map.
pub async fn find_route(map: &Map, component: u32, from: Point2, to: Point2) -> Result<Route, AppError> {
    let places = places(map, component).await?;
    let names = names_of_rooms(map).await?;
    let rooms = map.rooms().await?;
    let found = on_blocking_thread(move || {
        let of_component = rooms.as_ref().and_then(|rooms| rooms.component(component));
        route(&places, &NamedRooms { rooms: of_component, names }, &from, &to, REACH_M)
    })
    .await?;
    found
        .ok_or_else(|| AppError::not_found("way", format!("({}, {}) → ({}, {})", from.x, from.y, to.x, to.y)))
}
