//! Corridors that open into wider space without a door: the thickness drops where they begin.

use std::collections::BTreeMap;

use super::config::RoomsConfig;
use super::floor::Floor;

/// Splits regions whose narrow parts go on for longer than a corner does. What is split off is looked at again.
pub(super) fn split_at_mouths(floor: &Floor, thickness: &[f32], regions: &mut [u32], config: &RoomsConfig) {
    let mut cells_of: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (cell, &region) in regions.iter().enumerate().filter(|(_, region)| **region != 0) {
        cells_of.entry(region).or_default().push(cell);
    }
    let mut num_regions = cells_of.keys().next_back().copied().unwrap_or(0);
    let mut waiting: Vec<Vec<usize>> = cells_of.into_values().collect();
    while let Some(cells) = waiting.pop() {
        let own = regions[cells[0]];
        let widest = cells.iter().map(|&cell| thickness[cell]).fold(0.0, f32::max);
        let limit = widest * config.mouth_share as f32;
        let narrow = parts(floor, regions, &cells, |cell| thickness[cell] < limit);
        let passages: Vec<Vec<usize>> =
            narrow.into_iter().filter(|part| is_passage(floor, regions, part, config)).collect();
        if passages.is_empty() {
            continue;
        }
        for passage in passages {
            num_regions += 1;
            passage.iter().for_each(|&cell| regions[cell] = num_regions);
            waiting.push(passage);
        }
        // What is left may have lost what held it together.
        let kept: Vec<usize> = cells.iter().copied().filter(|&cell| regions[cell] == own).collect();
        for part in parts(floor, regions, &kept, |_| true).into_iter().skip(1) {
            num_regions += 1;
            part.into_iter().for_each(|cell| regions[cell] = num_regions);
        }
    }
}

/// Whether a part is longer than the line along which it touches the rest of its region would make it by chance.
fn is_passage(floor: &Floor, regions: &[u32], part: &[usize], config: &RoomsConfig) -> bool {
    let mut sorted = part.to_vec();
    sorted.sort_unstable();
    let is_rest = |cell: &usize, region: u32| regions[*cell] == region && sorted.binary_search(cell).is_err();
    let contact: usize =
        part.iter().map(|&cell| floor.beside(cell).filter(|o| is_rest(o, regions[cell])).count()).sum();
    let depth_m = part.len() as f64 / contact.max(1) as f64 * floor.resolution_m;
    depth_m > config.mouth_depth_m && part.len() as f64 * floor.cell_m2() > 2.0 * config.room_area_min_m2
}

/// The connected parts of one region's cells that are wanted, in the order of their first cells.
fn parts(
    floor: &Floor,
    regions: &[u32],
    cells: &[usize],
    is_wanted: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = cells.iter().copied().filter(|&cell| is_wanted(cell)).collect();
    left.sort_unstable();
    let mut is_taken = vec![false; left.len()];
    let mut parts = Vec::new();
    for start in 0..left.len() {
        if is_taken[start] {
            continue;
        }
        is_taken[start] = true;
        let mut part = vec![left[start]];
        let mut next = 0;
        while let Some(&cell) = part.get(next) {
            next += 1;
            for other in floor.beside(cell).filter(|&other| regions[other] == regions[cell]) {
                if let Ok(idx) = left.binary_search(&other)
                    && !is_taken[idx]
                {
                    is_taken[idx] = true;
                    part.push(other);
                }
            }
        }
        parts.push(part);
    }
    parts
}
