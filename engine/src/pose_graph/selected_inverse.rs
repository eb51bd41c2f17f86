//! Entries of the inverse of a factorised matrix, without the rest of it.

use nalgebra::SMatrix;

/// A factor L in compressed columns with sorted rows, the diagonal first in each.
#[derive(Clone, Copy)]
pub(super) struct ColumnFactor<'a> {
    pub starts: &'a [u32],
    pub rows: &'a [u32],
    pub values: &'a [f64],
}

impl<'a> ColumnFactor<'a> {
    pub fn num_unknowns(&self) -> usize {
        self.starts.len() - 1
    }

    /// The entries of the inverse where the factor has entries (Takahashi's recursion). Costs about as much as the
    /// factorisation, whatever the number of unknowns.
    pub fn inverse_on_pattern(&self) -> SelectedInverse<'a> {
        let Self { starts, rows, values } = *self;
        let mut inverse = vec![0.0; values.len()];
        // Place of a row within the column at hand; 0 where it has no entry.
        let mut place = vec![0usize; self.num_unknowns()];
        let mut sums: Vec<f64> = Vec::new();
        for column in (0..self.num_unknowns()).rev() {
            let (start, end) = (starts[column] as usize, starts[column + 1] as usize);
            let (below, factor) = (&rows[start + 1..end], &values[start + 1..end]);
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
            let pivot = values[start].recip();
            let mut diagonal = pivot * pivot;
            for (index, &row) in below.iter().enumerate() {
                let entry = -pivot * sums[index + 1];
                inverse[start + 1 + index] = entry;
                diagonal -= pivot * factor[index] * entry;
                place[row as usize] = 0;
            }
            inverse[start] = diagonal;
        }
        SelectedInverse { starts, rows, inverse }
    }

    /// Blocks of the inverse in the columns from `first` on, at rows from each of `wanted` on; every block of unknowns
    /// must be dense.
    ///
    /// A column of the inverse is a forward and a backward substitution. Of the first only the ancestors of `first` in
    /// the elimination tree take part, of the second only those of the wanted rows: a few hundred of many thousands.
    pub fn inverse_blocks<const D: usize>(
        &self,
        first: usize,
        wanted: &[usize],
        workspace: &mut Workspace<D>,
    ) -> Vec<SMatrix<f64, D, D>> {
        let Workspace { columns, is_wanted } = workspace;
        (0..D).for_each(|k| columns[first + k][k] = 1.0);
        for unknown in self.ancestors(first) {
            let (pivot, below) = self.column(unknown);
            let value = columns[unknown].map(|value| value / pivot);
            columns[unknown] = value;
            for (row, factor) in below {
                (0..D).for_each(|k| columns[row][k] -= factor * value[k]);
            }
        }
        let mut needed: Vec<usize> = Vec::new();
        for &row in wanted {
            let is_new = |unknown: &usize| !std::mem::replace(&mut is_wanted[*unknown], true);
            needed.extend(self.ancestors(row).take_while(is_new));
        }
        needed.sort_unstable();
        for &unknown in needed.iter().rev() {
            let (pivot, below) = self.column(unknown);
            let mut value = columns[unknown];
            for (row, factor) in below {
                (0..D).for_each(|k| value[k] -= factor * columns[row][k]);
            }
            columns[unknown] = value.map(|value| value / pivot);
        }
        let block = |&row: &usize| SMatrix::from_fn(|offset, k| columns[row + offset][k]);
        let blocks = wanted.iter().map(block).collect();
        for unknown in self.ancestors(first).chain(needed) {
            columns[unknown] = [0.0; D];
            is_wanted[unknown] = false;
        }
        blocks
    }

    /// The diagonal of a column, and what stands below it.
    fn column(&self, column: usize) -> (f64, impl Iterator<Item = (usize, f64)> + use<'a>) {
        let (start, end) = (self.starts[column] as usize, self.starts[column + 1] as usize);
        let below = self.rows[start + 1..end].iter().map(|&row| row as usize);
        (self.values[start], below.zip(self.values[start + 1..end].iter().copied()))
    }

    /// An unknown and all that its column reaches: its way to the root of the elimination tree, ascending.
    fn ancestors(&self, unknown: usize) -> impl Iterator<Item = usize> + use<'a> {
        let Self { starts, rows, .. } = *self;
        let parent = move |&unknown: &usize| {
            let below = starts[unknown] as usize + 1;
            (below < starts[unknown + 1] as usize).then(|| rows[below] as usize)
        };
        std::iter::successors(Some(unknown), parent)
    }
}

/// Memory for [`ColumnFactor::inverse_blocks`], all zero between two calls.
pub(super) struct Workspace<const D: usize> {
    columns: Vec<[f64; D]>,
    is_wanted: Vec<bool>,
}

impl<const D: usize> Workspace<D> {
    pub fn new(num_unknowns: usize) -> Self {
        Self { columns: vec![[0.0; D]; num_unknowns], is_wanted: vec![false; num_unknowns] }
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
