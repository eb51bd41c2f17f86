//! The update rule of the local map (thesis Algorithm 2.2, SPEC 3.1).
//!
//! The cells that a scan frees and those it hits are collected as bits about the laser first, then turned to where
//! they lie on the map and applied to hundreds of cells at a time. In a sector of the view, the nearest cells are freed
//! a ring at a time, by whatever beams meet it; only for the cells about the readings is the beam looked for.

use pulp::{Arch, Simd, WithSimd};

use super::bit_planes::{BLOCK_WORDS, Bits, Change};
use super::field_of_view::{CHUNK, NUM_SECTORS, SECTOR_WIDTH};
use super::{Cell, LocalMap};
use crate::geometry::Pose2;

/// A scan to be integrated by code for the processor at hand.
struct Integration<'a> {
    map: &'a mut LocalMap,
    ranges_m: &'a [f32],
    map_from_robot: &'a Pose2,
}

impl WithSimd for Integration<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.map.integrate(simd, self.ranges_m, self.map_from_robot);
    }
}

impl LocalMap {
    /// Updates the map with a scan taken at a pose (Algorithm 2.2).
    ///
    /// Every cell in the field of view learns from the nearest beam: before the reading it becomes less occupied,
    /// around it more. A reading without return clears up to the smaller of the sensor's maximum and the radius.
    /// The floor under the robot is free. Cost: proportional to the cells before the readings.
    pub fn integrate_scan(&mut self, ranges_m: &[f32], map_from_robot: &Pose2) {
        // Compiled for wide registers too, and chosen as the processor has them; the results are the same.
        Arch::new().dispatch(Integration { map: self, ranges_m, map_from_robot });
    }

    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S, ranges_m: &[f32], map_from_robot: &Pose2) {
        let map_from_laser = map_from_robot.compose(&self.laser.geometry.robot_from_laser);
        let robot = Cell::containing(&map_from_robot.position(), self.config.resolution_m);
        let laser = Cell::containing(&map_from_laser.position(), self.config.resolution_m);
        self.move_to(robot);
        self.laser.set_limits(ranges_m, &self.config);
        let mut seen = self.cells_seen(simd, self.laser.first_edge(&map_from_laser));
        if laser != robot {
            let center = self.view.center_cell();
            let kept = center.offset(robot.x.wrapping_sub(laser.x), robot.y.wrapping_sub(laser.y));
            self.disc.for_each_outside(center, kept, |word, mask| {
                seen.free[word] &= !mask;
                seen.hit[word] &= !mask;
            });
        }
        seen.close();
        self.apply(simd, &seen, laser);
        for cell in cells_between(robot, laser) {
            self.stamp_footprint(cell);
        }
    }

    /// Collects the cells before and around the readings, as they lie about the laser.
    #[inline(always)]
    fn cells_seen<S: Simd>(&self, simd: S, first_edge: u32) -> Seen {
        let mut seen = Seen::nothing(self.view.num_words());
        let first_sector = (first_edge / SECTOR_WIDTH) as usize;
        for sector in
            (first_sector..first_sector + self.laser.num_sectors()).map(|sector| sector % NUM_SECTORS)
        {
            let from_edge = (sector as u32).wrapping_mul(SECTOR_WIDTH).wrapping_sub(first_edge);
            let sector_beams = self.laser.beams_from(from_edge);
            let (free_for_all, reach) = sector_beams.common_limits();
            let num_rings = self.view.num_rings_within(free_for_all);
            for entry in self.view.words_of_rings(sector, num_rings) {
                seen.free[entry.word] |= entry.cells;
            }
            for chunk in self.view.chunks_beyond_rings(sector, num_rings, reach) {
                let (mut free, mut hit) = ([0; CHUNK], [0; CHUNK]);
                sector_beams.judge(simd, &chunk, &mut free, &mut hit);
                for cell in 0..CHUNK {
                    let (word, bit) = (chunk.indices[cell] as usize >> 6, chunk.indices[cell] & 63);
                    seen.free[word] |= u64::from(free[cell]) << bit;
                    seen.hit[word] |= u64::from(hit[cell]) << bit;
                }
            }
        }
        seen
    }

    /// Applies what a scan saw to the cells about the laser's.
    #[inline(always)]
    fn apply<S: Simd>(&mut self, simd: S, seen: &Seen, laser_cell: Cell) {
        let change = Change { subtracted: self.config.free_decrement, added: self.config.hit_increment };
        // The view's helix, turned by this many cells, lies on the map's.
        let (mask, center) = (self.disc.index_mask(), self.view.center() as usize);
        let turn = self.disc.index(laser_cell).wrapping_sub(center) & mask;
        let (turned_words, shift) = (turn >> 6, turn & 63);
        for (block, planes) in self.blocks.iter_mut().enumerate() {
            let first = (block * BLOCK_WORDS).wrapping_sub(turned_words + 1) & (mask >> 6);
            let (free, hit) = (turned(&seen.free, first, shift), turned(&seen.hit, first, shift));
            if (0..BLOCK_WORDS).fold(0, |any, word| any | free[word] | hit[word]) != 0 {
                change.apply(simd, planes, &free, &hit);
            }
        }
    }
}

/// A block of bits that begins with the last `shift` bits of a word.
#[inline(always)]
fn turned(words: &[u64], first: usize, shift: usize) -> Bits {
    let words = &words[first..first + BLOCK_WORDS + 1];
    std::array::from_fn(|word| words[word + 1] << shift | words[word] >> 1 >> (63 - shift))
}

/// Which cells the scan at hand found free, and which it hit: a helix like the map's, about the laser.
///
/// Made anew for each scan: kept, it would be a good part of what an open run weighs.
struct Seen {
    /// Cells before the readings.
    free: Vec<u64>,
    /// Cells around the readings.
    hit: Vec<u64>,
}

impl Seen {
    #[inline(always)]
    fn nothing(num_words: usize) -> Self {
        // The first block once more behind the last makes a torus of it.
        let words = vec![0; num_words + BLOCK_WORDS];
        Self { free: words.clone(), hit: words }
    }

    #[inline(always)]
    fn close(&mut self) {
        for words in [&mut self.free, &mut self.hit] {
            let num_words = words.len() - BLOCK_WORDS;
            words.copy_within(..BLOCK_WORDS, num_words);
        }
    }
}

/// Cells on the straight line between two, both included.
fn cells_between(from: Cell, to: Cell) -> impl Iterator<Item = Cell> {
    let (dx, dy) = (to.x.wrapping_sub(from.x), to.y.wrapping_sub(from.y));
    let steps = dx.unsigned_abs().max(dy.unsigned_abs()) as i32;
    let part = move |delta: i32, step: i32| {
        (f64::from(delta) * f64::from(step) / f64::from(steps.max(1))).round() as i32
    };
    (0..=steps).map(move |step| from.offset(part(dx, step), part(dy, step)))
}
