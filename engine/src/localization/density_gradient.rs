//! The direction in which a density field falls, where it can be trusted (thesis section 3.3.1).

use std::f32::consts::TAU;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::config::ConfigError;

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

/// Direction of steepest descent per cell, radians in (−π, π], where it is stable.
///
/// `densities` are rows of `width` cells, NaN where there is no density. The Sobel operator needs the eight
/// neighbours, and stability the gradients of those, so a direction exists only where 5 × 5 cells have a density.
pub(super) fn stable_descent(densities: &[f32], width: usize, config: &GradientConfig) -> Vec<Option<f32>> {
    let slopes = Slopes::of(densities, width);
    let height = densities.len() / width;
    let min_steepness = config.min_slope_per_cell as f32;
    let min_cosine = config.max_turn_rad.cos() as f32;
    let descent_at = |cell: usize| {
        let steepness = slopes.steepness[cell];
        if steepness <= min_steepness || steepness.is_nan() {
            return None;
        }
        let (column, row) = (cell % width, cell / width);
        let is_inner = column > 0 && row > 0 && column + 1 < width && row + 1 < height;
        let (x, y) = (slopes.uphill_x[cell], slopes.uphill_y[cell]);
        let is_stable = is_inner
            && neighbours(cell, width)
                .iter()
                .all(|&other| x * slopes.uphill_x[other] + y * slopes.uphill_y[other] >= min_cosine);
        is_stable.then(|| descent(x, y))
    };
    (0..densities.len()).into_par_iter().map(descent_at).collect()
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

/// The eight neighbours of an inner cell, lower row first, left to right.
const fn neighbours(cell: usize, width: usize) -> [usize; 8] {
    let (below, above) = (cell - width, cell + width);
    [below - 1, below, below + 1, cell - 1, cell + 1, above - 1, above, above + 1]
}

fn descent(gx: f32, gy: f32) -> f32 {
    let angle = (-gy).atan2(-gx);
    if angle <= -TAU / 2.0 { angle + TAU } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(width: usize, height: usize, density: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        (0..width * height).map(|cell| density((cell % width) as f32, (cell / width) as f32)).collect()
    }

    #[test]
    fn a_slope_falls_where_it_falls() {
        let descents =
            stable_descent(&field(7, 6, |x, y| 0.5 - 0.01 * x + 0.02 * y), 7, &GradientConfig::default());
        let expected = (-0.02f32).atan2(0.01);
        for row in 2..4 {
            for column in 2..5 {
                let found = descents[row * 7 + column].expect("the slope is even");
                assert!((found - expected).abs() < 1e-4, "{found} is not {expected}");
            }
        }
        assert_eq!(descents[7 + 1], None, "the gradient of its neighbours at the edge is unknown");
    }

    #[test]
    fn a_summit_and_a_plain_have_no_direction() {
        let summit = field(9, 9, |x, y| 1.0 - 0.01 * (x - 4.0).hypot(y - 4.0));
        assert_eq!(stable_descent(&summit, 9, &GradientConfig::default())[4 * 9 + 4], None);
        let plain = field(9, 9, |_, _| 0.7);
        assert_eq!(stable_descent(&plain, 9, &GradientConfig::default())[4 * 9 + 4], None);
    }

    #[test]
    fn a_wall_nearby_takes_the_direction_away() {
        let mut slope = field(9, 9, |x, _| 0.1 * x);
        slope[2 * 9 + 4] = f32::NAN;
        let descents = stable_descent(&slope, 9, &GradientConfig::default());
        assert_eq!(descents[4 * 9 + 4], None);
        assert!(descents[5 * 9 + 4].is_some());
    }
}
