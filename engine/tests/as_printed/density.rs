//! The fast density estimate agrees with Algorithms 3.1 and 6.1 as printed, on random grids.

use std::f64::consts::TAU;

use crate::literal::density::{Content, literal_flood, literal_groups};
use locution_engine::density::{DensityConfig, DensityEstimator, KernelConfig, KernelProfile};
use locution_engine::grid::{Cell, OccupancyRows};
use proptest::prelude::*;

const RESOLUTION_M: f64 = 0.1;

/// A square of cells; everything beyond is occupied.
#[derive(Clone, Debug)]
struct Square {
    side: i32,
    cells: Vec<Content>,
}

impl Square {
    fn at(&self, cell: Cell) -> Content {
        let is_inside = (0..self.side).contains(&cell.x) && (0..self.side).contains(&cell.y);
        if is_inside { self.cells[(cell.y * self.side + cell.x) as usize] } else { Content::Occupied }
    }
}

impl OccupancyRows for Square {
    fn read_row(&self, start: Cell, free: &mut [u64], unknown: &mut [u64]) {
        free.fill(0);
        unknown.fill(0);
        for bit in 0..free.len() * 64 {
            match self.at(start.offset(bit as i32, 0)) {
                Content::Free => free[bit / 64] |= 1 << (bit % 64),
                Content::Unknown => unknown[bit / 64] |= 1 << (bit % 64),
                Content::Occupied => {}
            }
        }
    }
}

/// Free ground with walls, unknown patches and speckles.
fn grids() -> impl Strategy<Value = Square> {
    let side = 96;
    let content =
        prop_oneof![3 => Just(Content::Occupied), 2 => Just(Content::Unknown), 2 => Just(Content::Free)];
    let rectangle = (0..side, 0..side, 1..40i32, 1..6i32, any::<bool>(), content);
    let speckles = prop::collection::vec((0..side, 0..side, any::<bool>()), 0..400);
    (prop::collection::vec(rectangle, 0..25), speckles).prop_map(move |(rectangles, speckles)| {
        let mut grid = Square { side, cells: vec![Content::Free; (side * side) as usize] };
        for (x, y, long, short, upright, content) in rectangles {
            let (width, height) = if upright { (short, long) } else { (long, short) };
            for (x, y) in
                (y..(y + height).min(side)).flat_map(|y| (x..(x + width).min(side)).map(move |x| (x, y)))
            {
                grid.cells[(y * side + x) as usize] = content;
            }
        }
        for (x, y, is_unknown) in speckles {
            grid.cells[(y * side + x) as usize] =
                if is_unknown { Content::Unknown } else { Content::Occupied };
        }
        grid
    })
}

fn kernels() -> impl Strategy<Value = Vec<KernelConfig>> {
    let profile = prop_oneof![
        Just(KernelProfile::Uniform),
        Just(KernelProfile::Gaussian),
        Just(KernelProfile::Inverted)
    ];
    let bandwidth_m = prop_oneof![0.05..4.7f64, (1..47i32).prop_map(|cells| f64::from(cells) * RESOLUTION_M)];
    let kernel =
        (profile, bandwidth_m).prop_map(|(profile, bandwidth_m)| KernelConfig { profile, bandwidth_m });
    prop::collection::vec(kernel, 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn the_fast_estimate_agrees_with_the_printed_algorithms(
        grid in grids(),
        kernels in kernels(),
        (x, y) in (40..56i32, 40..56i32),
        tolerance in prop_oneof![Just(0.0), 0.0..0.2f64],
    ) {
        let center = Cell::new(x, y);
        let config = DensityConfig { kernels, opening_tolerance: tolerance, ..DensityConfig::default() };
        let fast = DensityEstimator::new(&config, RESOLUTION_M).estimate(&grid, center);
        for (index, kernel) in config.kernels.iter().enumerate() {
            let (soft, unknown, border) = literal_flood(|cell| grid.at(cell), center, kernel, RESOLUTION_M);
            prop_assert!((f64::from(fast.soft[index]) - soft).abs() < 2e-6, "{} is not {soft}", fast.soft[index]);
            if index == 0 {
                let perimeter = TAU * (kernel.bandwidth_m / RESOLUTION_M * 1e9).round() / 1e9;
                let has_opening = literal_groups(unknown, tolerance * perimeter) > 0;
                prop_assert_eq!(fast.is_hard, !has_opening);
                prop_assert_eq!(usize::from(fast.num_frontiers), literal_groups(border, 0.05 * perimeter));
            }
        }
    }
}

#[test]
fn the_place_of_the_robot_is_no_opening_into_the_unknown() {
    let mut grid = Square { side: 21, cells: vec![Content::Free; 21 * 21] };
    grid.cells[10 * 21 + 10] = Content::Unknown;
    let config = DensityConfig {
        kernels: vec![KernelConfig::uniform(0.5)],
        opening_tolerance: 0.0,
        ..DensityConfig::default()
    };
    assert!(DensityEstimator::new(&config, RESOLUTION_M).estimate(&grid, Cell::new(10, 10)).is_hard);
}

#[test]
fn an_empty_disc_is_one_for_every_kernel() {
    let grid = Square { side: 101, cells: vec![Content::Free; 101 * 101] };
    for profile in [KernelProfile::Uniform, KernelProfile::Gaussian, KernelProfile::Inverted] {
        let kernels = [0.5, 2.5, 4.0].map(|bandwidth_m| KernelConfig { profile, bandwidth_m }).to_vec();
        let config = DensityConfig { kernels, ..DensityConfig::default() };
        let density = DensityEstimator::new(&config, RESOLUTION_M).estimate(&grid, Cell::new(50, 50));
        assert_eq!(density.soft, [1.0; 3]);
        assert!(density.is_hard);
        assert_eq!(density.num_frontiers, 1, "an open hall leaves the kernel everywhere");
    }
}

#[test]
fn a_corridor_has_two_frontiers_and_the_expected_density() {
    let mut grid = Square { side: 101, cells: vec![Content::Occupied; 101 * 101] };
    for y in 40..=60 {
        grid.cells[y * 101..(y + 1) * 101].fill(Content::Free);
    }
    let config = DensityConfig { kernels: vec![KernelConfig::uniform(4.0)], ..DensityConfig::default() };
    let density = DensityEstimator::new(&config, RESOLUTION_M).estimate(&grid, Cell::new(50, 50));
    // A strip of 2.1 m within a disc of 4 m covers 16.6 of 50.3 square metres.
    assert!((density.soft[0] - 0.330).abs() < 0.005, "{}", density.soft[0]);
    assert_eq!((density.is_hard, density.num_frontiers), (true, 2));
}
