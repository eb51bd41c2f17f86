//! A map of surfaces: cells that keep the first and second moments of the points that fell into them.
//!
//! The moments are whole numbers of millimetres, so adding a scan and taking it away again leaves exactly what was
//! there before, in any order: a map rebuilt from its scans equals the one that grew and shrank with them. A line is
//! fitted over the 3 × 3 cells around a query, which makes it smooth where single cells would jump.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::geometry::Point2;

/// A cell by its integer coordinates.
type Cell = (i32, i32);

/// A cell as it is looked up, by the low bits of its coordinates: surfaces that are kept together span far less than
/// the 2¹⁶ cells after which those repeat.
type CellKey = (i16, i16);

fn key(cell: Cell) -> CellKey {
    (cell.0 as i16, cell.1 as i16)
}

/// Mixes the two coordinates of a cell; fixed, so that nothing depends on the process.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_i16(i16::from(byte));
        }
    }

    fn write_i16(&mut self, value: i16) {
        self.0 =
            (self.0.rotate_left(23) ^ u64::from(value.cast_unsigned())).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
}

/// Count and moments of points relative to the centre of their cell, millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Moments {
    count: i32,
    x: i32,
    y: i32,
    xx: i32,
    xy: i32,
    yy: i32,
}

/// A straight piece of surface fitted to the points near a query.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// Mean of the points, metres.
    pub mean: Point2,
    /// Unit normal; its sign carries no meaning.
    pub normal: Point2,
    /// Variance of the points across the surface, square metres.
    pub across_m2: f64,
    /// How much the points lie along a line: 1 on a straight wall, 0 in a round heap.
    pub flatness: f64,
}

/// Surfaces of a map that does not change while they are kept: a line is fitted once, however often it is asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct FittedSurfaces {
    fits: HashMap<CellKey, Option<Surface>, BuildHasherDefault<CellHasher>>,
}

impl FittedSurfaces {
    /// [`SurfaceMap::surface_at`] of the map, remembered.
    pub fn surface_at(&mut self, map: &SurfaceMap, point: &Point2, min_count: i32) -> Option<Surface> {
        *self.fits.entry(key(map.cell_of(point))).or_insert_with(|| map.surface_at(point, min_count))
    }

    /// Forgets what was fitted, because the map has changed.
    pub fn clear(&mut self) {
        self.fits.clear();
    }
}

/// Moments of points per cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceMap {
    cell_m: f64,
    cells: HashMap<CellKey, Moments, BuildHasherDefault<CellHasher>>,
}

impl SurfaceMap {
    /// An empty map of cells with this edge length.
    pub fn new(cell_m: f64) -> Self {
        Self { cell_m, cells: HashMap::default() }
    }

    /// Bytes that the cells take, about.
    pub fn num_bytes(&self) -> usize {
        self.cells.capacity() * (size_of::<(CellKey, Moments)>() + 1)
    }

    /// Adds a point.
    pub fn insert(&mut self, point: &Point2) {
        let (cell, x, y) = self.locate(point);
        let moments = self.cells.entry(key(cell)).or_default();
        moments.count += 1;
        moments.x += x;
        moments.y += y;
        moments.xx += x * x;
        moments.xy += x * y;
        moments.yy += y * y;
    }

    /// Takes a point away that was added before.
    pub fn remove(&mut self, point: &Point2) {
        let (cell, x, y) = self.locate(point);
        if let Some(moments) = self.cells.get_mut(&key(cell)) {
            moments.count -= 1;
            moments.x -= x;
            moments.y -= y;
            moments.xx -= x * x;
            moments.xy -= x * y;
            moments.yy -= y * y;
            if moments.count == 0 {
                self.cells.remove(&key(cell));
            }
        }
    }

    /// The surface near `point`: a line through the points of the 3 × 3 cells around it, or none when fewer than
    /// `min_count` lie there.
    pub fn surface_at(&self, point: &Point2, min_count: i32) -> Option<Surface> {
        let (column, row) = self.cell_of(point);
        let step = (self.cell_m * 1000.0).round();
        let mut sum = [0.0f64; 6];
        for dy in -1..=1i32 {
            for dx in -1..=1i32 {
                let Some(m) = self.cells.get(&key((column + dx, row + dy))) else { continue };
                let n = f64::from(m.count);
                let (ox, oy) = (f64::from(dx) * step, f64::from(dy) * step);
                let (sx, sy) = (f64::from(m.x), f64::from(m.y));
                sum[0] += n;
                sum[1] += sx + n * ox;
                sum[2] += sy + n * oy;
                sum[3] += f64::from(m.xx) + 2.0 * ox * sx + n * ox * ox;
                sum[4] += f64::from(m.xy) + ox * sy + oy * sx + n * ox * oy;
                sum[5] += f64::from(m.yy) + 2.0 * oy * sy + n * oy * oy;
            }
        }
        if sum[0] < f64::from(min_count) {
            return None;
        }
        let (mx, my) = (sum[1] / sum[0], sum[2] / sum[0]);
        let cxx = sum[3] / sum[0] - mx * mx;
        let cxy = sum[4] / sum[0] - mx * my;
        let cyy = sum[5] / sum[0] - my * my;
        let half_sum = 0.5 * (cxx + cyy);
        let half_gap = (0.25 * (cxx - cyy) * (cxx - cyy) + cxy * cxy).sqrt();
        // The axis of the larger variance runs at half this angle; the normal stands across it.
        let along = 0.5 * (2.0 * cxy).atan2(cxx - cyy);
        let (sin, cos) = along.sin_cos();
        let center_x = (f64::from(column) + 0.5) * self.cell_m;
        let center_y = (f64::from(row) + 0.5) * self.cell_m;
        let (across_m2, along_m2) = ((half_sum - half_gap).max(0.0) * 1e-6, (half_sum + half_gap) * 1e-6);
        Some(Surface {
            mean: Point2::new(center_x + mx * 1e-3, center_y + my * 1e-3),
            normal: Point2::new(-sin, cos),
            across_m2,
            flatness: 1.0 - across_m2 / along_m2.max(1e-9),
        })
    }

    fn cell_of(&self, point: &Point2) -> Cell {
        ((point.x / self.cell_m).floor() as i32, (point.y / self.cell_m).floor() as i32)
    }

    fn locate(&self, point: &Point2) -> (Cell, i32, i32) {
        let cell = self.cell_of(point);
        let x = (point.x - (f64::from(cell.0) + 0.5) * self.cell_m) * 1000.0;
        let y = (point.y - (f64::from(cell.1) + 0.5) * self.cell_m) * 1000.0;
        (cell, x.round() as i32, y.round() as i32)
    }
}
