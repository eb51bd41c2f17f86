//! Values of several resources: poses, points, directions, pages.

use locution_engine::geometry::{Point2, Pose2};
use locution_engine::mapping::Direction;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::{IntoParams, ToSchema};

use crate::app::{Area, Window};
use crate::error::ApiError;
use crate::http::wording::plain;

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

/// A position.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
pub struct PointDto {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
}

impl From<&Point2> for PointDto {
    fn from(point: &Point2) -> Self {
        Self { x: point.x, y: point.y }
    }
}

/// Which way a place was driven, compared with another pass through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum DirectionDto {
    /// The same way.
    Same,
    /// The other way round.
    Opposite,
}

impl From<Direction> for DirectionDto {
    fn from(direction: Direction) -> Self {
        match direction {
            Direction::Same => Self::Same,
            Direction::Opposite => Self::Opposite,
        }
    }
}

/// What found a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum ChannelDto {
    /// Chains of words.
    Words,
    /// Density profiles.
    Profile,
    /// Nearness in the map made so far.
    Spatial,
}

/// The choice that a word names.
///
/// # Errors
/// 422 for a word that names none.
pub fn one_of<T: DeserializeOwned>(field: &str, word: Option<&str>) -> Result<Option<T>, ApiError> {
    let named = |word: &str| T::deserialize(serde::de::value::StrDeserializer::new(word));
    word.map(named)
        .transpose()
        .map_err(|error: serde::de::value::Error| ApiError::invalid(field, plain(&error.to_string())))
}

/// The part of what was driven that a list is about; `area` is `x,y,x,y` of two opposite corners, metres.
///
/// # Errors
/// 422 for an area that is none, and for a time that ends before it begins.
pub fn window(from_ns: Option<i64>, to_ns: Option<i64>, area: Option<&str>) -> Result<Window, ApiError> {
    if let (Some(from_ns), Some(to_ns)) = (from_ns, to_ns)
        && from_ns >= to_ns
    {
        return Err(ApiError::invalid("to_ns", "a window of time ends after it begins"));
    }
    Ok(Window { from_ns, to_ns, area: area.map(parse_area).transpose()? })
}

fn parse_area(text: &str) -> Result<Area, ApiError> {
    let numbers: Vec<f64> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
    match numbers[..] {
        [x0, y0, x1, y1]
            if numbers.len() == text.split(',').count() && numbers.iter().all(|x| x.is_finite()) =>
        {
            Ok(Area { low: Point2::new(x0.min(x1), y0.min(y1)), high: Point2::new(x0.max(x1), y0.max(y1)) })
        }
        _ => Err(ApiError::invalid(
            "area",
            "four numbers with commas between: x,y,x,y of two opposite corners, metres",
        )),
    }
}

/// Which part of a list to answer.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PageParams {
    /// Most items to answer; 100 unless said.
    #[param(minimum = 1, maximum = 10_000, default = 100)]
    pub limit: Option<usize>,
    /// `next_cursor` of the page before.
    #[param(pattern = "^[0-9]+$", max_length = 20)]
    pub cursor: Option<String>,
}

impl PageParams {
    /// The bounds, checked.
    ///
    /// # Errors
    /// 422 for a limit of zero or too large, and for a cursor that no page has given.
    pub fn check(&self) -> Result<PageBounds, ApiError> {
        let limit = self.limit.unwrap_or(NUM_ITEMS_DEFAULT);
        if !(1..=NUM_ITEMS_MAX).contains(&limit) {
            return Err(ApiError::invalid("limit", format!("a page has 1 to {NUM_ITEMS_MAX} items")));
        }
        let first = match &self.cursor {
            None => 0,
            Some(cursor) => parse_cursor(cursor)
                .ok_or_else(|| ApiError::invalid("cursor", "no page has given this cursor"))?,
        };
        Ok(PageBounds { first, limit })
    }
}

/// A cursor is a number as pages write it: digits, no more than a number of 64 bits has.
fn parse_cursor(cursor: &str) -> Option<u64> {
    let is_written_by_a_page = cursor.len() <= 20 && cursor.bytes().all(|byte| byte.is_ascii_digit());
    if is_written_by_a_page { cursor.parse().ok() } else { None }
}

/// Reads a number of a query; those that nothing has are told, whether or not the answer depends on them.
pub(crate) fn in_query<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u64>, D::Error> {
    match Option::<u64>::deserialize(deserializer)? {
        Some(number) if i64::try_from(number).is_err() => {
            Err(serde::de::Error::custom("the number is too large"))
        }
        number => Ok(number),
    }
}

/// Which items a page has, checked.
#[derive(Clone, Copy, Debug)]
pub struct PageBounds {
    /// Number of the first.
    pub first: u64,
    /// Most of them.
    pub limit: usize,
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
    /// The part of a whole list that a page asks for.
    pub fn of_all(items: impl IntoIterator<Item = T>, total: usize, page: PageBounds) -> Self {
        let skipped = usize::try_from(page.first).unwrap_or(usize::MAX);
        let items = items.into_iter().skip(skipped).take(page.limit).collect();
        Self::of(items, page.first, total as u64)
    }

    /// The items from number `first` on, of a list of `total`.
    pub fn of(items: Vec<T>, first: u64, total: u64) -> Self {
        let next = first + items.len() as u64;
        Self { items, next_cursor: (next < total).then(|| next.to_string()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_is_two_corners_in_any_order() {
        let expected = Area { low: Point2::new(-1.0, 0.5), high: Point2::new(2.0, 3.0) };
        for text in ["-1,0.5,2,3", "2, 3, -1, 0.5", "-1,3,2,0.5"] {
            assert_eq!(window(None, None, Some(text)).unwrap().area, Some(expected), "{text}");
        }
        for text in ["", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1,2,3,NaN", "1,2,inf,4"] {
            assert!(window(None, None, Some(text)).is_err(), "{text}");
        }
        assert!(window(Some(5), Some(5), None).is_err());
    }
}
