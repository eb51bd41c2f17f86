//! What the beams of a scan say about cells: how far each frees them, and where its reading lies.

use std::f64::consts::TAU;

use pulp::{Scalar, Simd};

use super::LocalMapConfig;
use super::field_of_view::{CHUNK, NUM_SECTORS, SECTOR_WIDTH, ViewChunk, to_turns};
use crate::geometry::Pose2;
use crate::scan::ScanGeometry;

/// Squared distances, in cells, at which the cells of one beam change their meaning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct BeamLimits {
    /// Cells below this lie before the reading.
    free_end: u32,
    /// Cells from here, not before `free_end`, lie around it...
    hit_begin: u32,
    /// ...over this many squared distances.
    hit_width: u32,
    /// Cells from here on are not touched.
    reach: u32,
}

/// The laser with its beams in counter-clockwise order.
#[derive(Clone, Debug)]
pub(super) struct Laser {
    pub geometry: ScanGeometry,
    /// Beams that fit a full turn, in 2⁻¹⁶ beams.
    beams_per_turn: u64,
    /// Limits of every beam that fits a full turn, those the laser has not staying zero, and of the first once more,
    /// so that a sector's beams stand side by side.
    limits: Vec<BeamLimits>,
    /// Where each of these begins, from the first edge of the field of view, in 2⁻³² turns.
    edges: Vec<u32>,
    /// As many beams as may meet a sector.
    beams_per_sector: usize,
}

impl Laser {
    pub fn new(geometry: &ScanGeometry) -> Self {
        let beams_per_turn = (TAU / geometry.angle_increment_rad.abs() * 65_536.0).round() as u64;
        let num_beams = beam_at(u32::MAX, beams_per_turn) + 1;
        let beams_per_sector = beam_at(SECTOR_WIDTH, beams_per_turn) + 2;
        let begin = |beam: usize| ((beam as u64) << 48).div_ceil(beams_per_turn) as u32;
        let edges = (0..num_beams + beams_per_sector).map(|beam| begin(beam % num_beams)).collect();
        let num_slots = (num_beams + beams_per_sector).max(geometry.num_ranges);
        let limits = vec![BeamLimits::default(); num_slots];
        Self { geometry: geometry.clone(), beams_per_turn, limits, edges, beams_per_sector }
    }

    /// The first edge of the field of view in the map, 2⁻³² turns.
    pub fn first_edge(&self, map_from_laser: &Pose2) -> u32 {
        let increment = self.geometry.angle_increment_rad;
        let first = if increment > 0.0 {
            self.geometry.angle_min_rad
        } else {
            self.geometry.beam_angle_rad(self.geometry.num_ranges.saturating_sub(1))
        };
        to_turns(map_from_laser.theta + first - increment.abs() / 2.0)
    }

    /// The beams that may meet a sector that begins at a direction counted from the first edge.
    #[inline(always)]
    pub fn beams_from(&self, from_edge: u32) -> SectorBeams<'_> {
        let first = beam_at(from_edge, self.beams_per_turn);
        let beams = first..first + self.beams_per_sector;
        SectorBeams { limits: &self.limits[beams.clone()], edges: &self.edges[beams], from_edge }
    }

    /// Sectors that the field of view touches, from the one that holds its first edge.
    pub fn num_sectors(&self) -> usize {
        let view = ((self.geometry.num_ranges as u64) << 48) / self.beams_per_turn;
        ((view / u64::from(SECTOR_WIDTH)) as usize + 2).min(NUM_SECTORS)
    }

    #[inline(always)]
    pub fn set_limits(&mut self, ranges_m: &[f32], config: &LocalMapConfig) {
        let scale = RangeScale::new(&self.geometry, config);
        let beams = &mut self.limits[..self.geometry.num_ranges];
        // Readings that the scan does not have say nothing.
        beams.fill(BeamLimits::default());
        for (limits, &range_m) in beams.iter_mut().zip(ranges_m) {
            *limits = scale.limits_of(range_m);
        }
        if self.geometry.angle_increment_rad < 0.0 {
            beams.reverse();
        }
        let num_beams = beam_at(u32::MAX, self.beams_per_turn) + 1;
        for repeated in 0..self.beams_per_sector {
            self.limits[num_beams + repeated] = self.limits[repeated % num_beams];
        }
    }
}

/// The beam that holds a direction counted from the first edge, of beams of 2⁻¹⁶ of which that many make a turn.
#[inline(always)]
fn beam_at(from_first_edge: u32, beams_per_turn: u64) -> usize {
    ((u64::from(from_first_edge) * beams_per_turn) >> 48) as usize
}

/// Turns readings into limits in cells.
struct RangeScale {
    range_max_m: f64,
    resolution_m: f64,
    hit_tolerance: f64,
    radius: f64,
    /// What a reading from beyond the radius says.
    all_free: BeamLimits,
    /// What a beam without return says.
    no_return: BeamLimits,
}

