//! Windows of one profile slid along another: Eq 5.3 as a search (SPEC section 4).

use super::profile::RunProfile;
use crate::text::Direction;

/// Columns compared at a time, so that their sums stay in the nearest cache.
const BLOCK: usize = 1024;

/// Sum over a window of the differences of densities, for every place where the window fits.
///
/// Entry `j` compares the window's samples with `earlier`'s samples `j, j + 1, …`, read backwards when the direction is
/// opposite. Differences are cut off at `largest_step`. (Eq 5.3 squares them; cut-off absolute differences retrieved
/// more on `intel`, and are cheaper.) Sums stop at the largest value they can hold. Costs window × length × kernels
/// additions, sixteen at a time.
pub(super) fn window_costs(
    later: &RunProfile,
    window: std::ops::Range<usize>,
    earlier: &RunProfile,
    direction: Direction,
    largest_step: u8,
) -> Vec<u16> {
    let num_places = (earlier.len() + 1).saturating_sub(window.len());
    let mut costs = vec![0u16; num_places];
    let mut differences = [0u8; BLOCK];
    for (block_idx, block) in costs.chunks_mut(BLOCK).enumerate() {
        for (offset, sample) in window.clone().enumerate() {
            let along = match direction {
                Direction::Same => offset,
                Direction::Opposite => window.len() - 1 - offset,
            };
            let first = block_idx * BLOCK + along;
            let differences = &mut differences[..block.len()];
            differences.fill(0);
            for (values, others) in later.channels.iter().zip(&earlier.channels) {
                add_differences(
                    differences,
                    &others[first..first + block.len()],
                    values[sample],
                    largest_step,
                );
            }
            for (cost, &difference) in block.iter_mut().zip(differences.iter()) {
                *cost = cost.saturating_add(u16::from(difference));
            }
        }
    }
    costs
}

/// Adds the differences between one value and many; free of branches so that it becomes vector code.
fn add_differences(differences: &mut [u8], others: &[u8], value: u8, largest_step: u8) {
    for (difference, &other) in differences.iter_mut().zip(others) {
        *difference = difference.saturating_add(other.abs_diff(value).min(largest_step));
    }
}

/// The `num_best` places of lowest cost, each at least `min_distance` from the better ones; ties go to the earlier.
pub(super) fn best_places(costs: &[u16], num_best: usize, min_distance: usize) -> Vec<(usize, u16)> {
    let is_lowest_nearby = |&(place, cost): &(usize, u16)| {
        let before = place.checked_sub(1).map_or(u16::MAX, |before| costs[before]);
        let after = costs.get(place + 1).copied().unwrap_or(u16::MAX);
        cost <= before && cost <= after
    };
    let mut lowest: Vec<(usize, u16)> = costs.iter().copied().enumerate().filter(is_lowest_nearby).collect();
    lowest.sort_unstable_by_key(|&(place, cost)| (cost, place));
    let mut best: Vec<(usize, u16)> = Vec::with_capacity(num_best);
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
    ) -> u16 {
        let mut sum = 0;
        for offset in 0..window.len() {
            let along = if direction == Direction::Same { offset } else { window.len() - 1 - offset };
            for (values, others) in later.channels.iter().zip(&earlier.channels) {
                let difference = values[window.start + offset].abs_diff(others[place + along]).min(limit);
                sum += u16::from(difference);
            }
        }
        sum
    }

    #[test]
    fn sliding_is_comparing_everywhere() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let limit = 13;
        for length in [5, 40, 1100] {
            let (later, earlier) = (random_profile(&mut rng, 30), random_profile(&mut rng, length));
            for direction in [Direction::Same, Direction::Opposite] {
                let costs = window_costs(&later, 4..12, &earlier, direction, limit);
                let expected: Vec<u16> = (0..(length + 1).saturating_sub(8))
                    .map(|place| cost_at((&later, 4..12), (&earlier, place), direction, limit))
                    .collect();
                assert_eq!(costs, expected);
            }
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
