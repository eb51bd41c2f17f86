//! Sorting pairs of (key, position) by key, the bulk of building an index.

/// Bits sorted at a time: 2¹¹ counters stay in the nearest cache.
const DIGIT_BITS: u32 = 11;

/// Sorts by the lowest `num_bits` bits of the keys, keeping the order of equal keys. Linear in the number of pairs.
pub(super) fn sort_by_key(mut pairs: Vec<(u64, u32)>, num_bits: u32) -> Vec<(u64, u32)> {
    let num_digits = num_bits.div_ceil(DIGIT_BITS);
    let mut sorted = vec![(0, 0); pairs.len()];
    for digit in 0..num_digits {
        let shift = digit * DIGIT_BITS;
        let digit_of = |key: u64| (key >> shift) as usize & ((1 << DIGIT_BITS) - 1);
        let mut starts = [0usize; 1 << DIGIT_BITS];
        pairs.iter().for_each(|pair| starts[digit_of(pair.0)] += 1);
        if starts.contains(&pairs.len()) {
            continue;
        }
        let mut total = 0;
        for start in &mut starts {
            total += std::mem::replace(start, total);
        }
        for &pair in &pairs {
            let start = &mut starts[digit_of(pair.0)];
            sorted[*start] = pair;
            *start += 1;
        }
        std::mem::swap(&mut pairs, &mut sorted);
    }
    pairs
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn it_sorts_as_the_standard_library_does() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for num_bits in [1, 11, 12, 40, 64] {
            let pairs: Vec<(u64, u32)> =
                (0..2000).map(|position| (rng.random::<u64>() >> (64 - num_bits), position)).collect();
            let mut expected = pairs.clone();
            expected.sort_by_key(|pair| pair.0);
            assert_eq!(sort_by_key(pairs, num_bits), expected);
        }
        assert!(sort_by_key(Vec::new(), 64).is_empty());
    }
}