impl RangeScale {
    fn new(geometry: &ScanGeometry, config: &LocalMapConfig) -> Self {
        let free_within = |free_end: u32| BeamLimits { free_end, reach: free_end, ..BeamLimits::default() };
        let radius = config.radius_cells();
        let all_free = free_within((radius * radius) as u32 + 1);
        let cleared = geometry.range_max_m / config.resolution_m;
        let no_return = if cleared > radius { all_free } else { free_within(rounded_up(cleared * cleared)) };
        let (range_max_m, resolution_m) = (geometry.range_max_m, config.resolution_m);
        Self {
            range_max_m,
            resolution_m,
            hit_tolerance: config.hit_tolerance_cells,
            radius,
            all_free,
            no_return,
        }
    }

    /// What a reading says about the cells of its beam; without branches, so that several are turned at once.
    #[inline(always)]
    fn limits_of(&self, range_m: f32) -> BeamLimits {
        let range = f64::from(range_m) / self.resolution_m;
        let (near, far) = ((range - self.hit_tolerance).max(0.0), range + self.hit_tolerance);
        let is_return = f64::from(range_m) < self.range_max_m;
        let is_near = near <= self.radius;
        let (near_squared, radius_squared) = (near * near, self.radius * self.radius);
        // What goes beyond the radius is replaced below; any number that fits will do.
        let free_end = rounded_up(near_squared.min(radius_squared));
        let hit_end = rounded_up((far * far).min(radius_squared));
        let next = rounded_down(near_squared.min(radius_squared)) + 1;
        let hit_begin = if range < self.hit_tolerance { 0 } else { next };
        let hit_width = hit_end.max(hit_begin) - hit_begin;
        let around = BeamLimits { free_end, hit_begin, hit_width, reach: free_end.max(hit_end) };
        let limits = select(is_near, around, self.all_free);
        // A reading of nothing is a fault of the sensor; it says neither free nor occupied.
        select(range_m <= 0.0, BeamLimits::default(), select(is_return, limits, self.no_return))
    }
}

/// One of two, field by field.
#[inline(always)]
fn select(condition: bool, yes: BeamLimits, no: BeamLimits) -> BeamLimits {
    BeamLimits {
        free_end: if condition { yes.free_end } else { no.free_end },
        hit_begin: if condition { yes.hit_begin } else { no.hit_begin },
        hit_width: if condition { yes.hit_width } else { no.hit_width },
        reach: if condition { yes.reach } else { no.reach },
    }
}

/// Doubles from here on have no fractions, and the integer in their lowest bits.
const NO_FRACTION: f64 = (1u64 << 52) as f64;

/// The largest integer not above a number of 0..2³¹.
#[inline(always)]
fn rounded_down(number: f64) -> u32 {
    let nearest = (number + NO_FRACTION).to_bits() as u32;
    nearest - u32::from((number + NO_FRACTION) - NO_FRACTION > number)
}

/// The smallest integer not below a number of 0..2³¹.
#[inline(always)]
fn rounded_up(number: f64) -> u32 {
    let nearest = (number + NO_FRACTION).to_bits() as u32;
    nearest + u32::from((number + NO_FRACTION) - NO_FRACTION < number)
}

/// The beams that may meet a sector, in their order.
pub(super) struct SectorBeams<'a> {
    limits: &'a [BeamLimits],
    /// Where each begins, from the first edge of the field of view.
    edges: &'a [u32],
    /// Where the sector begins, likewise.
    from_edge: u32,
}

