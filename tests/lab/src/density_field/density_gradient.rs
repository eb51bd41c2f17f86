//! The direction in which a density field falls, where it can be trusted (thesis section 3.3.1).

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::turns::direction_in_turns;
use locution_engine::config_error::ConfigError;

/// Where a gradient is stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GradientConfig {
    /// Smallest change of density per cell that has a direction.
    pub min_slope_per_cell: f64,
    /// Largest turn of the gradient from a cell to any of its eight neighbours, radians.
    pub max_turn_rad: f64,
}

impl Default for GradientConfig {
    fn default() -> Self {
        Self { min_slope_per_cell: 0.002, max_turn_rad: 0.35 }
    }
}

impl GradientConfig {
    /// Checks every value; `path` leads to this struct in the whole configuration.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.min_slope_per_cell >= 0.0 && self.min_slope_per_cell.is_finite()) {
            return Err(ConfigError::new(
                format!("{path}.min_slope_per_cell"),
                "must be finite and not negative",
            ));
        }
        if !(0.0..=std::f64::consts::PI).contains(&self.max_turn_rad) {
            return Err(ConfigError::new(format!("{path}.max_turn_rad"), "must lie in 0..=π"));
        }
        Ok(())
    }
}

/// Direction of steepest descent per cell, in [−½, ½] turns, NaN where it is not stable.
///
/// `densities` are rows of `width` cells, NaN where there is no density. The Sobel operator needs the eight
/// neighbours, and stability the gradients of those, so a direction exists only where 5 × 5 cells have a density.
pub(super) fn stable_descent(densities: &[f32], width: usize, config: &GradientConfig) -> Vec<f32> {
    let slopes = Slopes::of(densities, width);
    let mut descents = vec![f32::NAN; densities.len()];
    let height = densities.len() / width;
    if width < 3 || height < 3 {
        return descents;
    }
    let (min_steepness, min_cosine) = (config.min_slope_per_cell as f32, config.max_turn_rad.cos() as f32);
    descents[width..(height - 1) * width].par_chunks_exact_mut(width).enumerate().for_each(
        |(row_below, descents)| {
            let row = DescentRow { slopes: &slopes, row_below, min_steepness, min_cosine, descents };
            Arch::new().dispatch(row);
        },
    );
    descents
}

/// The directions of one row.
struct DescentRow<'a> {
    slopes: &'a Slopes,
    row_below: usize,
    min_steepness: f32,
    min_cosine: f32,
    descents: &'a mut [f32],
}

impl WithSimd for DescentRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { slopes, row_below, min_steepness, min_cosine, descents } = self;
        let (width, count) = (descents.len(), descents.len() - 2);
        // The inner cells of the row, seen from one to the lower left of them.
        let cells = |plane: &'_ [f32], up: usize, right: usize| (row_below + up) * width + right..plane.len();
        let near = |plane, up, right| &plane[cells(plane, up, right)][..count];
        let (x, y) = (near(&slopes.uphill_x, 1, 1), near(&slopes.uphill_y, 1, 1));
        let descents = &mut descents[1..][..count];
        let steepness = near(&slopes.steepness, 1, 1);
        for (descent, ((x, y), steepness)) in descents.iter_mut().zip(x.iter().zip(y).zip(steepness)) {
            *descent = if *steepness > min_steepness { direction_in_turns(-x, -y) } else { f32::NAN };
        }
        for (up, right) in [(0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)] {
            let others = near(&slopes.uphill_x, up, right).iter().zip(near(&slopes.uphill_y, up, right));
            for (descent, ((x, y), (other_x, other_y))) in
                descents.iter_mut().zip(x.iter().zip(y).zip(others))
            {
                // A gradient that does not exist agrees with none.
                *descent = if x * other_x + y * other_y >= min_cosine { *descent } else { f32::NAN };
            }
        }
    }
}

/// Gradients of all cells: their directions as unit vectors and their lengths per cell; NaN where a neighbour has no
/// density and at the map's edge.
struct Slopes {
    uphill_x: Vec<f32>,
    uphill_y: Vec<f32>,
    steepness: Vec<f32>,
}

impl Slopes {
    /// The Sobel gradient of footnote 3 in section 3.3.1, rows growing upwards; row by row, so that several cells are
    /// computed at once.
    fn of(densities: &[f32], width: usize) -> Self {
        let unknown = || vec![f32::NAN; densities.len()];
        let mut slopes = Self { uphill_x: unknown(), uphill_y: unknown(), steepness: unknown() };
        let height = densities.len() / width;
        if width < 3 || height < 3 {
            return slopes;
        }
        let inner = width..(height - 1) * width;
        slopes.uphill_x[inner.clone()]
            .par_chunks_exact_mut(width)
            .zip(slopes.uphill_y[inner.clone()].par_chunks_exact_mut(width))
            .zip(slopes.steepness[inner].par_chunks_exact_mut(width))
            .zip(densities.par_windows(3 * width).step_by(width))
            .for_each(|(((x, y), steepness), rows)| {
                let (below, rest) = rows.split_at(width);
                sobel_row([below, &rest[..width], &rest[width..]], x, y, steepness);
            });
        slopes
    }
}

