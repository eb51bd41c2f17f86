//! Occupancies 0..=15 of many cells as four planes of bits, so that 256 are updated by a few word operations.
//!
//! ```text
//! plane 3  0 0 1 1   ┐
//! plane 2  0 0 0 1   │ one column is one cell: 0, 3, 8, 15
//! plane 1  0 1 0 1   │
//! plane 0  0 1 0 1   ┘
//! ```

use pulp::{Scalar, Simd};

/// Words of a block: what wide registers hold.
pub(super) const BLOCK_WORDS: usize = 4;

/// One bit of each of 256 cells, in the order of the cells.
pub(super) type Bits = [u64; BLOCK_WORDS];

/// Occupancies of 256 cells; element `p` holds bit `p` of each.
pub(super) type Planes = [Bits; 4];

/// 256 cells of one occupancy.
pub(super) fn filled(occupancy: u8) -> Planes {
    std::array::from_fn(|plane| [all_if(has_bit(occupancy, plane)); BLOCK_WORDS])
}

/// Amounts, at most 15, that the occupancy of a cell changes by.
#[derive(Clone, Copy)]
pub(super) struct Change {
    pub subtracted: u8,
    pub added: u8,
}

impl Change {
    /// Takes from every cell in `lower`, not below 0, then adds to every cell in `raise`, not above 15.
    #[inline(always)]
    pub fn apply<S: Simd>(self, simd: S, planes: &mut Planes, lower: &Bits, raise: &Bits) {
        let ((lower, last_lower), (raise, last_raise)) = (S::as_simd_u64s(lower), S::as_simd_u64s(raise));
        let [(p0, l0), (p1, l1), (p2, l2), (p3, l3)] =
            planes.each_mut().map(|plane| S::as_mut_simd_u64s(plane));
        self.apply_lanes(simd, [p0, p1, p2, p3], lower, raise);
        // What is too short for the registers.
        self.apply_lanes(Scalar, [l0, l1, l2, l3], last_lower, last_raise);
    }

    #[inline(always)]
    fn apply_lanes<S: Simd>(
        self,
        simd: S,
        mut planes: [&mut [S::u64s]; 4],
        lower: &[S::u64s],
        raise: &[S::u64s],
    ) {
        for (at, (&lower, &raise)) in lower.iter().zip(raise).enumerate() {
            let mut borrow = simd.splat_u64s(0);
            for (bit, plane) in planes.iter_mut().enumerate() {
                let old = simd.not_u64s(plane[at]);
                plane[at] =
                    simd.not_u64s(sum_bit(simd, old, &mut borrow, has_bit(self.subtracted, bit), lower));
            }
            let mut carry = simd.splat_u64s(0);
            for (bit, plane) in planes.iter_mut().enumerate() {
                let old = simd.and_u64s(plane[at], simd.not_u64s(borrow));
                plane[at] = sum_bit(simd, old, &mut carry, has_bit(self.added, bit), raise);
            }
            for plane in &mut planes {
                plane[at] = simd.or_u64s(plane[at], carry);
            }
        }
    }
}

/// One bit of a sum, of which `mask` is a summand if it `is_added`. A difference is the complement of the sum with a
/// complement.
#[inline(always)]
fn sum_bit<S: Simd>(simd: S, old: S::u64s, carry: &mut S::u64s, is_added: bool, mask: S::u64s) -> S::u64s {
    let half = simd.xor_u64s(old, *carry);
    let carried = simd.and_u64s(old, *carry);
    if is_added {
        *carry = simd.or_u64s(carried, simd.and_u64s(half, mask));
        simd.xor_u64s(half, mask)
    } else {
        *carry = carried;
        half
    }
}

/// Sets every cell in `mask`, of the 64 cells of a word, to `occupancy`.
#[inline(always)]
pub(super) fn set(planes: &mut Planes, word: usize, mask: u64, occupancy: u8) {
    for (plane, bits) in planes.iter_mut().enumerate() {
        bits[word] = bits[word] & !mask | mask & all_if(has_bit(occupancy, plane));
    }
}

/// The cells whose occupancy is below `limit`, at most 15.
#[inline(always)]
pub(super) fn below(planes: &Planes, limit: u8) -> Bits {
    // The borrow of occupancy − limit.
    let mut borrow = [0; BLOCK_WORDS];
    for (plane, bits) in planes.iter().enumerate() {
        let taken = all_if(has_bit(limit, plane));
        for (borrow, bits) in borrow.iter_mut().zip(bits) {
            *borrow = (*borrow | !bits & taken) & (!bits | taken);
        }
    }
    borrow
}

/// The occupancy of one cell, of 256.
pub(super) fn get(planes: &Planes, cell: usize) -> u8 {
    let bit_of = |bits: &Bits| (bits[cell >> 6] >> (cell & 63) & 1) as u8;
    planes.iter().enumerate().map(|(plane, bits)| bit_of(bits) << plane).sum()
}

#[inline(always)]
fn has_bit(number: u8, bit: usize) -> bool {
    number >> bit & 1 == 1
}

/// All bits of a word, or none: a choice without branches.
#[inline(always)]
fn all_if(condition: bool) -> u64 {
    u64::from(condition).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, WithSimd};

    use super::*;

    /// One cell of a block changes; the others must not.
    struct OneCell {
        occupancy: u8,
        change: Change,
    }

    impl WithSimd for OneCell {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let (start, one, cell) = (filled(self.occupancy), [0, 0, 1 << 63, 0], 2 * 64 + 63);
            let (mut up, mut down) = (start, start);
            self.change.apply(simd, &mut up, &[0; BLOCK_WORDS], &one);
            self.change.apply(simd, &mut down, &one, &[0; BLOCK_WORDS]);
            assert_eq!(get(&up, cell), (self.occupancy + self.change.added).min(15));
            assert_eq!(get(&down, cell), self.occupancy.saturating_sub(self.change.subtracted));
            for other in [0, 64, 128, 190, 192, 255] {
                assert_eq!(get(&up, other), self.occupancy, "a cell outside the mask changed");
                assert_eq!(get(&down, other), self.occupancy, "a cell outside the mask changed");
            }
        }
    }

    #[test]
    fn counts_like_numbers_for_every_occupancy_and_amount() {
        for (occupancy, amount) in
            (0..16u8).flat_map(|occupancy| (0..16u8).map(move |amount| (occupancy, amount)))
        {
            let change = Change { subtracted: amount, added: amount };
            Arch::new().dispatch(OneCell { occupancy, change });
            Scalar.vectorize(OneCell { occupancy, change });
            let mut put = filled(occupancy);
            set(&mut put, 3, 1 << 63, amount);
            assert_eq!((get(&put, 255), get(&put, 254), get(&put, 0)), (amount, occupancy, occupancy));
            let expected = if occupancy < amount { u64::MAX } else { 0 };
            assert_eq!(below(&filled(occupancy), amount), [expected; BLOCK_WORDS]);
        }
    }
}
