//! The sparse system H Δ = −b with D × D blocks, one row of blocks per pose (thesis Eq B.16).
//!
//! Blocks are added straight into the compressed columns of the triangle that the factorisation wants, in
//! elimination order. The pattern, the ordering and the place of every constraint's block are found once; an
//! iteration only writes numbers. Held poses keep a row of their own, the identity, and couple to nothing.

use faer::sparse::SymbolicSparseColMat;
use nalgebra::{SMatrix, SVector};

use super::selected_inverse::Workspace;
use super::sparse_cholesky::{ColumnPattern, FactorError, SparseCholesky, Triangle, fill_reducing_order};
use super::{PoseConstraint, PoseGraphError};

/// Where the blocks of a graph stand after a fill-reducing reordering, whatever their size.
pub(super) struct BlockPattern {
    /// Pose eliminated as k-th.
    pose_at: Vec<u32>,
    /// Inverse of `pose_at`.
    position_of: Vec<u32>,
    /// Positions (smaller, larger) of each constraint's poses; `None` when one of them is held.
    couplings: Vec<Option<(u32, u32)>>,
    is_held: Vec<bool>,
}

impl BlockPattern {
    /// Orders the poses so that the factor stays sparse.
    pub fn new(constraints: &[PoseConstraint], is_held: Vec<bool>) -> Result<Self, PoseGraphError> {
        let free_pairs = || {
            constraints.iter().map(|constraint| {
                let is_free = !is_held[constraint.i as usize] && !is_held[constraint.j as usize];
                is_free.then(|| (constraint.i.min(constraint.j), constraint.i.max(constraint.j)))
            })
        };
        let pattern = compress(is_held.len(), free_pairs());
        let pose_at = fill_reducing_order(&pattern).map_err(|_| PoseGraphError::OutOfMemory)?;
        let mut position_of = vec![0u32; pose_at.len()];
        for (position, &pose) in pose_at.iter().enumerate() {
            position_of[pose as usize] = position as u32;
        }
        let couplings = free_pairs()
            .map(|pair| {
                pair.map(|(i, j)| {
                    let (a, b) = (position_of[i as usize], position_of[j as usize]);
                    (a.min(b), a.max(b))
                })
            })
            .collect();
        Ok(Self { pose_at, position_of, couplings, is_held })
    }

    pub fn num_poses(&self) -> usize {
        self.pose_at.len()
    }

    pub fn is_held(&self, pose: usize) -> bool {
        self.is_held[pose]
    }
}

/// Sorted, unique neighbours by column: the larger index is the column, the smaller one the row (upper triangle).
fn compress(num_columns: usize, pairs: impl Iterator<Item = Option<(u32, u32)>>) -> ColumnPattern {
    let mut sorted: Vec<(u32, u32)> = pairs.flatten().map(|(row, column)| (column, row)).collect();
    sorted.sort_unstable();
    sorted.dedup();
    let mut column_starts = vec![0u32; num_columns + 1];
    for &(column, _) in &sorted {
        column_starts[column as usize + 1] += 1;
    }
    for column in 0..num_columns {
        column_starts[column + 1] += column_starts[column];
    }
    ColumnPattern { column_starts, rows: sorted.into_iter().map(|(_, row)| row).collect() }
}

/// Place of a constraint's off-diagonal block.
#[derive(Clone, Copy)]
struct BlockSlot {
    /// Block column; `u32::MAX` when a held pose makes the block vanish.
    column: u32,
    /// Which off-diagonal block of the column.
    ordinal: u32,
    /// True when the block of rows i and columns j must be stored transposed.
    is_transposed: bool,
}

const NO_COLUMN: u32 = u32::MAX;

/// Normal equations of one block size, filled, factorised and solved again and again.
pub(super) struct NormalEquations<const D: usize> {
    position_of: Vec<u32>,
    pose_at: Vec<u32>,
    is_held: Vec<bool>,
    slots: Vec<BlockSlot>,
    triangle: Triangle,
    scalar_pattern: SymbolicSparseColMat<u32>,
    values: Vec<f64>,
    /// b, then the solution, in elimination order.
    right_hand_side: Vec<f64>,
    cholesky: SparseCholesky,
}

impl<const D: usize> NormalEquations<D> {
    /// Lays the blocks out and analyses the pattern.
    pub fn new(pattern: &BlockPattern, constraints: &[PoseConstraint]) -> Result<Self, PoseGraphError> {
        Self::with_columns(pattern, constraints, false)
    }