/// Gradients of the inner cells of a row from the row below, itself and the row above.
fn sobel_row([below, own, above]: [&[f32]; 3], x: &mut [f32], y: &mut [f32], steepness: &mut [f32]) {
    let count = own.len() - 2;
    // Slices of one length, so that the compiler sees that no index leaves them.
    let (bl, b, br) = (&below[..count], &below[1..][..count], &below[2..][..count]);
    let (l, r) = (&own[..count], &own[2..][..count]);
    let (tl, t, tr) = (&above[..count], &above[1..][..count], &above[2..][..count]);
    let (x, y, steepness) = (&mut x[1..][..count], &mut y[1..][..count], &mut steepness[1..][..count]);
    for (cell, ((x, y), steepness)) in x.iter_mut().zip(y).zip(steepness).enumerate() {
        let gx = (tr[cell] + 2.0 * r[cell] + br[cell] - tl[cell] - 2.0 * l[cell] - bl[cell]) / 8.0;
        let gy = (tl[cell] + 2.0 * t[cell] + tr[cell] - bl[cell] - 2.0 * b[cell] - br[cell]) / 8.0;
        let length = (gx * gx + gy * gy).sqrt();
        (*x, *y, *steepness) = (gx / length, gy / length, length);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn field(width: usize, height: usize, density: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        (0..width * height).map(|cell| density((cell % width) as f32, (cell / width) as f32)).collect()
    }

    #[test]
    fn a_slope_falls_where_it_falls() {
        let descents =
            stable_descent(&field(7, 6, |x, y| 0.5 - 0.01 * x + 0.02 * y), 7, &GradientConfig::default());
        let expected = (-0.02f32).atan2(0.01) / std::f32::consts::TAU;
        for row in 2..4 {
            for column in 2..5 {
                let found = descents[row * 7 + column];
                assert!((found - expected).abs() < 1e-4, "{found} is not {expected}");
            }
        }
        assert!(descents[7 + 1].is_nan(), "the gradient of its neighbours at the edge is unknown");
    }

    #[test]
    fn a_summit_and_a_plain_have_no_direction() {
        let summit = field(9, 9, |x, y| 1.0 - 0.01 * (x - 4.0).hypot(y - 4.0));
        assert!(stable_descent(&summit, 9, &GradientConfig::default())[4 * 9 + 4].is_nan());
        let plain = field(9, 9, |_, _| 0.7);
        assert!(stable_descent(&plain, 9, &GradientConfig::default())[4 * 9 + 4].is_nan());
    }

    #[test]
    fn a_wall_nearby_takes_the_direction_away() {
        let mut slope = field(9, 9, |x, _| 0.1 * x);
        slope[2 * 9 + 4] = f32::NAN;
        let descents = stable_descent(&slope, 9, &GradientConfig::default());
        assert!(descents[4 * 9 + 4].is_nan());
        assert!(descents[5 * 9 + 4].is_finite());
    }

    /// One cell after the other, as the thesis tells it.
    fn descent_at(densities: &[f32], width: usize, cell: usize, config: &GradientConfig) -> Option<f32> {
        let (column, row) = (cell % width, cell / width);
        if !(2..width - 2).contains(&column) || !(2..densities.len() / width - 2).contains(&row) {
            return None;
        }
        let gradient = |cell: usize| {
            let at = |dx: usize, dy: usize| densities[cell + dx + dy * width - 1 - width];
            let gx = (at(2, 2) + 2.0 * at(2, 1) + at(2, 0) - at(0, 2) - 2.0 * at(0, 1) - at(0, 0)) / 8.0;
            let gy = (at(0, 2) + 2.0 * at(1, 2) + at(2, 2) - at(0, 0) - 2.0 * at(1, 0) - at(2, 0)) / 8.0;
            (gx, gy)
        };
        let (gx, gy) = gradient(cell);
        let turns_little = |other: usize| {
            let (other_x, other_y) = gradient(other);
            let cosine = (gx * other_x + gy * other_y) / (gx.hypot(gy) * other_x.hypot(other_y));
            f64::from(cosine) >= config.max_turn_rad.cos()
        };
        let (below, above) = (cell - width, cell + width);
        let around = [below - 1, below, below + 1, cell - 1, cell + 1, above - 1, above, above + 1];
        let is_stable =
            f64::from(gx.hypot(gy)) > config.min_slope_per_cell && around.into_iter().all(turns_little);
        is_stable.then(|| (-gy).atan2(-gx) / std::f32::consts::TAU)
    }

    #[test]
    fn rows_agree_with_one_cell_after_the_other() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let config = GradientConfig { max_turn_rad: 0.8, ..GradientConfig::default() };
        let (mut num_stable, mut num_unstable) = (0, 0);
        for (width, height) in [(5, 5), (9, 31), (40, 23), (2, 9), (9, 2)] {
            let (rise_x, rise_y) = (rng.random_range(-0.02..0.02), rng.random_range(-0.02..0.02));
            let mut densities = field(width, height, |x, y| {
                0.5 + rise_x * x + rise_y * y + 0.05 * (0.3 * x).sin() * (0.4 * y).cos()
            });
            for _ in 0..densities.len() / 100 {
                let hole = rng.random_range(0..densities.len());
                densities[hole] = f32::NAN;
            }
            let descents = stable_descent(&densities, width, &config);
            for (cell, found) in descents.into_iter().enumerate().filter(|_| width > 4 && height > 4) {
                match descent_at(&densities, width, cell, &config) {
                    Some(expected) => {
                        let off = (found - expected).rem_euclid(1.0);
                        assert!(off.min(1.0 - off) < 1e-4, "{found} is not {expected}");
                        num_stable += 1;
                    }
                    None => {
                        assert!(found.is_nan());
                        num_unstable += 1;
                    }
                }
            }
        }
        assert!(num_stable > 100 && num_unstable > 100, "{num_stable} and {num_unstable}");
    }
}
