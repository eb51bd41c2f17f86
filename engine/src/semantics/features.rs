//! What the learned labels are decided by: numbers of the map around a place that stay the same when the map is turned
//! or driven the other way.
//!
//! ```text
//! block ─► floods through openings of several widths ─► areas, passages and their directions, how far a room reaches
//!       ─► rays ─► quantiles, Fourier magnitudes, arms
//! run   ─► turns, and of some of these numbers what they are before and after
//! ```
//!
//! The lengths in here are part of the learned weights: a changed one asks for new weights.

use std::f64::consts::TAU;

use super::block::Block;
use super::flood::{Flood, Passage};
use crate::geometry::Point2;

/// Numbers that one position has of its own.
pub(super) const NUM_OWN: usize = 101;
/// Numbers of a position with those of what lies before and after it.
pub(super) const NUM_FEATURES: usize = NUM_OWN + CONTEXT.len() * 5;

/// Nothing farther than this from a position matters to its numbers, metres.
pub(super) const REACH_M: f64 = 12.0;
/// The middle of the passage is looked for within this way, metres.
const MIDDLE_M: f64 = 1.0;
/// Half the widths of the openings that floods pass, metres.
const HALF_WIDTHS_M: [f64; 4] = [0.3, 0.5, 0.7, 0.9];
/// Floods end here, metres.
const FLOOD_M: f64 = 9.0;
/// Ways within which reached surface is counted, metres.
const AREA_WAYS_M: [f64; 4] = [1.5, 3.0, 5.0, 9.0];
/// Rings in which passages are counted: their inner and outer way, metres.
const RINGS_M: [(f64, f64); 3] = [(2.0, 3.5), (3.0, 6.0), (4.5, 8.5)];
/// Half the widths below which a room is taken as closed, metres.
const DOORS_M: [f64; 3] = [0.6, 0.8, 1.1];
const NUM_RAYS: usize = 72;
/// Quantiles of the rays.
const QUANTILES: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 0.9];
/// The usual half width of the way is the median over this much of it before and after, metres.
pub(super) const WAY_M: f64 = 5.0;
/// No way counts as narrower or wider to either side than this, metres.
const HALF_WAYS_M: (f64, f64) = (0.5, 2.0);
/// Passages count when they are at least this share of the usual width wide.
const WIDTH_SHARES: [f64; 4] = [0.45, 0.6, 0.75, 0.9];
/// A passage goes on for this long, metres.
const ARM_M: f64 = 2.5;
/// Fourier magnitudes of the rays, from the first.
const NUM_WAVES: usize = 6;
/// Turns of the driven way are taken over these ways before and after, metres.
pub(super) const TURN_REACHES_M: [f64; 3] = [1.0, 2.0, 4.0];

/// The own numbers that are also told of what lies before and after.
const CONTEXT: [usize; 20] = [1, 2, 7, 8, 14, 23, 24, 35, 47, 50, 53, 59, 61, 63, 65, 76, 79, 81, 87, 88];

/// Reads the own numbers at positions of one block.
pub(super) struct FeatureReader<'a> {
    block: &'a Block,
    flood: Flood,
}

impl<'a> FeatureReader<'a> {
    pub(super) fn new(block: &'a Block) -> Self {
        Self { block, flood: Flood::new(block.side * block.side) }
    }