    /// As [`NormalEquations::new`], `by_columns` in the layout that [`NormalEquations::inverse_diagonal`] needs.
    pub fn with_columns(
        pattern: &BlockPattern,
        constraints: &[PoseConstraint],
        by_columns: bool,
    ) -> Result<Self, PoseGraphError> {
        let num_poses = pattern.num_poses();
        let upper_blocks = compress(num_poses, pattern.couplings.iter().copied());
        let upper = scalar_pattern::<D>(&upper_blocks, Triangle::Upper);
        let cholesky =
            SparseCholesky::analyze(&upper, by_columns).map_err(|_| PoseGraphError::OutOfMemory)?;
        let triangle = cholesky.triangle();
        let (blocks, scalar_pattern) = match triangle {
            Triangle::Upper => (upper_blocks, upper),
            Triangle::Lower => {
                let flipped = pattern.couplings.iter().map(|pair| pair.map(|(small, large)| (large, small)));
                let lower_blocks = compress(num_poses, flipped);
                let lower = scalar_pattern::<D>(&lower_blocks, Triangle::Lower);
                (lower_blocks, lower)
            }
        };
        let slots = find_slots(pattern, constraints, &blocks, triangle);
        let num_values = scalar_pattern.row_idx().len();
        Ok(Self {
            position_of: pattern.position_of.clone(),
            pose_at: pattern.pose_at.clone(),
            is_held: pattern.is_held.clone(),
            slots,
            triangle,
            values: vec![0.0; num_values],
            right_hand_side: vec![0.0; D * num_poses],
            scalar_pattern,
            cholesky,
        })
    }

    /// Sets H to the identity on held poses and zero elsewhere, b to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.right_hand_side.fill(0.0);
        for pose in 0..self.is_held.len() {
            if self.is_held[pose] {
                self.add_to_diagonal(pose, &SMatrix::identity());
            }
        }
    }

    /// Adds what one constraint between poses i and j says: three blocks of H and two of b.
    pub fn add_constraint(
        &mut self,
        constraint: usize,
        (i, j): (usize, usize),
        (h_ii, h_ij, h_jj): (&SMatrix<f64, D, D>, &SMatrix<f64, D, D>, &SMatrix<f64, D, D>),
        (b_i, b_j): (&SVector<f64, D>, &SVector<f64, D>),
    ) {
        if !self.is_held[i] {
            self.add_to_diagonal(i, h_ii);
            self.add_to_right_hand_side(i, b_i);
        }
        if !self.is_held[j] {
            self.add_to_diagonal(j, h_jj);
            self.add_to_right_hand_side(j, b_j);
        }
        let slot = self.slots[constraint];
        if slot.column == NO_COLUMN {
            return;
        }
        if slot.is_transposed {
            self.add_off_diagonal(slot, &h_ij.transpose());
        } else {
            self.add_off_diagonal(slot, h_ij);
        }
    }

    /// Multiplies the diagonal by 1 + `damping` (Marquardt's scaling).
    pub fn damp(&mut self, damping: f64) {
        for unknown in 0..self.right_hand_side.len() {
            let diagonal = self.diagonal_index(unknown);
            self.values[diagonal] *= 1.0 + damping;
        }
    }

    /// Factorises H.
    ///
    /// # Errors
    /// `NotPositiveDefinite` with the pose, `OutOfMemory`.
    pub fn factorize(&mut self) -> Result<(), PoseGraphError> {
        self.cholesky.factorize(&self.scalar_pattern, &self.values).map_err(|error| match error {
            FactorError::OutOfMemory => PoseGraphError::OutOfMemory,
            FactorError::NotPositiveDefinite { unknown } => {
                let position = (unknown / D).min(self.pose_at.len() - 1);
                PoseGraphError::NotPositiveDefinite { pose: self.pose_at[position] as usize }
            }
        })
    }

    /// Solves H y = b for the b collected so far; read y with [`NormalEquations::solution`].
    pub fn solve(&mut self) {
        self.cholesky.solve_in_place(&mut self.right_hand_side);
    }

    /// y of one pose.
    pub fn solution(&self, pose: usize) -> SVector<f64, D> {
        let first = D * self.position_of[pose] as usize;
        SVector::from_column_slice(&self.right_hand_side[first..first + D])
    }

    /// Covariance blocks between each of `others` (rows) and a pose (columns); empty unless laid out by columns.
    pub fn inverse_blocks(
        &self,
        pose: usize,
        others: &[u32],
        workspace: &mut Workspace<D>,
    ) -> Vec<SMatrix<f64, D, D>> {
        let first = |pose: usize| D * self.position_of[pose] as usize;
        let Some(factor) = self.cholesky.columns() else { return Vec::new() };
        let wanted: Vec<usize> = others.iter().map(|&other| first(other as usize)).collect();
        factor.inverse_blocks(first(pose), &wanted, workspace)
    }

    /// Memory for [`NormalEquations::inverse_blocks`].
    pub fn workspace(&self) -> Workspace<D> {
        Workspace::new(self.right_hand_side.len())
    }

    /// Diagonal blocks of H⁻¹ for all poses; `None` unless laid out by columns.
    pub fn inverse_diagonal(&self) -> Option<Vec<SMatrix<f64, D, D>>> {
        let inverse = self.cholesky.columns()?.inverse_on_pattern();
        let block = |&position: &u32| {
            let first = D * position as usize;
            let entry =
                |row: usize, column: usize| inverse.get(first + row.max(column), first + row.min(column));
            SMatrix::from_fn(|row, column| entry(row, column).unwrap_or_default())
        };
        Some(self.position_of.iter().map(block).collect())
    }

    pub fn is_held(&self, pose: usize) -> bool {
        self.is_held[pose]
    }

    fn diagonal_index(&self, unknown: usize) -> usize {
        let starts = self.scalar_pattern.col_ptr();
        match self.triangle {
            Triangle::Lower => starts[unknown] as usize,
            Triangle::Upper => starts[unknown + 1] as usize - 1,
        }
    }

    fn add_to_diagonal(&mut self, pose: usize, block: &SMatrix<f64, D, D>) {
        let first = D * self.position_of[pose] as usize;
        for k in 0..D {
            let diagonal = self.diagonal_index(first + k);
            match self.triangle {
                Triangle::Lower => (k..D).for_each(|row| self.values[diagonal + row - k] += block[(row, k)]),
                Triangle::Upper => (0..=k).for_each(|row| self.values[diagonal + row - k] += block[(row, k)]),
            }
        }
    }

    fn add_off_diagonal(&mut self, slot: BlockSlot, block: &SMatrix<f64, D, D>) {
        for k in 0..D {
            let start = self.scalar_pattern.col_ptr()[D * slot.column as usize + k] as usize;
            let head = if self.triangle == Triangle::Lower { D - k } else { 0 };
            let first = start + head + D * slot.ordinal as usize;
            for (value, addend) in self.values[first..first + D].iter_mut().zip(block.column(k).iter()) {
                *value += addend;
            }
        }
    }

    fn add_to_right_hand_side(&mut self, pose: usize, block: &SVector<f64, D>) {
        let first = D * self.position_of[pose] as usize;
        for (value, addend) in self.right_hand_side[first..first + D].iter_mut().zip(block.iter()) {
            *value += addend;
        }
    }
}

