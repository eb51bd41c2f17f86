//! Basins of the clearance, flooded from the widest cells down, and what becomes of two that meet.

use std::collections::BTreeSet;

use super::config::RoomsConfig;
use super::floor::Floor;

/// Where the saddle is nearly as wide as the smaller basin at its widest, it is a ripple of the wall.
const RIPPLE_SHARE: f32 = 0.95;
/// A basin of less than this when it meets another is a dent in a wall, square metres.
const DENT_M2: f64 = 0.3;

/// Numbers every free cell by its basin. Cells are taken from the widest down; a cell that touches two basins is the saddle
/// between them, the widest cell of the opening that joins them, and decides whether they are one.
pub(super) fn basins(floor: &Floor, clearance: &[f32], thickness: &[f32], config: &RoomsConfig) -> Vec<u32> {
    let mut order: Vec<usize> = (0..clearance.len()).filter(|&cell| clearance[cell] > 0.0).collect();
    order.sort_by(|&a, &b| clearance[b].total_cmp(&clearance[a]).then(a.cmp(&b)));
    let mut flood = Flood {
        floor,
        thickness,
        config,
        basin_of: vec![0; clearance.len()],
        basins: vec![Basin { parent: 0, peak: 0.0, num_cells: 0 }],
        apart: BTreeSet::new(),
        seen_at: vec![0; clearance.len()],
        num_looks: 0,
    };
    for cell in order {
        flood.take(cell, clearance);
    }
    (0..clearance.len()).map(|cell| flood.root(flood.basin_of[cell])).collect()
}

struct Basin {
    parent: u32,
    /// Largest clearance in it, cells.
    peak: f32,
    num_cells: usize,
}

struct Flood<'a> {
    floor: &'a Floor,
    thickness: &'a [f32],
    config: &'a RoomsConfig,
    basin_of: Vec<u32>,
    /// The first is none.
    basins: Vec<Basin>,
    /// Pairs of roots that a door holds apart, the smaller number first.
    apart: BTreeSet<(u32, u32)>,
    /// Which look around a saddle saw a cell last.
    seen_at: Vec<u32>,
    num_looks: u32,
}

impl Flood<'_> {
    fn root(&self, mut basin: u32) -> u32 {
        while self.basins[basin as usize].parent != basin {
            basin = self.basins[basin as usize].parent;
        }
        basin
    }

    fn take(&mut self, cell: usize, clearance: &[f32]) {
        let mut roots: Vec<u32> = Vec::new();
        let (mut widest, mut heir) = (-1.0, 0);
        for other in self.floor.around(cell).filter(|&other| self.basin_of[other] != 0) {
            let root = self.root(self.basin_of[other]);
            if !roots.contains(&root) {
                roots.push(root);
            }
            if clearance[other] > widest {
                (widest, heir) = (clearance[other], root);
            }
        }
        if roots.is_empty() {
            heir = self.basins.len() as u32;
            self.basins.push(Basin { parent: heir, peak: clearance[cell], num_cells: 0 });
        }
        self.basin_of[cell] = heir;
        self.basins[heir as usize].num_cells += 1;
        roots.sort_unstable();
        for (idx, &first) in roots.iter().enumerate() {
            for &second in &roots[idx + 1..] {
                self.meet(cell, clearance[cell], self.root(first), self.root(second));
            }
        }
    }

    /// Joins two basins at their saddle, or says that a door is there.
    fn meet(&mut self, saddle: usize, half_width: f32, first: u32, second: u32) {
        let pair = (first.min(second), first.max(second));
        if first == second || self.apart.contains(&pair) {
            return;
        }
        if self.is_door(saddle, half_width, pair) {
            self.apart.insert(pair);
            return;
        }
        let (heir, other) = if self.basins[pair.0 as usize].peak >= self.basins[pair.1 as usize].peak {
            pair
        } else {
            (pair.1, pair.0)
        };
        self.basins[other as usize].parent = heir;
        self.basins[heir as usize].num_cells += self.basins[other as usize].num_cells;
        let moved: Vec<(u32, u32)> =
            self.apart.iter().copied().filter(|doors| doors.0 == other || doors.1 == other).collect();
        for doors in moved {
            self.apart.remove(&doors);
            let beyond = if doors.0 == other { doors.1 } else { doors.0 };
            self.apart.insert((heir.min(beyond), heir.max(beyond)));
        }
    }

    fn is_door(&mut self, saddle: usize, half_width: f32, (first, second): (u32, u32)) -> bool {
        let (a, b) = (&self.basins[first as usize], &self.basins[second as usize]);
        let smaller_m2 = a.num_cells.min(b.num_cells) as f64 * self.floor.cell_m2();
        let width_m = 2.0 * f64::from(half_width) * self.floor.resolution_m;
        if half_width > RIPPLE_SHARE * a.peak.min(b.peak)
            || width_m > self.config.door_width_max_m
            || smaller_m2 < DENT_M2
        {
            return false;
        }
        let beside = self.thickness_beside(saddle, first).min(self.thickness_beside(saddle, second));
        f64::from(half_width) <= self.config.door_share * f64::from(beside)
    }

    /// Median thickness of what a basin holds within reach of a saddle.
    fn thickness_beside(&mut self, saddle: usize, basin: u32) -> f32 {
        self.num_looks += 1;
        self.seen_at[saddle] = self.num_looks;
        let reach = self.config.door_reach_m / self.floor.resolution_m;
        let width = self.floor.width;
        let at = |cell: usize| ((cell % width) as f64, (cell / width) as f64);
        let (x, y) = at(saddle);
        let mut waiting = vec![saddle];
        let mut found = Vec::new();
        while let Some(cell) = waiting.pop() {
            if cell != saddle {
                found.push(self.thickness[cell]);
            }
            for other in self.floor.around(cell) {
                let (other_x, other_y) = at(other);
                if self.seen_at[other] != self.num_looks
                    && self.basin_of[other] != 0
                    && (other_x - x).hypot(other_y - y) <= reach
                    && self.root(self.basin_of[other]) == basin
                {
                    self.seen_at[other] = self.num_looks;
                    waiting.push(other);
                }
            }
        }
        let middle = found.len() / 2;
        if found.is_empty() { 0.0 } else { *found.select_nth_unstable_by(middle, f32::total_cmp).1 }
    }
}
