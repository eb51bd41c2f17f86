//! The precomputed density fields of a map: what a particle is weighed by (thesis section 3.3.1).
//!
//! Every free cell holds, per kernel, its hard free-space density and the direction in which the density falls, two
//! bytes together. Cells live in tiles of 8 × 8 that exist only where something is free, and the kernels of a cell lie
//! side by side, so that weighing a particle touches two places of memory:
//!
//! ```text
//!   tiles: one u32 per 64 cells ──► codes: [kernel 0: density, direction][kernel 1: …]… of 64 cells
//! ```

use std::f64::consts::TAU;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::arc_planes::margin;
use super::bit_window::BitPlanes;
use super::connected_disc::{DiscSweep, Fill};
use super::density_gradient::{GradientConfig, stable_descent};
use super::kernel_rows::KernelRows;
use crate::turns::floor_to_u32;
use locution_engine::config_error::ConfigError;
use locution_engine::density::KernelProfile;
use locution_engine::geometry::{Point2, Pose2, wrap_angle};
use locution_engine::occupancy::{CellState, GridMap};

/// Density code of a cell that is not free.
pub(crate) const NOT_FREE: u8 = 255;
/// Density code of a free cell whose flood met an opening of unknown cells.
pub(crate) const UNDEFINED: u8 = 254;
/// Density code of density 1.
pub(crate) const FULL: f32 = 253.0;
/// Set in a direction code when the gradient is stable; the other seven bits are the direction in 1/128 turns.
pub(crate) const STABLE: u8 = 0x80;
/// Most kernels a field can hold.
pub const MAX_KERNELS: usize = 4;

/// Code of a cell that is not free.
pub(crate) const EMPTY: u16 = u16::from_le_bytes([NOT_FREE, 0]);

const TILE_SIDE: usize = 8;
/// The first tile is empty and stands for all squares without a free cell.
const NO_TILE: u32 = 0;

/// How density fields are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensityFieldConfig {
    /// Shape of the kernels.
    pub profile: KernelProfile,
    /// Bandwidth of each kernel, metres; one to four (thesis 3.3.2.2: 15, 30 and 50 cells of 0.1 m).
    pub bandwidths_m: Vec<f64>,
    /// Reached cells that border on unknown ones and hang together are an opening, and the density is not hard, when
    /// they are more than this share of the kernel's perimeter; 0 is literal.
    pub unknown_tolerance: f64,
    /// Where the gradient counts.
    pub gradient: GradientConfig,
}

impl Default for DensityFieldConfig {
    fn default() -> Self {
        Self {
            profile: KernelProfile::Uniform,
            bandwidths_m: vec![1.5, 3.0, 5.0],
            unknown_tolerance: 0.05,
            gradient: GradientConfig::default(),
        }
    }
}

impl DensityFieldConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        let kernels = &self.bandwidths_m;
        if kernels.is_empty()
            || kernels.len() > MAX_KERNELS
            || !kernels.iter().all(|h| *h > 0.0 && *h <= 10.0)
        {
            let problem = "one to four bandwidths above 0 and up to 10 m are needed";
            return Err(ConfigError::new(format!("{path}.bandwidths_m"), problem));
        }
        if !(0.0..=1.0).contains(&self.unknown_tolerance) {
            return Err(ConfigError::new(format!("{path}.unknown_tolerance"), "must lie in 0..=1"));
        }
        self.gradient.validate(&format!("{path}.gradient"))
    }
}

/// Density and falling direction at one place, for one kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KernelReading {
    /// Hard density in [0, 1]; None where the flood met too much unknown.
    pub density: Option<f32>,
    /// Direction in which the density falls fastest, radians, where it is stable.
    pub descent_rad: Option<f32>,
}

/// Density fields of all kernels over one map.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityField {
    width: usize,
    height: usize,
    resolution_m: f64,
    origin: Point2,
    num_kernels: usize,
    /// Kernels per cell in `codes`: 1, 2 or 4.
    stride: usize,
    tiles_per_row: usize,
    tiles: Vec<u32>,
    codes: Vec<u16>,
}

