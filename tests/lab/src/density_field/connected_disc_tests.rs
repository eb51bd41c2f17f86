//! Sliding discs against a flood from nothing at every centre.

use std::collections::{HashSet, VecDeque};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::arc_planes::margin;
use super::bit_window::BitPlanes;
use super::connected_disc::{DiscSweep, Fill};
use super::kernel_rows::{KernelRows, height};
use locution_engine::density::KernelProfile;
use locution_engine::geometry::Point2;
use locution_engine::occupancy::{CellState, GridMap};

/// Algorithm 3.1, cell by cell, with the tolerance of SPEC section 3.
fn literal_fill(
    map: &GridMap,
    center: (i64, i64),
    (profile, h): (KernelProfile, f64),
    most_open: u32,
) -> Option<Fill> {
    if map.state(center.0, center.1) != CellState::Free {
        return None;
    }
    let (mut mass, mut whole) = (0.0, 0.0);
    let reach = h.ceil() as i64;
    for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
        let d = (dx as f64).hypot(dy as f64);
        whole += if d < h { height(profile, d, h) } else { 0.0 };
    }
    let mut open = HashSet::new();
    let mut seen = HashSet::from([center]);
    let mut queue = VecDeque::from([center]);
    while let Some((x, y)) = queue.pop_front() {
        let d = ((x - center.0) as f64).hypot((y - center.1) as f64);
        if d >= h {
            continue;
        }
        if map.state(x, y) != CellState::Free {
            continue;
        }
        mass += height(profile, d, h);
        let around = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)];
        if around.iter().any(|&(x, y)| map.state(x, y) == CellState::Unknown) {
            open.insert((x, y));
        }
        queue.extend(around.iter().filter(|&&cell| seen.insert(cell)));
    }
    let mut largest = 0;
    while let Some(&first) = open.iter().next() {
        open.remove(&first);
        let mut group = vec![first];
        let mut num_cells = 0;
        while let Some((x, y)) = group.pop() {
            num_cells += 1;
            for beside in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy))) {
                group.extend(open.remove(&beside).then_some(beside));
            }
        }
        largest = largest.max(num_cells);
    }
    Some(Fill { density: (mass / whole) as f32, has_opening: largest > most_open })
}

/// Rooms with doors and clutter, and a part nobody has seen.
fn random_building(rng: &mut ChaCha8Rng, width: usize, height: usize) -> GridMap {
    let mut map = GridMap::unknown(width, height, 0.1, Point2::default());
    for (column, row) in (0..width as i64).flat_map(|x| (0..height as i64).map(move |y| (x, y))) {
        map.set(column, row, CellState::Free);
    }
    for _ in 0..8 {
        let (at, is_row) = (rng.random_range(0..width.min(height) as i64), rng.random::<bool>());
        for along in 0..width.max(height) as i64 {
            if rng.random_range(0..12) > 0 {
                let (column, row) = if is_row { (along, at) } else { (at, along) };
                map.set(column, row, CellState::Occupied);
            }
        }
    }
    for _ in 0..width * height / 12 {
        let state = if rng.random::<bool>() { CellState::Occupied } else { CellState::Unknown };
        map.set(rng.random_range(0..width as i64), rng.random_range(0..height as i64), state);
    }
    map
}

fn sweep_all(map: &GridMap, planes: &BitPlanes, kernel: &KernelRows, most_open: u32) -> Vec<Option<Fill>> {
    let mut fills = vec![None; map.width() * map.height()];
    for (row, fills) in fills.chunks_exact_mut(map.width()).enumerate() {
        if kernel.radius() < 32 {
            DiscSweep::<1>::new(planes, kernel, most_open).sweep(0, row as i64, fills);
        } else {
            DiscSweep::<2>::new(planes, kernel, most_open).sweep(0, row as i64, fills);
        }
    }
    fills
}

#[test]
fn sliding_discs_agree_with_the_literal_flood() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let cases = [(1.0, 20, 9), (3.0, 40, 33), (6.5, 37, 50), (15.0, 40, 33), (30.0, 50, 34), (57.0, 40, 30)];
    for (h, width, height) in cases {
        for profile in [KernelProfile::Uniform, KernelProfile::Gaussian, KernelProfile::Inverted] {
            let map = random_building(&mut rng, width, height);
            let kernel = KernelRows::new(profile, h);
            let planes = BitPlanes::new(&map, margin(&kernel));
            let most_open = rng.random_range(0..6);
            let fills = sweep_all(&map, &planes, &kernel, most_open);
            for (cell, fast) in fills.iter().enumerate() {
                let cell = ((cell % width) as i64, (cell / width) as i64);
                if h > 10.0 && rng.random_range(0..8) > 0 {
                    continue;
                }
                match (fast, literal_fill(&map, cell, (profile, h), most_open)) {
                    (Some(fast), Some(slow)) => {
                        assert_eq!(fast.has_opening, slow.has_opening, "h {h} at {cell:?}");
                        assert!(
                            (fast.density - slow.density).abs() < 1e-5,
                            "{fast:?} {slow:?} h {h} at {cell:?}"
                        );
                    }
                    (fast, slow) => assert_eq!(*fast, slow, "h {h} at {cell:?}"),
                }
            }
        }
    }
}