    /// The own numbers of a driven cell where the way turns by `turns_rad`; `way` are positions of the run before and
    /// after.
    pub(super) fn read(&mut self, at: usize, turns_rad: [f64; 3], way: &[Point2]) -> Vec<f32> {
        let block = self.block;
        let clearance = |index: usize| f64::from(block.clearance_m[index]);
        let mut numbers = Vec::with_capacity(NUM_OWN);
        let mut middle = at;
        for (position, half_width_m) in HALF_WIDTHS_M.into_iter().enumerate() {
            let is_open = |index: usize| clearance(index) >= half_width_m || block.is_driven[index];
            self.flood.pour(block, at, FLOOD_M, is_open);
            if position == 0 {
                let largest = |reach_m: f64| {
                    let near = self.flood.reached_within(block, reach_m);
                    near.iter()
                        .map(|&index| (clearance(index as usize), index as usize))
                        .fold((0.0, at), |best, other| if other.0 > best.0 { other } else { best })
                };
                middle = largest(MIDDLE_M).1;
                numbers.push(clearance(at));
                numbers.extend([0.5, MIDDLE_M, 2.0, 3.5, 6.0].map(|reach_m| largest(reach_m).0));
            }
            if position < 3 {
                numbers.extend(AREA_WAYS_M.map(|way_m| {
                    let cells = self.flood.reached_within(block, way_m).len() as f64;
                    cells * block.resolution_m.powi(2) / (0.5 * TAU * way_m * way_m)
                }));
            }
            for (near_m, far_m) in RINGS_M {
                let mut passages = self.flood.passages(block, near_m, far_m);
                numbers.push(passages.len() as f64);
                if half_width_m == 0.5 {
                    numbers.extend(shape(&mut passages, far_m));
                }
            }
            if half_width_m == 0.5 {
                let half_m = numbers[2].min(2.0);
                let near_m = 1.5 + 2.0 * half_m;
                numbers.push(self.flood.passages(block, near_m, near_m + 3.5).len() as f64);
            }
        }
        for door_m in DOORS_M {
            self.flood.pour(block, middle, REACH_M, |index| clearance(index) >= door_m);
            numbers.extend(self.extent(middle));
        }
        numbers.extend(self.rays(middle, numbers[2]));
        self.flood.pour(block, at, 6.5, |index| block.is_driven[index]);
        numbers.push(self.flood.passages(block, 1.5, 6.5).len() as f64);
        numbers.push(self.flood.passages(block, 1.0, 3.0).len() as f64);
        numbers.extend(turns_rad);
        numbers.extend(self.scaled(at, way));
        debug_assert_eq!(numbers.len(), NUM_OWN);
        numbers.into_iter().map(|number| number as f32).collect()
    }

    /// Half the usual width of the way, and for passages of at least some shares of it: how many leave near and farther
    /// off, how straight the straightest pair is near and at its end.
    fn scaled(&mut self, at: usize, way: &[Point2]) -> Vec<f64> {
        let block = self.block;
        let clearance = |index: usize| f64::from(block.clearance_m[index]);
        let reach = (0.5 / block.resolution_m) as usize;
        let largest = |index: usize| block.square(index, reach).map(clearance).fold(0.0, f64::max);
        let mut half_widths: Vec<f64> =
            way.iter().filter_map(|position| block.index(position)).map(largest).collect();
        half_widths.sort_by(f64::total_cmp);
        let usual_m = half_widths.get(half_widths.len() / 2).copied().unwrap_or(1.0);
        let half_m = usual_m.clamp(HALF_WAYS_M.0, HALF_WAYS_M.1);
        let mut numbers = vec![usual_m, largest(at) / usual_m.max(0.1)];
        for (position, share) in WIDTH_SHARES.into_iter().enumerate() {
            let (near_m, far_m) = (2.0 * half_m + 0.5, 3.0 * half_m);
            self.flood.pour(block, at, far_m + ARM_M, |index| {
                clearance(index) >= share * half_m || block.is_driven[index]
            });
            let near = self.flood.passages(block, near_m, near_m + ARM_M);
            let far = self.flood.passages(block, far_m, far_m + ARM_M);
            numbers.extend([near.len() as f64, far.len() as f64]);
            let short = self.flood.passages(block, 0.6 * far_m, far_m);
            numbers.push(straightness(&short, far_m));
            if position == 1 || position == 2 {
                numbers.push(short.len() as f64);
                numbers.push(straightness(&far, far_m + ARM_M));
                numbers.push(far.iter().filter(|passage| passage.is_driven).count() as f64);
            }
        }
        numbers
    }

    /// Of what the last flood reached: the farthest way, the surface, and the lengths of its two axes.
    fn extent(&self, start: usize) -> [f64; 4] {
        let block = self.block;
        let reached = self.flood.reached_within(block, REACH_M);
        let (column, row) = block.column_row(start);
        let mut sums = [0.0; 5];
        for &index in reached {
            let (x, y) = block.column_row(index as usize);
            let (x, y) = (x as f64 - column as f64, y as f64 - row as f64);
            for (sum, part) in sums.iter_mut().zip([x, y, x * x, x * y, y * y]) {
                *sum += part;
            }
        }
        let num = reached.len() as f64;
        let [x, y, xx, xy, yy] = sums.map(|sum| sum / num);
        let (xx, xy, yy) = (xx - x * x, xy - x * y, yy - y * y);
        let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
        let axis = |variance: f64| (12.0 * variance.max(0.0)).sqrt() * block.resolution_m;
        let way_m = self.flood.farthest_m(block);
        [way_m, num * block.resolution_m.powi(2), axis(mean + half), axis(mean - half)]
    }

