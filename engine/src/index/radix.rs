//! Sorting places by their keys, the bulk of building an index.

/// Bits sorted at a time: 2¹¹ counters and as many places to write to stay in the near caches.
const DIGIT_BITS: u32 = 11;

/// Fewer are left to the standard library, which then works in the nearest cache.
const NUM_SMALL: usize = 4096;

/// A place with what it is found by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Keyed {
    pub key: u64,
    pub place: u32,
    /// Kept with the place; fits where the alignment of the key leaves room.
    pub context: [u8; 2],
}

/// Sorts by the lowest `num_bits` bits of the keys; higher bits must be zero.
///
/// The highest bits first: after one pass over all of memory every part fits into a cache.
pub(super) fn sort_by_key(items: &mut [Keyed], num_bits: u32) {
    let mut scratch = vec![Keyed::default(); items.len()];
    sort_part(items, &mut scratch, num_bits);
}

fn sort_part(items: &mut [Keyed], scratch: &mut [Keyed], num_bits: u32) {
    if items.len() <= NUM_SMALL || num_bits == 0 {
        items.sort_unstable();
        return;
    }
    let num_bits_left = num_bits.saturating_sub(DIGIT_BITS);
    let digit_of = |item: &Keyed| (item.key >> num_bits_left) as usize & ((1 << DIGIT_BITS) - 1);
    let mut ends = [0usize; 1 << DIGIT_BITS];
    items.iter().for_each(|item| ends[digit_of(item)] += 1);
    if !ends.contains(&items.len()) {
        let mut total = 0;
        for end in &mut ends {
            total += std::mem::replace(end, total);
        }
        for item in &*items {
            let end = &mut ends[digit_of(item)];
            scratch[*end] = *item;
            *end += 1;
        }
        items.copy_from_slice(scratch);
    } else {
        ends.fill(items.len());
    }
    let mut start = 0;
    for end in ends {
        if end > start {
            sort_part(&mut items[start..end], &mut scratch[start..end], num_bits_left);
            start = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn it_sorts_as_the_standard_library_does() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for num_bits in [1, 3, 11, 12, 40, 64] {
            let mut item = |place: u32| Keyed {
                key: rng.random::<u64>() >> (64 - num_bits),
                place: place ^ 5,
                context: [place as u8, 0],
            };
            let mut items: Vec<Keyed> = (0..20_000).map(&mut item).collect();
            let mut expected = items.clone();
            expected.sort();
            sort_by_key(&mut items, num_bits);
            assert_eq!(items, expected, "{num_bits} bits");
        }
        sort_by_key(&mut [], 64);
    }
}