impl DensityField {
    /// Computes the fields of a map. Cost: about a microsecond per free cell for the three kernels of the thesis;
    /// rows of blocks are shared among threads and collected in order.
    pub fn build(map: &GridMap, config: &DensityFieldConfig) -> Self {
        let layers: Vec<Vec<u16>> =
            config.bandwidths_m.iter().map(|&bandwidth_m| kernel_codes(map, config, bandwidth_m)).collect();
        Self::pack(map, &layers)
    }

    /// Lays the codes of all cells out in tiles.
    fn pack(map: &GridMap, layers: &[Vec<u16>]) -> Self {
        let (width, height) = (map.width(), map.height());
        let tiles_per_row = width.div_ceil(TILE_SIDE);
        let stride = layers.len().next_power_of_two();
        let mut field = Self {
            width,
            height,
            resolution_m: map.resolution_m(),
            origin: map.origin(),
            num_kernels: layers.len(),
            stride,
            tiles_per_row,
            // One more square than the map has stands for everywhere else.
            tiles: vec![NO_TILE; tiles_per_row * height.div_ceil(TILE_SIDE) + 1],
            codes: vec![EMPTY; TILE_SIDE * TILE_SIDE * stride],
        };
        for (cell, state) in map.cells().iter().enumerate() {
            if *state != CellState::Free {
                continue;
            }
            let (column, row) = (cell % width, cell / width);
            let start = field.tile_for(column, row) + place_in_tile(column, row) * stride;
            for (kernel, layer) in layers.iter().enumerate() {
                field.codes[start + kernel] = layer[cell];
            }
        }
        field
    }

    /// First code of the tile that holds a cell; made when missing.
    fn tile_for(&mut self, column: usize, row: usize) -> usize {
        let tile_len = TILE_SIDE * TILE_SIDE * self.stride;
        let slot = &mut self.tiles[row / TILE_SIDE * self.tiles_per_row + column / TILE_SIDE];
        if *slot == NO_TILE {
            *slot = (self.codes.len() / tile_len) as u32;
            self.codes.resize(self.codes.len() + tile_len, EMPTY);
        }
        *slot as usize * tile_len
    }

    /// Columns of the map.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows of the map.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Edge of a cell in metres.
    pub const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Lower left corner of the map, metres.
    pub const fn origin(&self) -> Point2 {
        self.origin
    }

    /// Kernels per cell.
    pub const fn num_kernels(&self) -> usize {
        self.num_kernels
    }

    /// Bytes held, all kernels together.
    pub fn num_bytes(&self) -> usize {
        self.tiles.len() * size_of::<u32>() + self.codes.len() * size_of::<u16>()
    }

    /// What a kernel says at a cell; None where the cell is not free, lies outside or the kernel does not exist.
    pub fn reading(&self, column: i64, row: i64, kernel: usize) -> Option<KernelReading> {
        let is_inside = column >= 0 && row >= 0 && column < self.width as i64 && row < self.height as i64;
        if !is_inside || kernel >= self.num_kernels {
            return None;
        }
        let (column, row) = (column as usize, row as usize);
        let square = row / TILE_SIDE * self.tiles_per_row + column / TILE_SIDE;
        decode(self.codes[self.start(square, place_in_tile(column, row)) + kernel])
    }

    /// First code of a cell, by its square and its place there.
    #[inline(always)]
    fn start(&self, square: usize, place: usize) -> usize {
        (self.tiles[square] as usize * TILE_SIDE * TILE_SIDE + place) * self.stride
    }

