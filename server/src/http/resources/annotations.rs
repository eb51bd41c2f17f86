//! What people draw into a map: names of rooms, docks, areas that robots keep out of.

use axum::Json;
use axum::http::StatusCode;
use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::maps::VersionParams;
use crate::app::Name;
use crate::app::maps::{
    GivenAnnotation, PlacedAnnotation, an_annotation, annotate, annotations, change_annotation,
    delete_annotation,
};
use crate::error::ApiError;
use crate::extract::{Body, IdOf, Paged, Params, SiteOf};
use crate::http::geojson::ShapeDto;
use crate::http::values::{Page, PageParams};
use crate::http::with_location;

/// Characters of a name.
const NAME_LENGTH_MAX: usize = 200;

/// Which annotations, and in which map.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct AnnotationParams {
    /// Only of this kind.
    pub kind: Option<String>,
    /// Only in this component.
    pub component: Option<u32>,
    /// Version of the map in which they are to be placed; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// What to draw.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewAnnotationDto {
    /// What sort of thing it is, in words of your own; `room` names the room in which it lies.
    #[schema(example = "dock", min_length = 1, max_length = 64)]
    pub kind: String,
    /// What people call it.
    #[schema(example = "Charging station", min_length = 1, max_length = 200)]
    pub name: String,
    /// Component of the map in whose frame the geometry is; the first unless said.
    #[serde(default)]
    pub component: u32,
    /// Where it is, in metres; at most 1000 positions.
    pub geometry: ShapeDto,
}

impl NewAnnotationDto {
    fn check(self) -> Result<GivenAnnotation, ApiError> {
        let kind = Name::new(&self.kind, "kind")?.to_string();
        let length = self.name.chars().count();
        if self.name.trim().is_empty() || length > NAME_LENGTH_MAX || self.name.chars().any(char::is_control)
        {
            let detail =
                format!("a name has 1 to {NAME_LENGTH_MAX} characters, none of them a control character");
            return Err(ApiError::invalid("name", detail));
        }
        let shape = self.geometry.check()?;
        Ok(GivenAnnotation { kind, name: self.name, component: self.component, shape })
    }
}

/// Something that a person drew, where it lies in a version of the map.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct AnnotationDto {
    /// Its id, the same in every version.
    #[schema(example = "7")]
    pub id: String,
    /// What sort of thing it is.
    pub kind: String,
    /// What people call it.
    pub name: String,
    /// Component of the map in whose frame the geometry is; null in a version without the runs that drove there.
    pub component: Option<u32>,
    /// Where it is, in metres; null in a version without the runs that drove there.
    pub geometry: Option<ShapeDto>,
}

impl From<PlacedAnnotation> for AnnotationDto {
    fn from(placed: PlacedAnnotation) -> Self {
        Self {
            id: placed.id.to_string(),
            kind: placed.annotation.kind,
            name: placed.annotation.name,
            component: placed.place.as_ref().map(|(component, _)| *component),
            geometry: placed.place.as_ref().map(|(_, shape)| shape.into()),
        }
    }
}

/// Annotations where they lie in the serving map, or in a version, in the order of their making.
#[utoipa::path(get, path = "/v1/sites/{site}/annotations", operation_id = "list_annotations", tag = "maps",
    params(AnnotationParams, PageParams),
    responses((status = 200, description = "A page of annotations", body = Page<AnnotationDto>),
        (status = 409, description = "No map has been built yet")))]
pub async fn list_annotations(
    SiteOf(site): SiteOf,
    Paged(params, page): Paged<AnnotationParams>,
) -> Result<Json<Page<AnnotationDto>>, ApiError> {
    let map = site.map(params.version).await?;
    let found = annotations(&map, params.component, params.kind.as_deref()).await?;
    let total = found.len();
    Ok(Json(Page::of_all(found.into_iter().map(AnnotationDto::from), total, page)))
}

/// Draw something into the map. It is tied to the places around it and moves with them in every version to come.
#[utoipa::path(post, path = "/v1/sites/{site}/annotations", operation_id = "make_annotation", tag = "maps",
    params(VersionParams), request_body = NewAnnotationDto,
    responses((status = 201, description = "It is kept", body = AnnotationDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn make_annotation(
    SiteOf(site): SiteOf,
    Params(params): Params<VersionParams>,
    Body(body): Body<NewAnnotationDto>,
) -> Result<Response, ApiError> {
    let map = site.map(params.version).await?;
    let id = annotate(&site, &map, body.check()?).await?;
    let made = AnnotationDto::from(an_annotation(&map, id).await?);
    let location = format!("/v1/sites/{}/annotations/{id}", site.name());
    Ok(with_location(&location, (StatusCode::CREATED, Json(made))))
}

/// One annotation.
#[utoipa::path(get, path = "/v1/sites/{site}/annotations/{id}", operation_id = "get_annotation", tag = "maps",
    params(VersionParams),
    responses((status = 200, description = "The annotation", body = AnnotationDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn get_annotation(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<VersionParams>,
) -> Result<Json<AnnotationDto>, ApiError> {
    let map = site.map(params.version).await?;
    Ok(Json(an_annotation(&map, id).await?.into()))
}

/// Draw something else in its place; everything of it is as the body says.
#[utoipa::path(put, path = "/v1/sites/{site}/annotations/{id}", operation_id = "change_annotation", tag = "maps",
    params(VersionParams), request_body = NewAnnotationDto,
    responses((status = 200, description = "The annotation as it is now", body = AnnotationDto),
        (status = 409, description = "No map has been built yet")))]
pub async fn change_annotation_of(
    SiteOf(site): SiteOf,
    IdOf(id): IdOf,
    Params(params): Params<VersionParams>,
    Body(body): Body<NewAnnotationDto>,
) -> Result<Json<AnnotationDto>, ApiError> {
    let map = site.map(params.version).await?;
    change_annotation(&site, &map, id, body.check()?).await?;
    Ok(Json(an_annotation(&map, id).await?.into()))
}

/// Forget an annotation.
#[utoipa::path(delete, path = "/v1/sites/{site}/annotations/{id}", operation_id = "delete_annotation", tag = "maps",
    responses((status = 204, description = "It is gone")))]
pub async fn delete_annotation_of(SiteOf(site): SiteOf, IdOf(id): IdOf) -> Result<StatusCode, ApiError> {
    delete_annotation(&site, id).await?;
    Ok(StatusCode::NO_CONTENT)
}
