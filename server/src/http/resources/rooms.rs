//! Rooms of a map and the doors between them.

use std::collections::BTreeMap;

use axum::Json;
use axum::response::Response;
use locution_engine::semantics::{ComponentRooms, KnownDoor, KnownRoom, MapRooms, RoomKind};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::maps::MapParams;
use crate::app::AppError;
use crate::app::maps::{PlacedAnnotation, annotations, names_of_rooms, rooms};
use crate::error::ApiError;
use crate::extract::{Paged, SiteOf};
use crate::http::forms::MapAt;
use crate::http::geojson::{
    CollectionTypeDto, FeatureCollectionDto, FeatureDto, FeatureKindDto, FeaturePropertiesDto,
    FeatureTypeDto, ShapeDto,
};
use crate::http::values::{Page, PageParams, PointDto};
use crate::records::Shape;

/// What a room is by its shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RoomLabelDto {
    /// Neither long nor very wide.
    Room,
    /// Many times as long as it is wide.
    Corridor,
    /// Wide in both directions.
    Hall,
}

impl From<RoomKind> for RoomLabelDto {
    fn from(kind: RoomKind) -> Self {
        match kind {
            RoomKind::Room => Self::Room,
            RoomKind::Corridor => Self::Corridor,
            RoomKind::Hall => Self::Hall,
        }
    }
}

/// A door of a room.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct DoorDto {
    /// Its middle.
    pub position: PointDto,
    /// Diameter of the largest disc that passes through it, metres.
    pub width_m: f64,
    /// Ids of the rooms that it joins.
    pub rooms: Vec<u64>,
}

impl From<&KnownDoor> for DoorDto {
    fn from(door: &KnownDoor) -> Self {
        let rooms = vec![door.rooms.0, door.rooms.1];
        Self { position: (&door.position).into(), width_m: door.width_m, rooms }
    }
}

/// A part of the floor with walls and doors around it.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct RoomDto {
    /// Its id, the same in every version that holds the room.
    pub id: u64,
    /// What it is by its shape.
    pub label: RoomLabelDto,
    /// What people call it: the name of the annotation of kind `room` that lies in it.
    pub name: Option<String>,
    /// Component of the map in whose frame the positions are.
    pub component: u32,
    /// Free floor in it, square metres.
    #[schema(minimum = 0)]
    pub area_m2: f64,
    /// The position in it that is farthest from any wall.
    #[serde(rename = "centre")]
    pub center: PointDto,
    /// Its floor, a polygon.
    pub geometry: ShapeDto,
    /// Ids of the rooms that a door joins it to.
    #[serde(rename = "neighbours")]
    pub neighbors: Vec<u64>,
    /// Its doors.
    pub doors: Vec<DoorDto>,
}

impl RoomDto {
    fn new(rooms: &ComponentRooms, room: &KnownRoom, names: &BTreeMap<u64, String>) -> Self {
        let doors = rooms.doors.iter().filter(|door| door.rooms.0 == room.id || door.rooms.1 == room.id);
        Self {
            id: room.id,
            label: room.kind.into(),
            name: names.get(&room.id).cloned(),
            component: rooms.component,
            area_m2: room.area_m2,
            center: (&room.center).into(),
            geometry: ShapeDto::polygon(&room.rings),
            neighbors: room.neighbors.clone(),
            doors: doors.map(DoorDto::from).collect(),
        }
    }
}

/// Rooms, corridors and halls with the doors between them, in the order of components and ids. Ids and names survive rebuilds.
#[utoipa::path(get, path = "/v1/sites/{site}/rooms", operation_id = "list_rooms", tag = "maps",
    params(MapParams, PageParams),
    responses((status = 200, description = "A page of rooms", body = Page<RoomDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_rooms(
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<MapParams>,
) -> Result<Json<Page<RoomDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let (found, names) = (rooms(&map).await?, names_of_rooms(&map).await?);
    let of = |rooms: &&ComponentRooms| params.component.is_none_or(|wanted| wanted == rooms.component);
    let wanted = || {
        let components = found.components.iter().filter(of);
        components.flat_map(|rooms| rooms.rooms.iter().map(move |room| (rooms, room)))
    };
    let items = wanted().map(|(rooms, room)| RoomDto::new(rooms, room, &names));
    Ok(Json(Page::of_all(items, wanted().count(), page)))
}

fn features(
    found: &MapRooms,
    names: &BTreeMap<u64, String>,
    drawn: &[PlacedAnnotation],
    component: Option<u32>,
) -> Vec<FeatureDto> {
    let mut features = Vec::new();
    let feature = |geometry, properties| FeatureDto { kind: FeatureTypeDto::Feature, geometry, properties };
    let properties = |feature, component| FeaturePropertiesDto {
        feature,
        component,
        id: None,
        label: None,
        name: None,
        area_m2: None,
        width_m: None,
        rooms: Vec::new(),
    };
    for of in found.components.iter().filter(|of| component.is_none_or(|wanted| wanted == of.component)) {
        for room in &of.rooms {
            let label = match room.kind {
                RoomKind::Room => "room",
                RoomKind::Corridor => "corridor",
                RoomKind::Hall => "hall",
            };
            let said = FeaturePropertiesDto {
                id: Some(room.id.to_string()),
                label: Some(label.to_owned()),
                name: names.get(&room.id).cloned(),
                area_m2: Some(room.area_m2),
                rooms: room.neighbors.clone(),
                ..properties(FeatureKindDto::Room, of.component)
            };
            features.push(feature(ShapeDto::polygon(&room.rings), said));
        }
        for door in &of.doors {
            let said = FeaturePropertiesDto {
                width_m: Some(door.width_m),
                rooms: vec![door.rooms.0, door.rooms.1],
                ..properties(FeatureKindDto::Door, of.component)
            };
            features.push(feature(ShapeDto::from(&Shape::Point(door.position)), said));
        }
    }
    for placed in drawn {
        let Some((of, shape)) = &placed.place else { continue };
        let said = FeaturePropertiesDto {
            id: Some(placed.id.to_string()),
            label: Some(placed.annotation.kind.clone()),
            name: Some(placed.annotation.name.clone()),
            ..properties(FeatureKindDto::Annotation, *of)
        };
        features.push(feature(shape.into(), said));
    }
    features
}

/// Rooms, doors and annotations as a GeoJSON feature collection, in metres under the frame of each component.
#[utoipa::path(get, path = "/v1/sites/{site}/map/rooms.geojson", operation_id = "get_rooms_geojson", tag = "maps",
    params(MapParams),
    responses(
        (status = 200, description = "The features", body = FeatureCollectionDto, content_type = "application/geo+json"),
        (status = 304, description = "The client has this"),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_rooms_geojson(at: MapAt) -> Result<Response, ApiError> {
    // Annotations change without a new version of the map.
    let tag = at.tag_with(at.site.state().record.next_decision);
    let body = async {
        let (found, names) = (rooms(&at.map).await?, names_of_rooms(&at.map).await?);
        let drawn = annotations(&at.map, at.component, None).await?;
        let features = features(&found, &names, &drawn, at.component);
        let collection = FeatureCollectionDto { kind: CollectionTypeDto::FeatureCollection, features };
        Ok(serde_json::to_vec(&collection).map_err(AppError::internal)?)
    };
    at.answer_as(tag, "application/geo+json", body).await
}
