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

use super::selected_inverse::ColumnFactor;

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
    /// [`SparseCholesky::columns`] needs.
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
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
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

    /// Solves in place.
    pub fn solve_in_place(&mut self, right_hand_side: &mut [f64]) {
        let num_unknowns = self.symbolic.nrows();
        debug_assert_eq!(num_unknowns, right_hand_side.len());
        let right_hand_side = MatMut::from_column_major_slice_mut(right_hand_side, num_unknowns, 1);
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            right_hand_side,
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }

    /// The factor in plain columns; `None` unless the analysis was asked for them.
    pub fn columns(&self) -> Option<ColumnFactor<'_>> {
        let SymbolicCholeskyRaw::Simplicial(columns) = self.symbolic.raw() else { return None };
        Some(ColumnFactor { starts: columns.col_ptr(), rows: columns.row_idx(), values: &self.factor })
    }
}