    /// Where the codes of the cells at some positions begin, in metres from the lower left corner; outside the map
    /// that is an empty cell. Without branches, as particles are anywhere.
    #[inline(always)]
    pub(crate) fn starts<const L: usize>(&self, x_m: &[f32; L], y_m: &[f32; L]) -> [usize; L] {
        const SIDE: u32 = TILE_SIDE as u32;
        let scale = (1.0 / self.resolution_m) as f32;
        let (width, height) = (self.width as f32, self.height as f32);
        let (outside, tiles_per_row) = ((self.tiles.len() - 1) as u32, self.tiles_per_row as u32);
        let mut squares = [0u32; L];
        let mut places = [0u32; L];
        for (((square, place), x_m), y_m) in squares.iter_mut().zip(&mut places).zip(x_m).zip(y_m) {
            let (x, y) = (x_m * scale, y_m * scale);
            let is_inside = (x >= 0.0) & (y >= 0.0) & (x < width) & (y < height);
            let (column, row) = (floor_to_u32(x), floor_to_u32(y));
            let (across, up) = (column / SIDE, row / SIDE);
            *square = if is_inside { up.wrapping_mul(tiles_per_row).wrapping_add(across) } else { outside };
            *place = row % SIDE * SIDE + column % SIDE;
        }
        std::array::from_fn(|lane| self.start(squares[lane] as usize, places[lane] as usize))
    }

    /// The codes of a cell, from where they begin.
    #[inline(always)]
    pub(crate) fn codes_from<const STRIDE: usize>(&self, start: usize) -> [u16; STRIDE] {
        let codes = &self.codes[start..start + STRIDE];
        std::array::from_fn(|kernel| codes[kernel])
    }

    /// Kernels laid out per cell: 1, 2 or 4.
    pub(crate) const fn stride(&self) -> usize {
        self.stride
    }
}

#[inline]
const fn place_in_tile(column: usize, row: usize) -> usize {
    row % TILE_SIDE * TILE_SIDE + column % TILE_SIDE
}

/// The code of a density and of the direction in which it falls, in turns; NaN stands for none.
#[inline]
fn encode(density: f32, descent_turns: f32) -> u16 {
    let density = if density.is_nan() { UNDEFINED } else { floor_to_u32(density * FULL + 0.5) as u8 };
    let direction = if descent_turns.is_nan() { 0 } else { STABLE | direction_code(descent_turns) };
    u16::from_le_bytes([density, direction])
}

fn decode(code: u16) -> Option<KernelReading> {
    let [density, direction] = code.to_le_bytes();
    let turns = f64::from(direction & !STABLE) / 128.0;
    (density != NOT_FREE).then(|| KernelReading {
        density: (density != UNDEFINED).then(|| f32::from(density) / FULL),
        descent_rad: (direction & STABLE != 0).then(|| wrap_angle(turns * TAU) as f32),
    })
}

/// A direction within [−½, ½] turns in 1/128 turns.
#[inline]
pub(crate) fn direction_code(turns: f32) -> u8 {
    floor_to_u32(turns * 128.0 + 128.5) as u8 & !STABLE
}

/// Codes of every cell for one kernel.
fn kernel_codes(map: &GridMap, config: &DensityFieldConfig, bandwidth_m: f64) -> Vec<u16> {
    let densities = hard_densities(map, config, bandwidth_m / map.resolution_m());
    let descents = stable_descent(&densities, map.width(), &config.gradient);
    let code = |(&density, descent_turns): (&f32, f32)| encode(density, descent_turns);
    densities.par_iter().zip(descents).map(code).collect()
}

/// Hard density of every cell for one kernel, NaN where it is undefined or the cell is not free.
fn hard_densities(map: &GridMap, config: &DensityFieldConfig, bandwidth_cells: f64) -> Vec<f32> {
    let kernel = KernelRows::new(config.profile, bandwidth_cells);
    let planes = BitPlanes::new(map, margin(&kernel));
    let most_open = config.most_open(bandwidth_cells);
    let width = map.width();
    let mut densities = vec![f32::NAN; width * map.height()];
    densities.par_chunks_mut(width * ROWS_PER_TASK).enumerate().for_each(|(task, rows)| {
        let first_row = (task * ROWS_PER_TASK) as i64;
        let fills = sweep((&planes, &kernel), most_open, (0, first_row), (width, rows.len() / width));
        for (density, fill) in rows.iter_mut().zip(&fills) {
            *density = hard_density(fill);
        }
    });
    densities
}