    /// Free ways in all directions from a cell beside which a passage is `half_width_m` wide to either side.
    fn rays(&self, from: usize, half_width_m: f64) -> Vec<f64> {
        let block = self.block;
        let (column, row) = block.column_row(from);
        let side = block.side as f64;
        let ranges: Vec<f64> = (0..NUM_RAYS)
            .map(|ray| {
                let (sin, cos) = (TAU * ray as f64 / NUM_RAYS as f64).sin_cos();
                let num_steps = (REACH_M / block.resolution_m) as usize;
                let is_shut = |step: &usize| {
                    let x = (column as f64 + 0.5 + cos * *step as f64).floor();
                    let y = (row as f64 + 0.5 + sin * *step as f64).floor();
                    let is_inside = x >= 0.0 && y >= 0.0 && x < side && y < side;
                    !is_inside || block.clearance_m[y as usize * block.side + x as usize] <= 0.0
                };
                (1..num_steps).find(is_shut).unwrap_or(num_steps) as f64 * block.resolution_m
            })
            .collect();
        let mut sorted = ranges.clone();
        sorted.sort_by(f64::total_cmp);
        let mut numbers: Vec<f64> =
            QUANTILES.iter().map(|share| sorted[(share * (NUM_RAYS - 1) as f64).round() as usize]).collect();
        let surface_m2 = ranges.iter().map(|range| range * range).sum::<f64>() * 0.5 * TAU / NUM_RAYS as f64;
        numbers.push(surface_m2);
        let logs: Vec<f64> = ranges.iter().map(|range| (1.0 + range).ln()).collect();
        let total: f64 = logs.iter().sum();
        for wave in 1..=NUM_WAVES {
            let (mut sin_sum, mut cos_sum) = (0.0, 0.0);
            for (ray, log) in logs.iter().enumerate() {
                let (sin, cos) = (TAU * (wave * ray) as f64 / NUM_RAYS as f64).sin_cos();
                sin_sum += log * sin;
                cos_sum += log * cos;
            }
            numbers.push(f64::hypot(sin_sum, cos_sum) / total.max(1e-9));
        }
        numbers.push(num_arcs(&ranges, 2.5 * half_width_m + 0.5));
        numbers.push(num_arcs(&ranges, 6.0));
        // How far the opposite rays of the longest line go, and how long the way across is.
        let across = |ray: usize| ranges[ray] + ranges[(ray + NUM_RAYS / 2) % NUM_RAYS];
        let lines: Vec<f64> = (0..NUM_RAYS / 2).map(across).collect();
        let longest = (0..lines.len()).fold(0, |best, ray| if lines[ray] > lines[best] { ray } else { best });
        numbers.push(lines[longest]);
        numbers.push(lines[(longest + NUM_RAYS / 4) % (NUM_RAYS / 2)]);
        numbers.push(lines.iter().copied().fold(f64::INFINITY, f64::min));
        numbers.push(ranges[longest].min(ranges[longest + NUM_RAYS / 2]));
        numbers
    }
}

/// Arcs of directions in which a ray is longer than a limit.
fn num_arcs(ranges: &[f64], limit_m: f64) -> f64 {
    let is_long = |ray: usize| ranges[ray % ranges.len()] > limit_m;
    (0..ranges.len()).filter(|&ray| is_long(ray + 1) && !is_long(ray)).count() as f64
}

/// Distance between the ends of the two most opposite passages over the way between them; 0 with fewer than two.
fn straightness(passages: &[Passage], reach_m: f64) -> f64 {
    let mut straightest = 0.0f64;
    for (position, a) in passages.iter().enumerate() {
        for b in &passages[..position] {
            straightest = straightest.max(a.far_end.distance(&b.far_end) / (2.0 * reach_m));
        }
    }
    straightest
}

/// How straight the straightest pair of passages is, the widths of the widest three, and the least angle between the
/// directions of two.
fn shape(passages: &mut [Passage], reach_m: f64) -> [f64; 5] {
    passages.sort_by(|a, b| b.mean_width_m.total_cmp(&a.mean_width_m));
    let width = |rank: usize| passages.get(rank).map_or(0.0, |passage| passage.mean_width_m);
    let mut least_rad = TAU / 2.0;
    for (position, a) in passages.iter().enumerate() {
        for b in &passages[..position] {
            let origin = Point2::new(0.0, 0.0);
            let lengths = a.far_end.distance(&origin) * b.far_end.distance(&origin);
            let cosine = (a.far_end.x * b.far_end.x + a.far_end.y * b.far_end.y) / lengths.max(1e-9);
            least_rad = least_rad.min(cosine.clamp(-1.0, 1.0).acos());
        }
    }
    [straightness(passages, reach_m), width(0), width(1), width(2), least_rad]
}

