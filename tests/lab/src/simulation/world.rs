//! The building: which cells are free floor, and how far each is from the nearest obstacle.

use thiserror::Error;

use locution_engine::formats::{GrayImage, MapServerYaml};
use locution_engine::geometry::{Point2, Pose2, distance_to_blocked};

/// A picture that cannot be a world.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WorldError {
    /// Width times height is not the number of cells.
    #[error("{given} cells do not fill {width} × {height}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Cells given.
        given: usize,
    },
    /// There is nowhere to drive.
    #[error("the world has no free cell")]
    NoFreeCell,
    /// The edge of a cell is not a positive number of metres.
    #[error("the resolution is not a positive number of metres")]
    Resolution,
    /// The picture's frame is turned, which rays and plans here do not expect.
    #[error("worlds with a turned origin are not supported")]
    TurnedOrigin,
}

/// An occupancy world. Whatever is not free blocks rays and robots.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    width: usize,
    height: usize,
    resolution_m: f64,
    /// Lower left corner of the grid in the world's frame.
    origin: Point2,
    is_free: Vec<bool>,
    /// Metres from the centre of each cell to the centre of the nearest cell that is not free.
    clearance_m: Vec<f32>,
}

impl World {
    /// A world from cells listed row by row from the bottom (south) row, west to east.
    ///
    /// # Errors
    /// A size that does not fit, a resolution that is not positive, no free cell.
    pub fn new(
        width: usize,
        height: usize,
        resolution_m: f64,
        origin: Point2,
        is_free: Vec<bool>,
    ) -> Result<Self, WorldError> {
        if width.checked_mul(height) != Some(is_free.len()) {
            return Err(WorldError::Size { width, height, given: is_free.len() });
        }
        if !(resolution_m > 0.0 && resolution_m.is_finite()) {
            return Err(WorldError::Resolution);
        }
        if !is_free.contains(&true) {
            return Err(WorldError::NoFreeCell);
        }
        let clearance_m = distance_to_blocked(width, height, &is_free)
            .into_iter()
            .map(|cells| (f64::from(cells) * resolution_m) as f32)
            .collect();
        Ok(Self { width, height, resolution_m, origin, is_free, clearance_m })
    }

    /// A world from a map_server picture: free where the YAML's threshold says so, blocked elsewhere, the unknown
    /// included.
    ///
    /// # Errors
    /// As [`World::new`]; an origin with a heading.
    pub fn from_map_server(image: &GrayImage, yaml: &MapServerYaml) -> Result<Self, WorldError> {
        if yaml.map_from_image.theta != 0.0 {
            return Err(WorldError::TurnedOrigin);
        }
        let rows_from_bottom = image.pixels.chunks_exact(image.width.max(1)).rev();
        let is_free =
            rows_from_bottom.flatten().map(|&pixel| yaml.occupancy(pixel) < yaml.free_threshold).collect();
        Self::new(image.width, image.height, yaml.resolution_m, yaml.map_from_image.position(), is_free)
    }

    /// Columns and rows.
    pub const fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Edge of a cell in metres.
    pub const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Lower left corner of the grid.
    pub const fn origin(&self) -> Point2 {
        self.origin
    }

    /// Column and row of the cell that holds a point; may lie outside.
    pub(super) fn cell_of(&self, point: &Point2) -> (i64, i64) {
        let along = |value: f64, from: f64| ((value - from) / self.resolution_m).floor() as i64;
        (along(point.x, self.origin.x), along(point.y, self.origin.y))
    }

    fn index(&self, (column, row): (i64, i64)) -> Option<usize> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        (column < self.width && row < self.height).then(|| row * self.width + column)
    }

    pub(super) fn is_free_cell(&self, cell: (i64, i64)) -> bool {
        self.index(cell).is_some_and(|idx| self.is_free[idx])
    }

    pub(super) fn cell_clearance_m(&self, cell: (i64, i64)) -> f64 {
        self.index(cell).map_or(0.0, |idx| f64::from(self.clearance_m[idx]))
    }

    /// Whether a point lies on free floor.
    pub fn is_free(&self, point: &Point2) -> bool {
        self.is_free_cell(self.cell_of(point))
    }

    /// Distance in metres to the nearest obstacle, to about one cell; 0 outside.
    pub fn clearance_m(&self, point: &Point2) -> f64 {
        self.cell_clearance_m(self.cell_of(point))
    }

    /// Whether a robot at this pose stands on free floor.
    pub fn holds(&self, pose: &Pose2) -> bool {
        self.is_free(&pose.position())
    }
}

#[cfg(test)]
impl World {
    /// A world of 0.1 m cells drawn with one character per 0.5 m: `#` wall, anything else floor; origin (0, 0).
    pub(super) fn drawn(picture: &str) -> Self {
        let rows: Vec<&str> = picture.lines().map(str::trim).filter(|row| !row.is_empty()).collect();
        let width = rows[0].len() * 5;
        let cells = rows.iter().rev().flat_map(|row| {
            let line: Vec<bool> = row.bytes().flat_map(|byte| [byte != b'#'; 5]).collect();
            std::iter::repeat_n(line, 5).flatten()
        });
        Self::new(width, rows.len() * 5, 0.1, Point2::default(), cells.collect()).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_read_from_the_top() {
        let image = GrayImage { width: 2, height: 2, pixels: vec![0, 205, 254, 254] };
        let text = "image: x\nresolution: 0.5\norigin: [-1, -2, 0]";
        let yaml = locution_engine::formats::parse_map_server_yaml(text).unwrap();
        let world = World::from_map_server(&image, &yaml).unwrap();
        assert!(world.is_free(&Point2::new(-0.9, -1.9)) && world.is_free(&Point2::new(-0.1, -1.9)));
        assert!(!world.is_free(&Point2::new(-0.9, -1.4)) && !world.is_free(&Point2::new(-0.1, -1.4)));
        assert!(!world.is_free(&Point2::new(5.0, 5.0)), "outside is blocked");
        let turned = MapServerYaml { map_from_image: Pose2::new(0.0, 0.0, 0.1), ..yaml };
        assert_eq!(World::from_map_server(&image, &turned), Err(WorldError::TurnedOrigin));
    }

    #[test]
    fn impossible_worlds_are_errors() {
        let origin = Point2::default();
        assert_eq!(World::new(1, 1, 0.1, origin, vec![false]), Err(WorldError::NoFreeCell));
        assert_eq!(World::new(1, 1, f64::NAN, origin, vec![true]), Err(WorldError::Resolution));
        assert!(matches!(World::new(2, 1, 0.1, origin, vec![true]), Err(WorldError::Size { .. })));
    }
}
