//! Windows of one profile slid along another: Eq 5.3 as a search (SPEC section 4).

use super::profile::RunProfile;
use crate::text::Direction;

/// Columns compared at a time, so that their sums stay in the nearest cache.
const BLOCK: usize = 512;

/// Sum over a window of the squared differences of densities, for every place where the window fits.
///
/// Entry `j` compares the window's samples with `earlier`'s samples `j, j + 1, …`, read backwards when the direction is
/// opposite. Differences are cut off at `max_difference`, so that a door or a person inside the window costs no more
/// than that. Costs window × length × kernels additions, eight at a time.
pub(super) fn window_costs(
    later: &RunProfile,
    window: std::ops::Range<usize>,
    earlier: &RunProfile,
    direction: Direction,
    max_difference: u8,
) -> Vec<u32> {
    let num_places = (earlier.len() + 1).saturating_sub(window.len());
    let mut costs = vec![0u32; num_places];
    let mut squares = [0u16; BLOCK];
    for (block_idx, block) in costs.chunks_mut(BLOCK).enumerate() {
        for (offset, sample) in window.clone().enumerate() {
            let along = match direction {
                Direction::Same => offset,
                Direction::Opposite => window.len() - 1 - offset,
            };
            let first = block_idx * BLOCK + along;
            let squares = &mut squares[..block.len()];
            squares.fill(0);
            for (values, others) in later.channels.iter().zip(&earlier.channels) {
                add_squares(squares, &others[first..first + block.len()], values[sample], max_difference);
            }
            for (cost, &square) in block.iter_mut().zip(squares.iter()) {
                *cost += u32::from(square);
            }
        }
    }
    costs
}

/// Adds the squared differences between one value and many; free of branches so that it becomes vector code.
fn add_squares(squares: &mut [u16], others: &[u8], value: u8, max_difference: u8) {
    for (square, &other) in squares.iter_mut().zip(others) {
        let difference = u16::from(other.abs_diff(value).min(max_difference));
        *square = square.wrapping_add(difference * difference);
    }
}

/// The largest cut-off whose squares over all kernels fit the sums.
pub(super) fn max_difference(num_channels: usize) -> u8 {
    let largest = f64::from(u16::MAX) / num_channels.max(1) as f64;
    largest.sqrt().floor().min(255.0) as u8
}

/// The `num_best` places of lowest cost, each at least `min_distance` from the better ones; ties go to the earlier.
pub(super) fn best_places(costs: &[u32], num_best: usize, min_distance: usize) -> Vec<(usize, u32)> {
    let is_lowest_nearby = |&(place, cost): &(usize, u32)| {
        let before = place.checked_sub(1).map_or(u32::MAX, |before| costs[before]);
        let after = costs.get(place + 1).copied().unwrap_or(u32::MAX);
        cost <= before && cost <= after
    };
    let mut lowest: Vec<(usize, u32)> = costs.iter().copied().enumerate().filter(is_lowest_nearby).collect();
    lowest.sort_unstable_by_key(|&(place, cost)| (cost, place));
    let mut best: Vec<(usize, u32)> = Vec::with_capacity(num_best);
    for (place, cost) in lowest {
        if best.len() == num_best {
            break;
        }
        if best.iter().all(|&(taken, _)| taken.abs_diff(place) >= min_distance) {
            best.push((place, cost));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn random_profile(rng: &mut ChaCha8Rng, length: usize) -> RunProfile {
        let channels = (0..3).map(|_| (0..length).map(|_| rng.random()).collect()).collect();
        RunProfile { channels, observations: (0..length as u32).collect() }
    }

    /// The definition, one place at a time.
    fn cost_at(
        (later, window): (&RunProfile, std::ops::Range<usize>),
        (earlier, place): (&RunProfile, usize),
        direction: Direction,
        limit: u8,
    ) -> u32 {
        let mut sum = 0;
        for offset in 0..window.len() {
            let along = if direction == Direction::Same { offset } else { window.len() - 1 - offset };
            for (values, others) in later.channels.iter().zip(&earlier.channels) {
                let difference = values[window.start + offset].abs_diff(others[place + along]).min(limit);
                sum += u32::from(difference).pow(2);
            }
        }
        sum
    }

    #[test]
    fn sliding_is_comparing_everywhere() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let limit = max_difference(3);
        for length in [5, 40, 1100] {
            let (later, earlier) = (random_profile(&mut rng, 30), random_profile(&mut rng, length));
            for direction in [Direction::Same, Direction::Opposite] {
                let costs = window_costs(&later, 4..12, &earlier, direction, limit);
                let expected: Vec<u32> = (0..(length + 1).saturating_sub(8))
                    .map(|place| cost_at((&later, 4..12), (&earlier, place), direction, limit))
                    .collect();
                assert_eq!(costs, expected);
            }
        }
    }

    #[test]
    fn sums_of_squares_fit_for_any_number_of_kernels() {
        for num_channels in 0..200u32 {
            let largest = u32::from(max_difference(num_channels as usize)).pow(2) * num_channels;
            assert!(largest <= u32::from(u16::MAX));
        }
    }

    #[test]
    fn the_best_places_keep_their_distance() {
        let costs = [9, 3, 4, 3, 9, 1, 2, 9, 9, 0];
        assert_eq!(best_places(&costs, 3, 2), vec![(9, 0), (5, 1), (1, 3)]);
        assert_eq!(best_places(&costs, 10, 5), vec![(9, 0), (1, 3)]);
        assert!(best_places(&[], 3, 2).is_empty());
    }
}