impl SectorBeams<'_> {
    /// What all of them free, and how far the farthest goes.
    #[inline(always)]
    pub fn common_limits(&self) -> (u32, u32) {
        self.limits
            .iter()
            .fold((u32::MAX, 0), |(free, reach), beam| (free.min(beam.free_end), reach.max(beam.reach)))
    }

    /// Writes 1 for cells before the reading of their beam, and for cells around it.
    #[inline(always)]
    pub fn judge<S: Simd>(
        &self,
        simd: S,
        cells: &ViewChunk<'_>,
        free: &mut [u32; CHUNK],
        hit: &mut [u32; CHUNK],
    ) {
        let ((squared, last_squared), (angles, last_angles)) =
            (S::as_simd_u32s(cells.squared), S::as_simd_u32s(cells.angles));
        let ((free, last_free), (hit, last_hit)) = (S::as_mut_simd_u32s(free), S::as_mut_simd_u32s(hit));
        self.judge_lanes(simd, (squared, angles), free, hit);
        // What is too short for the registers.
        self.judge_lanes(Scalar, (last_squared, last_angles), last_free, last_hit);
    }

    #[inline(always)]
    fn judge_lanes<S: Simd>(
        &self,
        simd: S,
        (squared, angles): (&[S::u32s], &[S::u32s]),
        free: &mut [S::u32s],
        hit: &mut [S::u32s],
    ) {
        let (one, none) = (simd.splat_u32s(1), simd.splat_u32s(0));
        for (lane, (&squared, &angle)) in squared.iter().zip(angles).enumerate() {
            let first = &self.limits[0];
            let mut free_end = simd.splat_u32s(first.free_end);
            let mut hit_begin = simd.splat_u32s(first.hit_begin);
            let mut hit_width = simd.splat_u32s(first.hit_width);
            for (limits, edge) in self.limits.iter().zip(self.edges).skip(1) {
                let begin = simd.splat_u32s(edge.wrapping_sub(self.from_edge));
                let is_past = simd.greater_than_or_equal_u32s(angle, begin);
                free_end = simd.select_u32s(is_past, simd.splat_u32s(limits.free_end), free_end);
                hit_begin = simd.select_u32s(is_past, simd.splat_u32s(limits.hit_begin), hit_begin);
                hit_width = simd.select_u32s(is_past, simd.splat_u32s(limits.hit_width), hit_width);
            }
            let from_hit = simd.sub_u32s(squared, hit_begin);
            free[lane] = simd.select_u32s(simd.less_than_u32s(squared, free_end), one, none);
            hit[lane] = simd.select_u32s(simd.less_than_u32s(from_hit, hit_width), one, none);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use pulp::{Arch, WithSimd};

    use super::*;

    /// Judges cells with the registers of the processor at hand.
    struct Judgement<'a>(SectorBeams<'a>, ViewChunk<'a>);

    impl WithSimd for Judgement<'_> {
        type Output = ([u32; CHUNK], [u32; CHUNK]);

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (mut free, mut hit) = ([0; CHUNK], [0; CHUNK]);
            self.0.judge(simd, &self.1, &mut free, &mut hit);
            (free, hit)
        }
    }

    proptest! {
        #[test]
        fn cells_learn_from_the_beam_that_is_looked_up(
            num_ranges in 1usize..400, share in 0.05..1.0f64, clockwise in any::<bool>(),
            ranges in prop::collection::vec(prop_oneof![-0.1..12.0f32, Just(f32::NAN), Just(f32::INFINITY)], 400),
            from_edge in any::<u32>(),
            squared in any::<[u16; CHUNK]>(), angles in prop::array::uniform8(0..SECTOR_WIDTH),
        ) {
            let increment = TAU * share / num_ranges as f64;
            let geometry = ScanGeometry {
                num_ranges,
                angle_min_rad: 0.0,
                angle_increment_rad: if clockwise { -increment } else { increment },
                range_max_m: 10.0,
                robot_from_laser: Pose2::identity(),
            };
            let config = LocalMapConfig::default();
            let mut laser = Laser::new(&geometry);
            laser.set_limits(&ranges, &config);
            let squared = squared.map(u32::from);
            let chunk = ViewChunk { squared: &squared, angles: &angles, indices: &[0; CHUNK] };
            let (free, hit) = Arch::new().dispatch(Judgement(laser.beams_from(from_edge), chunk));
            let scale = RangeScale::new(&geometry, &config);
            for cell in 0..CHUNK {
                let beam = beam_at(from_edge.wrapping_add(angles[cell]), laser.beams_per_turn);
                let range = if clockwise { num_ranges.wrapping_sub(1 + beam) } else { beam };
                let limits = match ranges[..num_ranges].get(range) {
                    Some(&range_m) => scale.limits_of(range_m),
                    None => BeamLimits::default(),
                };
                let hits = limits.hit_begin..limits.hit_begin + limits.hit_width;
                prop_assert_eq!(free[cell] == 1, squared[cell] < limits.free_end);
                prop_assert_eq!(hit[cell] == 1, hits.contains(&squared[cell]));
            }
        }

        #[test]
        fn a_reading_parts_its_beam_as_distances_do(range_m in 0.0..12.0f32, squared in 0u32..8101) {
            let config = LocalMapConfig::default();
            let geometry = ScanGeometry {
                num_ranges: 1,
                angle_min_rad: 0.0,
                angle_increment_rad: 0.1,
                range_max_m: 10.0,
                robot_from_laser: Pose2::identity(),
            };
            let limits = RangeScale::new(&geometry, &config).limits_of(range_m);
            let (range, distance) = (f64::from(range_m) / 0.1, f64::from(squared).sqrt());
            let is_return = range_m > 0.0 && f64::from(range_m) < 10.0;
            // The roundings of the root may differ at the very border.
            prop_assume!((range - distance).abs() > 1e-6 && ((range - distance).abs() - 1.0).abs() > 1e-6);
            let is_free = range_m > 0.0 && (!is_return || distance < range - 1.0);
            let is_hit = is_return && (distance - range).abs() <= 1.0;
            prop_assert_eq!(squared < limits.free_end, is_free);
            prop_assert_eq!((limits.hit_begin..limits.hit_begin + limits.hit_width).contains(&squared), is_hit);
            prop_assert!(!(is_free || is_hit) || squared < limits.reach);
        }

        #[test]
        fn rounds_like_floor_and_ceil(number in prop_oneof![0.0..70_000.0f64, (0u32..70_000).prop_map(f64::from)]) {
            prop_assert_eq!(f64::from(rounded_down(number)), number.floor());
            prop_assert_eq!(f64::from(rounded_up(number)), number.ceil());
        }
    }
}
