//! The building: which cells are free floor, and how far each is from the nearest obstacle.

use thiserror::Error;

use locution_engine::formats::{MapPicture, MapServerYaml};
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

    /// A world from a map_server picture: free where the YAML says so, blocked elsewhere, the unknown included.
    ///
    /// A picture whose origin is turned is laid over cells along the world's axes; walls get up to half a cell thicker.
    ///
    /// # Errors
    /// As [`World::new`].
    pub fn from_map_server(picture: &MapPicture, yaml: &MapServerYaml) -> Result<Self, WorldError> {
        let (width, height) = (picture.gray.width, picture.gray.height);
        let pixels: Vec<bool> = picture.pixels().map(|(gray, opacity)| yaml.is_free(gray, opacity)).collect();
        let is_free = pixels.chunks(width.max(1)).rev().flatten().copied().collect();
        let yaw_rad = yaml.map_from_image.theta;
        let origin = if yaw_rad == 0.0 { yaml.map_from_image.position() } else { Point2::default() };
        let world = Self::new(width, height, yaml.resolution_m, origin, is_free)?;
        if yaw_rad == 0.0 { Ok(world) } else { world.turned(&yaml.map_from_image) }
    }

    /// This world, whose own frame is `image`, in cells along the axes of `map`.
    fn turned(&self, map_from_image: &Pose2) -> Result<Self, WorldError> {
        let cell_m = self.resolution_m;
        let (extent_x, extent_y) = (self.width as f64 * cell_m, self.height as f64 * cell_m);
        let corners = [(0.0, 0.0), (extent_x, 0.0), (0.0, extent_y), (extent_x, extent_y)]
            .map(|(x, y)| map_from_image.transform_point(&Point2::new(x, y)));
        let span = |along: fn(&Point2) -> f64| {
            let low = corners.iter().map(along).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
            // Quarter turns fit exactly but for rounding.
            (low, (((high - low) / cell_m - 1e-6).ceil() as usize).max(1))
        };
        let ((west, width), (south, height)) = (span(|corner| corner.x), span(|corner| corner.y));
        let image_from_map = map_from_image.inverse();
        // Looking at the quarters of a cell keeps walls of one cell closed at any angle.
        let samples = [(0.5, 0.5), (0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let is_free_at = |cell: usize| {
            let (column, row) = ((cell % width) as f64, (cell / width) as f64);
            samples.iter().all(|(across, up)| {
                let point = Point2::new(west + (column + across) * cell_m, south + (row + up) * cell_m);
                self.is_free(&image_from_map.transform_point(&point))
            })
        };
        let is_free = (0..width * height).map(is_free_at).collect();
        Self::new(width, height, cell_m, Point2::new(west, south), is_free)
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
    use locution_engine::formats::GrayImage;

    #[test]
    fn pictures_are_read_from_the_top() {
        let image = GrayImage { width: 2, height: 2, pixels: vec![0, 205, 254, 254] }.into();
        let text = "image: x\nresolution: 0.5\norigin: [-1, -2, 0]";
        let yaml = locution_engine::formats::parse_map_server_yaml(text).unwrap();
        let world = World::from_map_server(&image, &yaml).unwrap();
        assert!(world.is_free(&Point2::new(-0.9, -1.9)) && world.is_free(&Point2::new(-0.1, -1.9)));
        assert!(!world.is_free(&Point2::new(-0.9, -1.4)) && !world.is_free(&Point2::new(-0.1, -1.4)));
        assert!(!world.is_free(&Point2::new(5.0, 5.0)), "outside is blocked");
    }

    #[test]
    fn a_turned_origin_turns_the_world() {
        // A room of 4 m by 2 m in walls of one cell, with free floor around it.
        let (width, height) = (62, 42);
        let is_wall = |cell: usize| {
            let (column, row) = (cell % width, cell / width);
            let is_within = (10..=51).contains(&column) && (10..=31).contains(&row);
            is_within && (column == 10 || column == 51 || row == 10 || row == 31)
        };
        let pixels = (0..width * height).map(|cell| if is_wall(cell) { 0 } else { 254 }).collect();
        let picture = GrayImage { width, height, pixels }.into();
        let with_yaw = |yaw: f64| {
            let text = format!("image: x\nresolution: 0.1\norigin: [3, -2, {yaw}]");
            let yaml = locution_engine::formats::parse_map_server_yaml(&text).unwrap();
            World::from_map_server(&picture, &yaml).unwrap()
        };
        assert_eq!(with_yaw(std::f64::consts::FRAC_PI_2).size(), (height, width));
        for yaw in [0.0, 0.3, 0.785, std::f64::consts::FRAC_PI_2, -2.0] {
            let world = with_yaw(yaw);
            let map_from_image = Pose2::new(3.0, -2.0, yaw);
            for (x, y, is_free) in [
                (1.3, 1.3, true),
                (3.1, 2.1, true),
                (4.9, 2.9, true),
                (0.5, 2.0, true),
                (3.0, 3.6, true),
                (6.5, 1.0, false),
                (-0.2, 1.0, false),
            ] {
                let point = map_from_image.transform_point(&Point2::new(x, y));
                assert_eq!(world.is_free(&point), is_free, "{yaw}: {x}, {y}");
            }
            for step in 0..360 {
                let heading = f64::from(step).to_radians();
                let along = |k: i32| {
                    let length_m = 0.01 * f64::from(k);
                    Point2::new(3.1 + length_m * heading.cos(), 2.1 + length_m * heading.sin())
                };
                let hit = (0..600)
                    .map(along)
                    .find(|point| !world.is_free(&map_from_image.transform_point(point)))
                    .unwrap();
                let beyond_walls_m = ((hit.x - 3.1).abs() - 2.1).max((hit.y - 2.1).abs() - 1.1);
                assert!(beyond_walls_m < 0.05, "{yaw}: a ray of {step} degrees leaves the room at {hit:?}");
            }
        }
    }

    #[test]
    fn impossible_worlds_are_errors() {
        let origin = Point2::default();
        assert_eq!(World::new(1, 1, 0.1, origin, vec![false]), Err(WorldError::NoFreeCell));
        assert_eq!(World::new(1, 1, f64::NAN, origin, vec![true]), Err(WorldError::Resolution));
        assert!(matches!(World::new(2, 1, 0.1, origin, vec![true]), Err(WorldError::Size { .. })));
    }
}
