//! A row of cells as bits; the flood fill and the sums work on whole rows.

/// `64 · W` cells of one row; bit `i` of the row is bit `i mod 64` of word `i / 64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BitRow<const W: usize>(pub [u64; W]);

impl<const W: usize> BitRow<W> {
    /// No cell.
    pub const EMPTY: Self = Self([0; W]);

    /// The cells `first..=last`.
    #[inline(always)]
    pub fn range(first: usize, last: usize) -> Self {
        let upto = |end: usize, word: usize| match end.saturating_sub(word * 64) {
            0 => 0,
            count if count >= 64 => u64::MAX,
            count => (1 << count) - 1,
        };
        Self(std::array::from_fn(|word| upto(last + 1, word) & !upto(first, word)))
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&word| word == 0)
    }

    #[inline(always)]
    pub fn insert(&mut self, cell: usize) {
        self.0[cell >> 6] |= 1 << (cell & 63);
    }

    #[inline(always)]
    pub fn and(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & other.0[word]))
    }

    #[inline(always)]
    pub fn and_not(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & !other.0[word]))
    }

    #[inline(always)]
    pub fn or(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] | other.0[word]))
    }

    #[inline(always)]
    pub fn count(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// Every cell together with its left and right neighbour.
    #[inline(always)]
    pub fn widened(&self) -> Self {
        Self(std::array::from_fn(|word| {
            let from_below = if word > 0 { self.0[word - 1] >> 63 } else { 0 };
            let from_above = if word + 1 < W { self.0[word + 1] << 63 } else { 0 };
            self.0[word] | self.0[word] << 1 | from_below | self.0[word] >> 1 | from_above
        }))
    }

    /// The cells of `mask` that hang together, along the row, with a cell of `self`, itself within `mask`.
    #[inline(always)]
    pub fn spread_within(&self, mask: &Self) -> Self {
        let up = self.spread_up(mask);
        up.or(&self.mirrored().spread_up(&mask.mirrored()).mirrored())
    }

    /// Adding seeds to their mask carries to the end of each run: what the sum flips is reached.
    #[inline(always)]
    fn spread_up(&self, mask: &Self) -> Self {
        let mut carry = false;
        Self(std::array::from_fn(|word| {
            let (sum, first) = mask.0[word].overflowing_add(self.0[word]);
            let (sum, second) = sum.overflowing_add(u64::from(carry));
            carry = first | second;
            ((sum ^ mask.0[word]) | self.0[word]) & mask.0[word]
        }))
    }

    #[inline(always)]
    fn mirrored(&self) -> Self {
        Self(std::array::from_fn(|word| self.0[W - 1 - word].reverse_bits()))
    }

    /// Calls `act(start, end)` for every run of cells `start..end`.
    #[inline(always)]
    pub fn for_each_run(&self, mut act: impl FnMut(usize, usize)) {
        let mut open = None;
        for (word, &bits) in self.0.iter().enumerate() {
            // Cells still to be named; below them all is named or empty.
            let mut left = bits;
            if let Some(start) = open {
                let len = (!left).trailing_zeros() as usize;
                if len == 64 {
                    continue;
                }
                act(start, word * 64 + len);
                left &= u64::MAX << len;
                open = None;
            }
            while left != 0 {
                let start = word * 64 + left.trailing_zeros() as usize;
                let filled = left | (left - 1);
                let len = (!filled).trailing_zeros() as usize;
                if len == 64 {
                    open = Some(start);
                    break;
                }
                act(start, word * 64 + len);
                left &= u64::MAX << len;
            }
        }
        if let Some(start) = open {
            act(start, W * 64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn spreads_like_a_walk_along_the_row(mask in any::<[u64; 2]>(), more in any::<[u64; 2]>(), seed in any::<[u64; 2]>()) {
            let mask = BitRow(mask).or(&BitRow(more));
            let seed = BitRow(seed).and(&mask);
            let mut expected = seed;
            for _ in 0..128 {
                expected = expected.widened().and(&mask);
            }
            prop_assert_eq!(seed.spread_within(&mask), expected);
        }

        #[test]
        fn runs_cover_the_row(row in any::<[u64; 2]>()) {
            let row = BitRow(row);
            let mut covered = BitRow::<2>::EMPTY;
            row.for_each_run(|start, end| covered = covered.or(&BitRow::range(start, end - 1)));
            prop_assert_eq!(covered, row);
        }
    }
}
