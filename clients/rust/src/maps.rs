//! The map, its forms and places, and what changed in it.

use crate::client::Client;
use crate::error::ClientError;
use crate::routes::{self, Query, Route};
use crate::types::{self, Change, Grid, Label, Map, Place, Point, Room};

/// Which version of the map, and which part of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapAt {
    /// The version; the serving one unless said.
    pub version: Option<u64>,
    /// The component; for grids the first unless said, elsewhere all.
    pub component: Option<u32>,
}

impl MapAt {
    pub(crate) fn query(&self) -> Query {
        Query::default().and("version", self.version).and("component", self.component)
    }
}

/// The map in the formats of other tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapForm {
    /// The occupancy grid as PGM, for `map_server`.
    GridPgm,
    /// The occupancy grid as PNG.
    GridPng,
    /// What `map_server` wants to know of the grid.
    GridYaml,
    /// The pose graph.
    GraphG2o,
    /// Poses of all scans of all runs of a component in the TUM format.
    TrajectoryTum,
    /// Grid and trajectories as MCAP, for Foxglove.
    Mcap,
    /// Walls, runs and matches, drawn.
    PicturePng,
    /// The same as vectors.
    PictureSvg,
    /// Rooms, doors and annotations as a GeoJSON feature collection.
    RoomsGeoJson,
}

impl MapForm {
    fn route(self) -> &'static Route {
        match self {
            Self::GridPgm => &routes::GET_GRID_PGM,
            Self::GridPng => &routes::GET_GRID_PNG,
            Self::GridYaml => &routes::GET_GRID_YAML,
            Self::GraphG2o => &routes::GET_GRAPH_G2O,
            Self::TrajectoryTum => &routes::GET_MAP_TUM,
            Self::Mcap => &routes::GET_MAP_MCAP,
            Self::PicturePng => &routes::GET_PICTURE_PNG,
            Self::PictureSvg => &routes::GET_PICTURE_SVG,
            Self::RoomsGeoJson => &routes::GET_ROOMS_GEOJSON,
        }
    }
}

impl Client {
    /// Regions, connections, components and trajectories of the map.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn map(&self, site: &str, at: MapAt) -> Result<Map, ClientError> {
        self.get(&routes::GET_MAP, &[site], &at.query()).await
    }

    /// The occupancy grid of a component.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn grid(&self, site: &str, at: MapAt) -> Result<Grid, ClientError> {
        self.get(&routes::GET_GRID, &[site], &at.query()).await
    }

    /// The map in another tool's format.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn map_as(&self, site: &str, form: MapForm, at: MapAt) -> Result<Vec<u8>, ClientError> {
        self.bytes(form.route(), &[site], &at.query()).await
    }

    /// All labelled stretches of driving.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn labels(&self, site: &str) -> Result<Vec<Label>, ClientError> {
        self.all(&routes::LIST_LABELS, &[site], Query::default()).await
    }

    /// The places of a component, voted over all passes.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn places(&self, site: &str, at: MapAt) -> Result<Vec<Place>, ClientError> {
        self.all(&routes::LIST_PLACES, &[site], at.query()).await
    }

    /// Rooms and the doors between them; of all components unless one is said.
    ///
    /// # Errors
    /// See [`ClientError`]; 409 before the first build.
    pub async fn rooms(&self, site: &str, at: MapAt) -> Result<Vec<Room>, ClientError> {
        self.all(&routes::LIST_ROOMS, &[site], at.query()).await
    }

    /// The shortest way over driven ground.
    ///
    /// # Errors
    /// See [`ClientError`]; 404 where nothing was driven.
    pub async fn route(
        &self,
        site: &str,
        from: Point,
        to: Point,
        at: MapAt,
    ) -> Result<types::Route, ClientError> {
        let query = at.query().and("from_x", Some(from.x)).and("from_y", Some(from.y));
        self.get(&routes::GET_ROUTE, &[site], &query.and("to_x", Some(to.x)).and("to_y", Some(to.y))).await
    }

    /// What changed between two sessions, each a list of runs: the latest run against all others unless said.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn changes(
        &self,
        site: &str,
        before: Option<&[&str]>,
        after: Option<&[&str]>,
    ) -> Result<Vec<Change>, ClientError> {
        let names = |runs: Option<&[&str]>| runs.map(|runs| runs.join(","));
        let query = Query::default().and("before", names(before)).and("after", names(after));
        self.all(&routes::LIST_CHANGES, &[site], query).await
    }
}
