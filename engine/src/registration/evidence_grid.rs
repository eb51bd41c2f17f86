//! What a few metres of driving say about every cell around them: unknown, seen free, or near a surface.

use crate::geometry::Point2;

/// State of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellEvidence {
    /// No beam came here.
    Unknown,
    /// Beams passed and none ended near.
    Free,
    /// A beam ended here or in a neighbouring cell.
    Surface,
}

/// A square of cells around the origin.
#[derive(Clone, Debug)]
pub(crate) struct EvidenceGrid {
    cell_m: f64,
    half: i32,
    side: i32,
    passes: Vec<u8>,
    /// 2 where a beam ended, 1 in the eight cells around.
    hits: Vec<u8>,
}

impl EvidenceGrid {
    /// An empty grid that reaches `radius_m` from the origin.
    pub fn new(radius_m: f64, cell_m: f64) -> Self {
        let half = (radius_m / cell_m).ceil() as i32 + 1;
        let side = 2 * half + 1;
        let num_cells = (side * side) as usize;
        Self { cell_m, half, side, passes: vec![0; num_cells], hits: vec![0; num_cells] }
    }

    /// Cells from the origin to the border.
    pub const fn half(&self) -> i32 {
        self.half
    }

    /// Edge length of a cell, metres.
    pub const fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Worth of a cell as a hit: 2 where a beam ended, 1 beside, 0 elsewhere. Row by row, `2 half + 1` cells each.
    pub fn hit_worth(&self) -> &[u8] {
        &self.hits
    }

    /// The same to be filled from elsewhere.
    pub fn hit_worth_mut(&mut self) -> &mut [u8] {
        &mut self.hits
    }

    /// Marks what one beam says; beams may begin and end outside.
    pub fn add_beam(&mut self, from: &Point2, to: &Point2) {
        let length_m = from.distance(to);
        let num_steps = (length_m / self.cell_m).floor();
        if num_steps >= 1.0 {
            let (dx, dy) =
                ((to.x - from.x) / length_m * self.cell_m, (to.y - from.y) / length_m * self.cell_m);
            let (mut x, mut y) = (from.x, from.y);
            // The last cell before the end is left out: it belongs to the surface as likely as not.
            for _ in 0..num_steps as usize {
                if let Some(index) = self.index_of(x, y) {
                    self.passes[index] = self.passes[index].saturating_add(1);
                }
                x += dx;
                y += dy;
            }
        }
        let Some((column, row)) = self.cell_at(to) else { return };
        for dy in -1..=1 {
            for dx in -1..=1 {
                let index = ((row + dy) * self.side + column + dx) as usize;
                let worth = if dx == 0 && dy == 0 { 2 } else { 1 };
                self.hits[index] = self.hits[index].max(worth);
            }
        }
    }

    /// What is known at a point; outside the grid nothing is.
    pub fn at(&self, point: &Point2) -> CellEvidence {
        let Some(index) = self.index_of(point.x, point.y) else { return CellEvidence::Unknown };
        if self.hits[index] > 0 {
            CellEvidence::Surface
        } else if self.passes[index] > 1 {
            CellEvidence::Free
        } else {
            CellEvidence::Unknown
        }
    }

    /// Centres of cells that were seen free, of every `stride`-th row and column.
    pub fn free_points(&self, stride: usize) -> Vec<Point2> {
        let lattice = (0..self.side)
            .step_by(stride)
            .flat_map(|row| (0..self.side).step_by(stride).map(move |column| (column, row)));
        let center = |cell: i32| f64::from(cell - self.half) * self.cell_m;
        lattice
            .filter(|&(column, row)| {
                let index = (row * self.side + column) as usize;
                self.hits[index] == 0 && self.passes[index] > 1
            })
            .map(|(column, row)| Point2::new(center(column), center(row)))
            .collect()
    }

    fn index_of(&self, x: f64, y: f64) -> Option<usize> {
        let column = (x / self.cell_m + 0.5).floor() as i32 + self.half;
        let row = (y / self.cell_m + 0.5).floor() as i32 + self.half;
        (column >= 0 && row >= 0 && column < self.side && row < self.side)
            .then(|| (row * self.side + column) as usize)
    }

    /// Column and row of a point that lies inside and not on the border.
    fn cell_at(&self, point: &Point2) -> Option<(i32, i32)> {
        let column = (point.x / self.cell_m + 0.5).floor() as i32 + self.half;
        let row = (point.y / self.cell_m + 0.5).floor() as i32 + self.half;
        let inside = 1..self.side - 1;
        (inside.contains(&column) && inside.contains(&row)).then_some((column, row))
    }
}
