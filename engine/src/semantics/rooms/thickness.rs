//! The largest free disc that covers a cell.

use super::floor::Floor;

/// A cell whose neighbor's disc holds its own but for so much, in cells, needs none.
const HELD_CELLS: f32 = 0.25;

/// For every free cell the radius in cells of the largest free disc that covers it; 0 in obstacles.
///
/// Only discs along the middle of the free space are drawn: away from it a step away from the wall gains the whole step in
/// clearance, and the disc of the next cell holds that of this one.
pub(super) fn thickness(floor: &Floor, clearance: &[f32]) -> Vec<f32> {
    let step = |from: usize, to: usize| {
        let is_diagonal = from % floor.width != to % floor.width && from / floor.width != to / floor.width;
        if is_diagonal { std::f32::consts::SQRT_2 } else { 1.0 }
    };
    let is_held = |cell: usize| {
        let mut around = floor.around(cell);
        around.any(|other| clearance[other] >= clearance[cell] + step(cell, other) - HELD_CELLS)
    };
    let mut thickness = clearance.to_vec();
    for center in (0..clearance.len()).filter(|&cell| clearance[cell] > 0.0 && !is_held(cell)) {
        let radius = clearance[center];
        let (column, row) = ((center % floor.width) as i64, (center / floor.width) as i64);
        let reach = radius as i64;
        for y in (row - reach).max(0)..=(row + reach).min(floor.height as i64 - 1) {
            let rise = (y - row) as f32;
            let half = (radius * radius - rise * rise).max(0.0).sqrt() as i64;
            let first = (column - half).max(0) as usize;
            let last = (column + half).min(floor.width as i64 - 1) as usize;
            let line = y as usize * floor.width;
            for cell in line + first..=line + last {
                if clearance[cell] > 0.0 {
                    thickness[cell] = thickness[cell].max(radius);
                }
            }
        }
    }
    thickness
}
