//! Sparse LLᵀ of a symmetric positive definite matrix: the only file that knows faer.
//!
//! The work splits in three: an ordering that keeps the factor sparse (found on blocks, one per pose, which is D
//! times smaller than on unknowns), a symbolic analysis that only depends on the pattern, and the numeric
//! factorisation that is repeated for every iteration into the same memory.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Which half of the symmetric matrix is stored, compressed by columns with sorted rows, diagonal included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Triangle {
    Upper,
    Lower,
}

/// Why a matrix could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FactorError {
    /// The pivot of this unknown is not positive.
    NotPositiveDefinite { unknown: usize },
    /// Memory or indices ran out.
    OutOfMemory,
}

/// Compressed sparse columns of one triangle, without values.
pub(super) struct ColumnPattern {
    pub column_starts: Vec<u32>,
    pub rows: Vec<u32>,
}

/// Approximate minimum degree ordering: `order[k]` is the node eliminated as k-th.
///
/// `pattern` holds one triangle of the graph in compressed columns, in any row order.
pub(super) fn fill_reducing_order(pattern: &ColumnPattern) -> Result<Vec<u32>, FactorError> {
    let num_nodes = pattern.column_starts.len() - 1;
    let (mut order, mut position) = (vec![0u32; num_nodes], vec![0u32; num_nodes]);
    let matrix = SymbolicSparseColMatRef::new_unsorted_checked(
        num_nodes,
        num_nodes,
        &pattern.column_starts,
        None,
        &pattern.rows,
    );
    let request = amd::order_maybe_unsorted_scratch::<u32>(num_nodes, pattern.rows.len());
    let mut memory = MemBuffer::try_new(request).map_err(|_| FactorError::OutOfMemory)?;
    amd::order_maybe_unsorted(
        &mut order,
        &mut position,
        matrix,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|_| FactorError::OutOfMemory)?;
    Ok(order)
}

/// A factorisation whose symbolic part and memory are reused for every matrix of one pattern.
pub(super) struct SparseCholesky {
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl SparseCholesky {
    /// Analyses a pattern given as its upper triangle, already in elimination order.
    ///
    /// Dense blocks of columns are used where they pay, unless `by_columns` asks for plain columns, which
    /// [`SparseCholesky::inverse_on_pattern`] needs.
    pub fn analyze(upper: &SymbolicSparseColMat<u32>, by_columns: bool) -> Result<Self, FactorError> {
        let threshold =
            if by_columns { SupernodalThreshold::FORCE_SIMPLICIAL } else { SupernodalThreshold::AUTO };
        let symbolic = factorize_symbolic_cholesky(
            upper.as_ref(),
            Side::Upper,
            SymmetricOrdering::Identity,
            CholeskySymbolicParams { supernodal_flop_ratio_threshold: threshold, ..Default::default() },
        )
        .map_err(|_| FactorError::OutOfMemory)?;
        let request = StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(MAX_RIGHT_HAND_SIDES, Par::Seq),
        );
        let memory = MemBuffer::try_new(request).map_err(|_| FactorError::OutOfMemory)?;
        let factor = vec![0.0; symbolic.len_val()];
        Ok(Self { symbolic, factor, memory })
    }

    /// The triangle that [`SparseCholesky::factorize`] takes without copying.
    pub fn triangle(&self) -> Triangle {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(_) => Triangle::Upper,
            SymbolicCholeskyRaw::Supernodal(_) => Triangle::Lower,
        }
    }

    /// Factorises the matrix with these values, of the triangle that [`SparseCholesky::triangle`] names.
    pub fn factorize(
        &mut self,
        pattern: &SymbolicSparseColMat<u32>,
        values: &[f64],
    ) -> Result<(), FactorError> {
        let side = match self.triangle() {
            Triangle::Upper => Side::Upper,
            Triangle::Lower => Side::Lower,
        };
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                SparseColMatRef::new(pattern.as_ref(), values),
                side,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map(|_| ())
            // faer counts failing pivots from 1 in one code path and from 0 in the other.
            .map_err(|LltError::NonPositivePivot { index }| FactorError::NotPositiveDefinite {
                unknown: index.saturating_sub(1),
            })
    }

    /// Solves for at most [`MAX_RIGHT_HAND_SIDES`] columns, stored one after the other, in place.
    pub fn solve_in_place(&mut self, columns: &mut [f64]) {
        let num_unknowns = self.symbolic.nrows();
        let num_columns = columns.len() / num_unknowns.max(1);
        debug_assert!(num_columns <= MAX_RIGHT_HAND_SIDES && num_columns * num_unknowns == columns.len());
        let right_hand_sides = MatMut::from_column_major_slice_mut(columns, num_unknowns, num_columns);
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            right_hand_sides,
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }

    /// The entries of the inverse where the factor has entries (Takahashi's recursion); `None` unless the analysis
    /// was asked for plain columns. Costs about as much as the factorisation, whatever the number of unknowns.
    pub fn inverse_on_pattern(&self) -> Option<SelectedInverse<'_>> {
        let SymbolicCholeskyRaw::Simplicial(columns) = self.symbolic.raw() else { return None };
        let (starts, rows) = (columns.col_ptr(), columns.row_idx());
        let num_unknowns = columns.ncols();
        let mut inverse = vec![0.0; self.factor.len()];
        // Place of a row within the column at hand; 0 where it has no entry.
        let mut place = vec![0usize; num_unknowns];
        let mut sums: Vec<f64> = Vec::new();
        for column in (0..num_unknowns).rev() {
            let (start, end) = (starts[column] as usize, starts[column + 1] as usize);
            let (below, factor) = (&rows[start + 1..end], &self.factor[start + 1..end]);
            sums.clear();
            sums.resize(below.len() + 1, 0.0);
            for (index, &row) in below.iter().enumerate() {
                place[row as usize] = index + 1;
            }
            for (index, &k) in below.iter().enumerate() {
                let first = starts[k as usize] as usize;
                sums[index + 1] += factor[index] * inverse[first];
                for entry in first + 1..starts[k as usize + 1] as usize {
                    let other = place[rows[entry] as usize];
                    if other > 0 {
                        sums[other] += factor[index] * inverse[entry];
                        sums[index + 1] += factor[other - 1] * inverse[entry];
                    }
                }
            }
            let pivot = self.factor[start].recip();
            let mut diagonal = pivot * pivot;
            for (index, &row) in below.iter().enumerate() {
                let entry = -pivot * sums[index + 1];
                inverse[start + 1 + index] = entry;
                diagonal -= pivot * factor[index] * entry;
                place[row as usize] = 0;
            }
            inverse[start] = diagonal;
        }
        Some(SelectedInverse { starts, rows, inverse })
    }
}

/// Entries of an inverse where the factor has entries.
pub(super) struct SelectedInverse<'a> {
    starts: &'a [u32],
    rows: &'a [u32],
    inverse: Vec<f64>,
}

impl SelectedInverse<'_> {
    /// An entry on or below the diagonal; `None` outside the pattern of the factor.
    pub fn get(&self, row: usize, column: usize) -> Option<f64> {
        let range = self.starts[column] as usize..self.starts[column + 1] as usize;
        let offset = self.rows[range.clone()].binary_search(&(row as u32)).ok()?;
        Some(self.inverse[range.start + offset])
    }
}

/// Most columns that are solved for at once.
pub(super) const MAX_RIGHT_HAND_SIDES: usize = 6;
