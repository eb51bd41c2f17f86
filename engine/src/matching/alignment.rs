//! Fine adjustment of a matched pair of words by their raw densities (thesis 5.2.4, Eq 5.3 with SPEC 3.11).
//!
//! Classes say that two stretches are alike, not which observation of one is which of the other. Sliding one density
//! curve along the other does: the shift with the smallest mean squared difference is the alignment δ.

use crate::text::{Direction, Observation};

/// The best shift of two matched words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// δ: the later word's observation `i` (from its first) is the earlier word's observation `i + shift`, counted
    /// from its first one when driven the same way and backwards from its last one when driven the opposite way.
    pub shift: i64,
    /// Observations that overlap under this shift.
    pub num_overlapping: u32,
    /// Mean over them of the squared difference of densities, summed over kernels.
    pub mean_squared_difference: f64,
}

/// A run's observations and the stretch of a word in it, first and last inclusive.
pub type Stretch<'a> = (&'a [Observation], (u32, u32));

/// Finds δ among the shifts that keep at least half of the shorter word overlapping and lie at most `reach` beyond
/// those that keep one word inside the other. Costs the product of word size and number of shifts.
///
/// Of equally good shifts the most central one is taken, then the smaller. `None` if a stretch is not in its run.
pub fn align_words(earlier: Stretch, later: Stretch, direction: Direction, reach: u32) -> Option<Alignment> {
    let (earlier, later) = (observations_in(earlier)?, observations_in(later)?);
    let difference = earlier.len() as i64 - later.len() as i64;
    let (lowest, highest) = (difference.min(0) - i64::from(reach), difference.max(0) + i64::from(reach));
    let min_overlapping = earlier.len().min(later.len()).div_ceil(2) as u32;
    let mut shifts: Vec<i64> = (lowest..=highest).collect();
    shifts.sort_by_key(|shift| ((2 * shift - difference).abs(), *shift));
    let mut best: Option<Alignment> = None;
    for shift in shifts {
        let Some(candidate) = compare_at(earlier, later, direction, shift) else { continue };
        let is_better =
            best.as_ref().is_none_or(|best| candidate.mean_squared_difference < best.mean_squared_difference);
        if candidate.num_overlapping >= min_overlapping && is_better {
            best = Some(candidate);
        }
    }
    best
}

impl Alignment {
    /// The observation of the earlier word that the later word's observation `offset` is, as an offset from the
    /// earlier word's first; `None` outside that word.
    pub fn earlier_offset(&self, offset: u32, earlier_size: u32, direction: Direction) -> Option<u32> {
        let along = u32::try_from(i64::from(offset) + self.shift).ok()?;
        match direction {
            Direction::Same => (along < earlier_size).then_some(along),
            Direction::Opposite => (earlier_size.checked_sub(1)?).checked_sub(along),
        }
    }
}

fn observations_in<'a>((run, (first, last)): Stretch<'a>) -> Option<&'a [Observation]> {
    run.get(first as usize..=last as usize).filter(|stretch| !stretch.is_empty())
}

fn compare_at(
    earlier: &[Observation],
    later: &[Observation],
    direction: Direction,
    shift: i64,
) -> Option<Alignment> {
    let first = (-shift).clamp(0, later.len() as i64) as usize;
    let last = (earlier.len() as i64 - shift).clamp(first as i64, later.len() as i64) as usize;
    let mut sum = 0.0;
    for (offset, observation) in later[first..last].iter().enumerate() {
        let along = (first as i64 + offset as i64 + shift) as usize;
        let counterpart = match direction {
            Direction::Same => &earlier[along],
            Direction::Opposite => &earlier[earlier.len() - 1 - along],
        };
        sum += squared_difference(&observation.densities, &counterpart.densities);
    }
    let num_overlapping = (last - first) as u32;
    (num_overlapping > 0).then(|| Alignment {
        shift,
        num_overlapping,
        mean_squared_difference: sum / f64::from(num_overlapping),
    })
}

fn squared_difference(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::Pose2;

    /// A run whose densities are given.
    pub fn run_of(densities: impl IntoIterator<Item = f32>) -> Vec<Observation> {
        let observation = |(idx, density): (usize, f32)| Observation {
            scan_seq: idx as u64,
            timestamp_ns: 0,
            travel_m: idx as f64 * 0.1,
            odom_from_robot: Pose2::identity(),
            run_from_robot: Pose2::identity(),
            densities: vec![density],
            is_hard: true,
            num_frontiers: 0,
        };
        densities.into_iter().enumerate().map(observation).collect()
    }

    fn bumpy(meter: f32) -> f32 {
        0.5 + 0.2 * (meter * 1.3).sin() + 0.1 * (meter * 3.7).cos()
    }

    #[test]
    fn a_shifted_curve_is_shifted_back() {
        let earlier = run_of((0..60).map(|idx| bumpy(idx as f32 * 0.1)));
        let later = run_of((0..60).map(|idx| bumpy(idx as f32 * 0.1 + 0.7)));
        let aligned = align_words((&earlier, (10, 49)), (&later, (10, 49)), Direction::Same, 10).unwrap();
        assert_eq!(aligned.shift, 7);
        assert_eq!(aligned.num_overlapping, 33);
        assert!(aligned.mean_squared_difference < 1e-10);
    }

    #[test]
    fn the_opposite_way_is_read_backwards() {
        let earlier = run_of((0..40).map(|idx| bumpy(idx as f32 * 0.1)));
        let later = run_of((0..30).map(|idx| bumpy(3.5 - idx as f32 * 0.1)));
        let aligned = align_words((&earlier, (0, 39)), (&later, (0, 29)), Direction::Opposite, 5).unwrap();
        assert_eq!(aligned.shift, 4);
        assert_eq!(aligned.earlier_offset(0, 40, Direction::Opposite), Some(35));
        assert_eq!(aligned.earlier_offset(29, 40, Direction::Opposite), Some(6));
    }

    #[test]
    fn longer_overlaps_do_not_lose_for_being_longer() {
        // A constant offset costs the same per sample, so the most central shift must win.
        let earlier = run_of([0.5; 20]);
        let later = run_of([0.6; 20]);
        let aligned = align_words((&earlier, (0, 19)), (&later, (0, 19)), Direction::Same, 8).unwrap();
        assert_eq!((aligned.shift, aligned.num_overlapping), (0, 20));
    }

    #[test]
    fn a_stretch_outside_its_run_has_no_alignment() {
        let run = run_of([0.5; 5]);
        assert!(align_words((&run, (0, 5)), (&run, (0, 4)), Direction::Same, 1).is_none());
        assert!(align_words((&run, (3, 2)), (&run, (0, 4)), Direction::Same, 1).is_none());
    }
}
