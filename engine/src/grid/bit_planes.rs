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

/// Takes `amount`, at most 15, from every cell in `mask`, not below 0.
pub(super) fn subtract(planes: &mut Planes, mask: u64, amount: u8) {
    let mut borrow = 0;
    for (bit, plane) in planes.iter_mut().enumerate() {
        let taken = if amount >> bit & 1 == 1 { mask } else { 0 };
        let old = *plane;
        *plane = old ^ taken ^ borrow;
        borrow = (!old & (taken | borrow)) | (taken & borrow);
    }
    for plane in planes {
        *plane &= !borrow;
    }
}

/// Adds `amount`, at most 15, to every cell in `mask`, not above 15.
pub(super) fn add(planes: &mut Planes, mask: u64, amount: u8) {
    let mut carry = 0;
    for (bit, plane) in planes.iter_mut().enumerate() {
        let added = if amount >> bit & 1 == 1 { mask } else { 0 };
        let old = *plane;
        *plane = old ^ added ^ carry;
        carry = (old & (added | carry)) | (added & carry);
    }
    for plane in planes {
        *plane |= carry;
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
    // The borrow of occupancy − limit.
    planes.iter().enumerate().fold(
        0,
        |borrow, (bit, &plane)| {
            if limit >> bit & 1 == 1 { !plane | borrow } else { !plane & borrow }
        },
    )
}

/// The occupancy of one cell.
pub(super) fn get(planes: &Planes, bit: u32) -> u8 {
    planes.iter().enumerate().map(|(plane, word)| ((word >> bit & 1) as u8) << plane).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_like_numbers_for_every_occupancy_and_amount() {
        for (occupancy, amount) in
            (0..16u8).flat_map(|occupancy| (0..16u8).map(move |amount| (occupancy, amount)))
        {
            let start = filled(occupancy);
            let (mut up, mut down, mut put) = (start, start, start);
            add(&mut up, 1 << 63, amount);
            subtract(&mut down, 1 << 63, amount);
            set(&mut put, 1 << 63, amount);
            assert_eq!(get(&up, 63), (occupancy + amount).min(15));
            assert_eq!(get(&down, 63), occupancy.saturating_sub(amount));
            assert_eq!(get(&put, 63), amount);
            for planes in [up, down, put] {
                assert_eq!(get(&planes, 0), occupancy, "a cell outside the mask changed");
            }
            for limit in 0..=16 {
                assert_eq!(below(&start, limit) == u64::MAX, occupancy < limit);
            }
        }
    }
}