/// Rows of centres that a thread takes at a time.
const ROWS_PER_TASK: usize = 16;

/// Fills of a rectangle of centres, row by row.
fn sweep(
    disc: (&BitPlanes, &KernelRows),
    most_open: u32,
    corner: (i64, i64),
    size: (usize, usize),
) -> Vec<Option<Fill>> {
    match 2 * disc.1.radius() + 1 {
        0..=64 => sweep_by::<1>(disc, most_open, corner, size),
        65..=128 => sweep_by::<2>(disc, most_open, corner, size),
        129..=256 => sweep_by::<4>(disc, most_open, corner, size),
        _ => sweep_by::<8>(disc, most_open, corner, size),
    }
}

fn sweep_by<const W: usize>(
    (planes, kernel): (&BitPlanes, &KernelRows),
    most_open: u32,
    (column, row): (i64, i64),
    (width, height): (usize, usize),
) -> Vec<Option<Fill>> {
    let mut disc = DiscSweep::<W>::new(planes, kernel, most_open);
    let mut fills = vec![None; width * height];
    for (up, fills) in (0..).zip(fills.chunks_exact_mut(width)) {
        disc.sweep(column, row + up, fills);
    }
    fills
}

impl DensityFieldConfig {
    /// Open cells that may hang together while the density of a kernel is still hard.
    fn most_open(&self, bandwidth_cells: f64) -> u32 {
        (self.unknown_tolerance * TAU * bandwidth_cells) as u32
    }
}

/// The density of a fill when it is hard, else NaN.
fn hard_density(fill: &Option<Fill>) -> f32 {
    fill.filter(|fill| !fill.has_opening).map_or(f32::NAN, |fill| fill.density.min(1.0))
}

/// What the robot itself sees at its pose: the readings of its local map there, directions relative to its heading.
///
/// The same floods as for the map, for the 5 × 5 cells that the gradient needs. No density where the robot's cell is
/// not free.
pub fn observe(
    local_map: &GridMap,
    local_from_robot: &Pose2,
    config: &DensityFieldConfig,
) -> Vec<KernelReading> {
    let (column, row) = local_map.cell_at(&local_from_robot.position());
    let to_robot = |turns: f32| wrap_angle(f64::from(turns) * TAU - local_from_robot.theta) as f32;
    let is_inside = local_map.state(column, row) == CellState::Free;
    config
        .bandwidths_m
        .iter()
        .map(|&bandwidth_m| {
            if !is_inside {
                return KernelReading::default();
            }
            let bandwidth_cells = bandwidth_m / local_map.resolution_m();
            let densities = densities_around(local_map, config, bandwidth_cells, (column, row));
            let center = densities.len() / 2;
            let descent_turns = stable_descent(&densities, AROUND, &config.gradient)[center];
            let density = densities[center];
            KernelReading {
                density: density.is_finite().then_some(density),
                descent_rad: descent_turns.is_finite().then(|| to_robot(descent_turns)),
            }
        })
        .collect()
}

/// Cells per side that a stable gradient looks at.
const AROUND: usize = 5;

fn densities_around(
    map: &GridMap,
    config: &DensityFieldConfig,
    bandwidth_cells: f64,
    cell: (i64, i64),
) -> Vec<f32> {
    let kernel = KernelRows::new(config.profile, bandwidth_cells);
    let planes = BitPlanes::new(map, margin(&kernel));
    let half = AROUND as i64 / 2;
    let most_open = config.most_open(bandwidth_cells);
    let fills = sweep((&planes, &kernel), most_open, (cell.0 - half, cell.1 - half), (AROUND, AROUND));
    fills.iter().map(hard_density).collect()
}
