//! Groups of open cells: is there one large enough to be an opening into the unknown (thesis Algorithm 3.1, with the
//! tolerance of SPEC section 3)?

/// Open cells of one fill, as (row, column), and the buffers to group them.
#[derive(Clone, Debug, Default)]
pub(super) struct Openings {
    cells: Vec<(usize, usize)>,
    waiting: Vec<(usize, usize)>,
}

impl Openings {
    /// Forgets all cells.
    pub fn clear(&mut self) {
        self.cells.clear();
    }

    /// Adds cells, each once.
    pub fn extend(&mut self, cells: impl Iterator<Item = (usize, usize)>) {
        self.cells.extend(cells);
    }

    /// Whether more than `most` cells hang together over edges or corners. Uses the cells up. O(n log n), as groups are
    /// looked up in the sorted list.
    pub fn has_larger_than(&mut self, most: u32) -> bool {
        self.cells.sort_unstable();
        // A cell that was taken into a group stays in the list, marked.
        let mut is_taken = vec![false; self.cells.len()];
        for first in 0..self.cells.len() {
            if std::mem::replace(&mut is_taken[first], true) {
                continue;
            }
            self.waiting.clear();
            self.waiting.push(self.cells[first]);
            let mut num_cells = 0;
            while let Some((row, column)) = self.waiting.pop() {
                num_cells += 1;
                if num_cells > most {
                    return true;
                }
                for beside in row.saturating_sub(1)..=row + 1 {
                    let from = self.cells.partition_point(|&cell| cell < (beside, column.saturating_sub(1)));
                    let touching =
                        self.cells[from..].iter().take_while(|&&cell| cell <= (beside, column + 1));
                    for (taken, &cell) in is_taken[from..].iter_mut().zip(touching) {
                        if !std::mem::replace(taken, true) {
                            self.waiting.push(cell);
                        }
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_cells_that_touch_make_an_opening() {
        let mut openings = Openings::default();
        openings.extend([(0, 0), (5, 5), (1, 1), (5, 7), (2, 1), (8, 0)].into_iter());
        assert!(openings.has_larger_than(2));
        assert!(!openings.has_larger_than(3));
        openings.clear();
        assert!(!openings.has_larger_than(0));
    }
}
