//! Occupancies 0..=15 of many cells as four planes of bits, so that 64 cells are updated by a few word operations.
//!
//! ```text
//! plane 3  0 0 1 1   ┐
//! plane 2  0 0 0 1   │ one column is one cell: 0, 3, 8, 15
//! plane 1  0 1 0 1   │
//! plane 0  0 1 0 1   ┘
//! ```

/// Occupancies of 64 cells; element `p` holds bit `p` of each.
pub(super) type Planes = [u64; 4];

/// 64 cells of one occupancy.
pub(super) fn filled(occupancy: u8) -> Planes {
    std::array::from_fn(|plane| if occupancy >> plane & 1 == 1 { u64::MAX } else { 0 })
}

/// Takes one from every cell in `mask`, not below 0.
pub(super) fn decrement(planes: &mut Planes, mask: u64) {
    let mut borrow = mask & (planes[0] | planes[1] | planes[2] | planes[3]);
    for plane in planes {
        let old = *plane;
        *plane = old ^ borrow;
        borrow &= !old;
    }
}

/// Adds one to every cell in `mask`, not above 15.
pub(super) fn increment(planes: &mut Planes, mask: u64) {
    let mut carry = mask & !(planes[0] & planes[1] & planes[2] & planes[3]);
    for plane in planes {
        let old = *plane;
        *plane = old ^ carry;
        carry &= old;
    }
}

/// Sets every cell in `mask` to `occupancy`.
pub(super) fn set(planes: &mut Planes, mask: u64, occupancy: u8) {
    for (bit, plane) in planes.iter_mut().enumerate() {
        *plane = if occupancy >> bit & 1 == 1 { *plane | mask } else { *plane & !mask };
    }
}

/// The cells whose occupancy is below `limit`.
pub(super) fn below(planes: &Planes, limit: u8) -> u64 {
    if limit > 15 {
        return u64::MAX;
    }
    let (mut less, mut equal) = (0, u64::MAX);
    for bit in (0..4).rev() {
        let plane = planes[bit];
        if limit >> bit & 1 == 1 {
            less |= equal & !plane;
            equal &= plane;
        } else {
            equal &= !plane;
        }
    }
    less
}

/// The occupancy of one cell.
pub(super) fn get(planes: &Planes, bit: u32) -> u8 {
    planes.iter().enumerate().map(|(plane, word)| ((word >> bit & 1) as u8) << plane).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_like_numbers_for_every_occupancy() {
        for occupancy in 0..16u8 {
            let start = filled(occupancy);
            let (mut up, mut down, mut put) = (start, start, start);
            increment(&mut up, 1 << 63);
            decrement(&mut down, 1 << 63);
            set(&mut put, 1 << 63, 9);
            assert_eq!(get(&up, 63), (occupancy + 1).min(15));
            assert_eq!(get(&down, 63), occupancy.saturating_sub(1));
            assert_eq!(get(&put, 63), 9);
            for planes in [up, down, put] {
                assert_eq!(get(&planes, 0), occupancy, "a cell outside the mask changed");
            }
            for limit in 0..=16 {
                assert_eq!(below(&start, limit) == u64::MAX, occupancy < limit);
            }
        }
    }
}