/// Expands blocks to unknowns: every block column becomes D columns, the diagonal block a triangle.
fn scalar_pattern<const D: usize>(blocks: &ColumnPattern, triangle: Triangle) -> SymbolicSparseColMat<u32> {
    let num_blocks = blocks.column_starts.len() - 1;
    let num_unknowns = D * num_blocks;
    let mut column_starts = Vec::with_capacity(num_unknowns + 1);
    let mut rows = Vec::with_capacity(D * D * blocks.rows.len() + num_blocks * D * (D + 1) / 2);
    column_starts.push(0);
    for column in 0..num_blocks {
        let range = blocks.column_starts[column] as usize..blocks.column_starts[column + 1] as usize;
        let own = (D * column) as u32;
        for k in 0..D as u32 {
            if triangle == Triangle::Lower {
                rows.extend(own + k..own + D as u32);
            }
            for &block_row in &blocks.rows[range.clone()] {
                rows.extend(D as u32 * block_row..D as u32 * (block_row + 1));
            }
            if triangle == Triangle::Upper {
                rows.extend(own..=own + k);
            }
            column_starts.push(rows.len() as u32);
        }
    }
    SymbolicSparseColMat::new_checked(num_unknowns, num_unknowns, column_starts, None, rows)
}

/// Finds the block of every constraint in the compressed columns.
fn find_slots(
    pattern: &BlockPattern,
    constraints: &[PoseConstraint],
    blocks: &ColumnPattern,
    triangle: Triangle,
) -> Vec<BlockSlot> {
    let find = |(constraint, coupling): (&PoseConstraint, &Option<(u32, u32)>)| {
        let Some((small, large)) = *coupling else {
            return BlockSlot { column: NO_COLUMN, ordinal: 0, is_transposed: false };
        };
        let (row, column) = if triangle == Triangle::Upper { (small, large) } else { (large, small) };
        let start = blocks.column_starts[column as usize] as usize;
        let end = blocks.column_starts[column as usize + 1] as usize;
        let ordinal = blocks.rows[start..end].partition_point(|&other| other < row) as u32;
        let is_transposed = pattern.position_of[constraint.i as usize] != row;
        BlockSlot { column, ordinal, is_transposed }
    };
    constraints.iter().zip(&pattern.couplings).map(find).collect()
}