/// Adds to the own numbers of each position of a run what lies around it; positions are `spacing_m` apart.
pub(super) fn with_context(own: &[Vec<f32>], spacing_m: f64) -> Vec<Vec<f32>> {
    let steps = |meters: f64| (meters / spacing_m).round() as usize;
    let (near, wide, far) = (steps(1.2), steps(2.4), steps(6.0));
    (0..own.len())
        .map(|at| {
            let mut numbers = own[at].clone();
            for feature in CONTEXT {
                let window = |from: usize, to: usize| {
                    own[from.min(own.len())..to.min(own.len())].iter().map(move |other| other[feature])
                };
                let around = |reach: usize| window(at.saturating_sub(reach), at + reach + 1);
                let mean = |values: &mut dyn Iterator<Item = f32>, otherwise: f32| {
                    let (sum, num) = values.fold((0.0, 0.0f32), |(sum, num), value| (sum + value, num + 1.0));
                    if num > 0.0 { sum / num } else { otherwise }
                };
                let here = mean(&mut around(near), own[at][feature]);
                let before = mean(&mut window(at.saturating_sub(far), at.saturating_sub(wide)), here);
                let after = mean(&mut window(at + wide + 1, at + far + 1), here);
                numbers.extend([
                    here,
                    around(wide).fold(f32::INFINITY, f32::min),
                    around(wide).fold(f32::NEG_INFINITY, f32::max),
                    before.min(after),
                    before.max(after),
                ]);
            }
            numbers
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::super::block::BlockEvidence;
    use super::super::config::SemanticsConfig;
    use super::*;
    use crate::geometry::Pose2;
    use crate::scan::ScanGeometry;

    /// A crossing of two corridors, one of them with an end, seen from its middle; turned by quarters.
    fn numbers(quarters: u32) -> Vec<f32> {
        let is_free = |x: f64, y: f64| y.abs() < 1.0 && x > -3.0 || x.abs() < 1.3;
        let geometry = ScanGeometry {
            num_ranges: 720,
            angle_min_rad: -PI,
            angle_increment_rad: PI / 360.0,
            range_max_m: 40.0,
            robot_from_laser: Pose2::identity(),
        };
        let turn_rad = f64::from(quarters) * FRAC_PI_2;
        let ranges: Vec<f32> = (0..720)
            .map(|beam| {
                let (sin, cos) = geometry.beam_angle_rad(beam).sin_cos();
                let steps = (1..).map(|step| f64::from(step) * 0.02);
                let end = |range: &f64| *range > 30.0 || !is_free(cos * range, sin * range);
                steps.into_iter().find(end).unwrap_or(30.0) as f32
            })
            .collect();
        let config = SemanticsConfig::default();
        let mut evidence = BlockEvidence::new(&config, Point2::new(-15.0, -15.0), 30.0);
        let here = Pose2::new(0.05, 0.05, turn_rad);
        for _ in 0..3 {
            evidence.add_scan(&geometry, &here, &ranges);
        }
        evidence.add_driven(&here.position());
        let block = evidence.finish();
        let at = block.index(&here.position()).unwrap();
        FeatureReader::new(&block).read(at, [0.0; 3], &[here.position()])
    }

    #[test]
    fn a_turned_map_gives_the_same_numbers() {
        let (first, second) = (numbers(0), numbers(1));
        assert_eq!(first.len(), NUM_OWN);
        assert_eq!(first[35], 3.0, "three corridors go on");
        for (position, (a, b)) in first.iter().zip(&second).enumerate() {
            assert!((a - b).abs() <= 0.15 * a.abs().max(1.0), "number {position}: {a} and {b}");
        }
    }

    #[test]
    fn context_is_the_same_both_ways() {
        let own: Vec<Vec<f32>> = (0..40).map(|at| vec![(at % 7) as f32; NUM_OWN]).collect();
        let reversed: Vec<Vec<f32>> = own.iter().rev().cloned().collect();
        let (there, mut back) = (with_context(&own, 0.4), with_context(&reversed, 0.4));
        back.reverse();
        for (a, b) in there.iter().flatten().zip(back.iter().flatten()) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
        assert!(there.iter().all(|numbers| numbers.len() == NUM_FEATURES));
    }
}
