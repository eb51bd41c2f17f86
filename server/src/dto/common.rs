//! Poses, pages and covariances.

use locution_engine::geometry::Pose2;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::error::ApiError;

/// Most items on one page.
const NUM_ITEMS_MAX: usize = 10_000;
const NUM_ITEMS_DEFAULT: usize = 100;

/// A pose in the plane, equally a rigid transform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseDto {
    /// Metres.
    #[schema(example = 1.25)]
    pub x: f64,
    /// Metres.
    #[schema(example = -0.4)]
    pub y: f64,
    /// Heading in radians, counter-clockwise.
    #[schema(example = 1.5708)]
    pub theta: f64,
}

impl From<Pose2> for PoseDto {
    fn from(pose: Pose2) -> Self {
        Self { x: pose.x, y: pose.y, theta: pose.theta }
    }
}

impl PoseDto {
    /// The engine's pose, when all numbers are finite and metres are not astronomic.
    ///
    /// # Errors
    /// The name of the number that is not, and what is wrong with it.
    pub fn check(&self) -> Result<Pose2, (&'static str, String)> {
        const FARTHEST_M: f64 = 1e7;
        for (name, value, limit) in
            [("x", self.x, FARTHEST_M), ("y", self.y, FARTHEST_M), ("theta", self.theta, 1e6)]
        {
            if !value.is_finite() {
                return Err((name, format!("{name} is {value}, it must be a number")));
            }
            if value.abs() > limit {
                return Err((name, format!("{name} is {value}, it must lie within ±{limit:e}")));
            }
        }
        Ok(Pose2::new(self.x, self.y, self.theta))
    }
}

/// Which part of a list to answer.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PageParams {
    /// Most items to answer; 100 unless said, at most 10000.
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    pub cursor: Option<String>,
}

impl PageParams {
    /// Number of items, within bounds.
    ///
    /// # Errors
    /// 422 for a limit of zero or too large.
    pub fn limit(&self) -> Result<usize, ApiError> {
        match self.limit.unwrap_or(NUM_ITEMS_DEFAULT) {
            limit @ 1..=NUM_ITEMS_MAX => Ok(limit),
            _ => Err(ApiError::invalid("limit", format!("a page has 1 to {NUM_ITEMS_MAX} items"))),
        }
    }

    /// Number of the first item.
    ///
    /// # Errors
    /// 422 for a cursor that no page has given.
    pub fn first(&self) -> Result<u64, ApiError> {
        let Some(cursor) = &self.cursor else { return Ok(0) };
        cursor.parse().map_err(|_| ApiError::invalid("cursor", "no page has given this cursor"))
    }
}

/// Part of a list.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct Page<T> {
    /// In order.
    pub items: Vec<T>,
    /// Where the next page begins; null at the end.
    pub next_cursor: Option<String>,
}

impl<T> Page<T> {
    /// The items from number `first` on, of a list of `total`.
    pub fn of(items: Vec<T>, first: u64, total: u64) -> Self {
        let next = first + items.len() as u64;
        Self { items, next_cursor: (next < total).then(|| next.to_string()) }
    }
}
