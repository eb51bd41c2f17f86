//! Passages that leave a place: the front of a flood, followed outwards.
//!
//! ```text
//!        │ │            Water poured out at × runs along every passage. Cells that it reaches after
//!   ─────┘ └─────       `near` to `far` metres form one group per passage; a group that spans the
//!    2  · × ·  3        whole ring is a passage that goes on (1, 2, 3), one that does not is an alcove.
//!   ─────┐ ┌─────
//!        │1│
//! ```

use super::block::Block;
use crate::geometry::Point2;

/// Length units of a step to a neighbour over an edge and over a corner: 7/5 is √2 within 1 %.
const EDGE_STEP: u16 = 5;
const CORNER_STEP: u16 = 7;
/// More than the longest step, so that lists of cells by distance can be reused round and round.
const NUM_BUCKETS: usize = 8;
const UNREACHED: u16 = u16::MAX;

/// A passage that leaves the place where the flood began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Passage {
    /// Middle of its far end, relative to the start, metres.
    pub far_end: Point2,
    /// Its area over its length, metres.
    pub mean_width_m: f64,
    /// A robot drove there.
    pub is_driven: bool,
}

/// A flood over the cells of a block, with its buffers.
pub(super) struct Flood {
    distance: Vec<u16>,
    /// Cells reached, nearest first.
    reached: Vec<u32>,
    buckets: [Vec<u32>; NUM_BUCKETS],
    is_grouped: Vec<bool>,
    start: usize,
}

impl Flood {
    /// Buffers for a block of `num_cells` cells.
    pub(super) fn new(num_cells: usize) -> Self {
        Self {
            distance: vec![UNREACHED; num_cells],
            reached: Vec::new(),
            buckets: Default::default(),
            is_grouped: vec![false; num_cells],
            start: 0,
        }
    }

    fn units(meters: f64, block: &Block) -> u16 {
        (meters / block.resolution_m * f64::from(EDGE_STEP)).clamp(0.0, 30_000.0) as u16
    }

    /// Floods the cells that are open from `start` as far as `limit_m` (Dial's algorithm).
    pub(super) fn pour(
        &mut self,
        block: &Block,
        start: usize,
        limit_m: f64,
        is_open: impl Fn(usize) -> bool,
    ) {
        for &index in &self.reached {
            self.distance[index as usize] = UNREACHED;
        }
        self.reached.clear();
        self.start = start;
        let limit = Self::units(limit_m, block);
        self.distance[start] = 0;
        self.buckets[0].push(start as u32);
        let mut num_waiting = 1;
        let mut current = 0u16;
        while num_waiting > 0 {
            let mut bucket = std::mem::take(&mut self.buckets[usize::from(current) % NUM_BUCKETS]);
            num_waiting -= bucket.len();
            for index in bucket.drain(..) {
                if self.distance[index as usize] != current {
                    continue;
                }
                self.reached.push(index);
                for (neighbor, step) in neighbors(index as usize, block.side) {
                    let distance = current + step;
                    if distance <= limit && distance < self.distance[neighbor] && is_open(neighbor) {
                        self.distance[neighbor] = distance;
                        self.buckets[usize::from(distance) % NUM_BUCKETS].push(neighbor as u32);
                        num_waiting += 1;
                    }
                }
            }
            // Hand the emptied list back, so that its memory is used again.
            self.buckets[usize::from(current) % NUM_BUCKETS] = bucket;
            current += 1;
        }
    }

    /// The cells that the last flood reached within a way, nearest first.
    pub(super) fn reached_within(&self, block: &Block, way_m: f64) -> &[u32] {
        let limit = Self::units(way_m, block);
        let num = self.reached.partition_point(|&index| self.distance[index as usize] <= limit);
        &self.reached[..num]
    }

    /// The longest way that the last flood went, metres.
    pub(super) fn farthest_m(&self, block: &Block) -> f64 {
        let farthest = self.reached.last().map_or(0, |&index| self.distance[index as usize]);
        f64::from(farthest) / f64::from(EDGE_STEP) * block.resolution_m
    }

    /// The passages that go on from `near_m` to `far_m` of the flood, in the order in which their first cell was
    /// reached.
    pub(super) fn passages(&mut self, block: &Block, near_m: f64, far_m: f64) -> Vec<Passage> {
        let (near, far) = (Self::units(near_m, block), Self::units(far_m, block));
        let mut passages = Vec::new();
        let mut group = Vec::new();
        for position in 0..self.reached.len() {
            let first = self.reached[position] as usize;
            if !(near..=far).contains(&self.distance[first]) || self.is_grouped[first] {
                continue;
            }
            group.clear();
            group.push(first);
            self.is_grouped[first] = true;
            let mut next = 0;
            while let Some(&index) = group.get(next) {
                next += 1;
                for (neighbor, _) in neighbors(index, block.side) {
                    if (near..=far).contains(&self.distance[neighbor]) && !self.is_grouped[neighbor] {
                        self.is_grouped[neighbor] = true;
                        group.push(neighbor);
                    }
                }
            }
            passages.extend(self.passage(block, &group, near, far));
        }
        for &index in &self.reached {
            self.is_grouped[index as usize] = false;
        }
        passages
    }

    /// What a group of cells is as a passage, if it spans the ring.
    fn passage(&self, block: &Block, group: &[usize], near: u16, far: u16) -> Option<Passage> {
        let is_near_end = |&&index: &&usize| self.distance[index] <= near + CORNER_STEP;
        let is_far_end = |&&index: &&usize| self.distance[index] + CORNER_STEP >= far;
        group.iter().find(is_near_end)?;
        let (start_column, start_row) = block.column_row(self.start);
        let (mut sum_x, mut sum_y, mut num_far) = (0.0, 0.0, 0.0);
        let mut is_driven = false;
        for &index in group.iter().filter(is_far_end) {
            let (column, row) = block.column_row(index);
            sum_x += column as f64 - start_column as f64;
            sum_y += row as f64 - start_row as f64;
            num_far += 1.0;
            is_driven |= block.is_driven[index];
        }
        let length_cells = f64::from(far - near) / f64::from(EDGE_STEP);
        (num_far > 0.0).then(|| Passage {
            far_end: Point2::new(sum_x / num_far * block.resolution_m, sum_y / num_far * block.resolution_m),
            mean_width_m: group.len() as f64 / length_cells.max(1.0) * block.resolution_m,
            is_driven,
        })
    }
}

/// The neighbours of a cell and the length of the step to each.
fn neighbors(index: usize, side: usize) -> impl Iterator<Item = (usize, u16)> {
    let (column, row) = ((index % side) as i64, (index / side) as i64);
    const STEPS: [(i64, i64, u16); 8] = [
        (-1, -1, CORNER_STEP),
        (0, -1, EDGE_STEP),
        (1, -1, CORNER_STEP),
        (-1, 0, EDGE_STEP),
        (1, 0, EDGE_STEP),
        (-1, 1, CORNER_STEP),
        (0, 1, EDGE_STEP),
        (1, 1, CORNER_STEP),
    ];
    STEPS.into_iter().filter_map(move |(dx, dy, step)| {
        let (x, y) = (column + dx, row + dy);
        let range = 0..side as i64;
        (range.contains(&x) && range.contains(&y)).then(|| (y as usize * side + x as usize, step))
    })
}
