//! Density classes: uniform, or the modes of the site's density histogram (thesis 4.2.1, SPEC 3.5).

use serde::{Deserialize, Serialize};

/// Bins of a [`DensityHistogram`].
const NUM_BINS: usize = 256;

/// Steps after which a shift that has not settled is taken as it is.
const MAX_SHIFTS: usize = 200;

/// A partition of [0, 1] into density classes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quantizer {
    /// Lower ends of all classes but the first, rising.
    boundaries: Vec<f32>,
}

impl Quantizer {
    /// `num_classes` classes of one width.
    pub fn uniform(num_classes: u8) -> Self {
        let count = f32::from(num_classes.max(1));
        Self { boundaries: (1..num_classes).map(|class| f32::from(class) / count).collect() }
    }

    /// One class per mode of the histogram, found by mean shift; none of them smaller than `min_share`.
    ///
    /// Every bin climbs the histogram, smoothed by a Gaussian of `bandwidth`, to its mode; bins of one mode are a
    /// class. An empty histogram gives one class. Cost: bins² · shifts.
    pub fn mean_shift(histogram: &DensityHistogram, bandwidth: f64, min_share: f64) -> Self {
        let modes: Vec<f64> =
            (0..NUM_BINS).map(|bin| histogram.climb(DensityHistogram::center(bin), bandwidth)).collect();
        let mut basins: Vec<Basin> = Vec::new();
        for (bin, &mode) in modes.iter().enumerate() {
            let count = histogram.counts[bin];
            match basins.last_mut() {
                Some(basin) if mode - basin.mode <= bandwidth / 2.0 => basin.count += count,
                _ => basins.push(Basin { first_bin: bin, mode, count }),
            }
        }
        merge_small(&mut basins, (min_share * histogram.total() as f64).ceil() as u64);
        let boundaries = basins.iter().skip(1).map(|basin| basin.first_bin as f32 / NUM_BINS as f32);
        Self { boundaries: boundaries.take(usize::from(u8::MAX)).collect() }
    }

    /// Number of classes.
    pub fn num_classes(&self) -> usize {
        self.boundaries.len() + 1
    }

    /// The class of a density; values beyond [0, 1] belong to the first or the last.
    pub fn class_of(&self, density: f32) -> u8 {
        self.boundaries.partition_point(|&boundary| boundary <= density) as u8
    }

    /// Share of the histogram's observations that lie in other classes here than in `other`, in [0, 1].
    ///
    /// Classes have no names, so they are paired in order such that most observations stay; an unpaired class has
    /// moved as a whole. 0 means the same texts up to the names of the classes.
    pub fn moved_share(&self, other: &Quantizer, histogram: &DensityHistogram) -> f64 {
        let (rows, columns) = (self.num_classes(), other.num_classes());
        let mut common = vec![0u64; rows * columns];
        for (bin, &count) in histogram.counts.iter().enumerate() {
            let density = DensityHistogram::center(bin) as f32;
            common[usize::from(self.class_of(density)) * columns + usize::from(other.class_of(density))] +=
                count;
        }
        // best[c]: most observations that stay when the rows so far are paired with columns below c.
        let mut best = vec![0u64; columns + 1];
        for row in common.chunks(columns) {
            let before = best.clone();
            for (column, stay) in row.iter().enumerate() {
                best[column + 1] = before[column + 1].max(best[column]).max(before[column] + stay);
            }
        }
        let total = histogram.total();
        if total == 0 { 0.0 } else { 1.0 - best[columns] as f64 / total as f64 }
    }
}

/// Bins that climb to one mode.
#[derive(Clone, Copy, Debug)]
struct Basin {
    first_bin: usize,
    mode: f64,
    count: u64,
}

/// Joins basins below `min_count` with the neighbour whose mode is nearer, the smallest first.
fn merge_small(basins: &mut Vec<Basin>, min_count: u64) {
    while basins.len() > 1 {
        let smallest = (0..basins.len()).min_by_key(|&index| basins[index].count).unwrap_or(0);
        if basins[smallest].count >= min_count.max(1) {
            return;
        }
        let gap = |a: usize, b: usize| (basins[a].mode - basins[b].mode).abs();
        let joins_left = smallest > 0
            && (smallest + 1 == basins.len() || gap(smallest, smallest - 1) <= gap(smallest, smallest + 1));
        let left = if joins_left { smallest - 1 } else { smallest };
        let right = basins.remove(left + 1);
        if !joins_left {
            basins[left].mode = right.mode;
        }
        basins[left].count += right.count;
    }
}

/// How often each density was observed at a site.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DensityHistogram {
    counts: Vec<u64>,
}

impl Default for DensityHistogram {
    fn default() -> Self {
        Self { counts: vec![0; NUM_BINS] }
    }
}

impl DensityHistogram {
    /// Counts an observed density of the words' kernel.
    pub fn add(&mut self, density: f32) {
        let bin = (f64::from(density) * NUM_BINS as f64) as usize;
        if let Some(count) = self.counts.get_mut(bin.min(NUM_BINS - 1)) {
            *count += 1;
        }
    }

    /// Number of densities counted.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Adds another histogram's counts.
    pub fn merge(&mut self, other: &DensityHistogram) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
    }

    fn center(bin: usize) -> f64 {
        (bin as f64 + 0.5) / NUM_BINS as f64
    }

    /// Moves to the weighted mean of the surroundings until that no longer moves.
    fn climb(&self, start: f64, bandwidth: f64) -> f64 {
        let mut at = start;
        for _ in 0..MAX_SHIFTS {
            let (mut weights, mut moments) = (0.0, 0.0);
            for (bin, &count) in self.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                let offset = Self::center(bin) - at;
                let weight = count as f64 * (-0.5 * (offset / bandwidth).powi(2)).exp();
                weights += weight;
                moments += weight * offset;
            }
            if weights <= f64::MIN_POSITIVE {
                return at;
            }
            let shift = moments / weights;
            at += shift;
            if shift.abs() < 1e-5 {
                return at;
            }
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn uniform_classes_have_one_width() {
        let quantizer = Quantizer::uniform(8);
        assert_eq!(quantizer.num_classes(), 8);
        let classes: Vec<u8> =
            [0.0, 0.124, 0.125, 0.5, 0.999, 1.0].map(|density| quantizer.class_of(density)).to_vec();
        assert_eq!(classes, [0, 0, 1, 4, 7, 7]);
    }

    fn histogram_of(clusters: &[(f32, u32)]) -> DensityHistogram {
        let mut histogram = DensityHistogram::default();
        for &(center, count) in clusters {
            for step in 0..count {
                histogram.add(center + 0.02 * ((step * 7 % 11) as f32 / 10.0 - 0.5));
            }
        }
        histogram
    }

    #[test]
    fn mean_shift_finds_the_modes() {
        let quantizer =
            Quantizer::mean_shift(&histogram_of(&[(0.3, 500), (0.5, 200), (0.8, 100)]), 0.03, 0.01);
        assert_eq!(quantizer.num_classes(), 3);
        assert_eq!([0.3, 0.5, 0.8].map(|density| quantizer.class_of(density)), [0, 1, 2]);
    }

    #[test]
    fn classes_end_where_the_smoothed_histogram_is_lowest() {
        const BANDWIDTH: f64 = 0.03;
        let mut rng = ChaCha8Rng::seed_from_u64(35);
        for _ in 0..50 {
            let num_clusters = rng.random_range(1..=5usize);
            let mut densities: Vec<f32> = Vec::new();
            for cluster in 0..num_clusters {
                let middle = 0.1 + 0.18 * cluster as f32 + rng.random_range(-0.03..0.03f32);
                let count = rng.random_range(30..500);
                densities.extend((0..count).map(|_| middle + rng.random_range(-0.015..0.015f32)));
            }
            let mut histogram = DensityHistogram::default();
            densities.iter().for_each(|&density| histogram.add(density));
            // The reference climbs nothing: it samples the sum of a Gaussian per observation, and looks where it dips.
            let smoothed = |at: f64| -> f64 {
                let gauss = |density: &f32| (-0.5 * ((f64::from(*density) - at) / BANDWIDTH).powi(2)).exp();
                densities.iter().map(gauss).sum()
            };
            let samples: Vec<f64> =
                (0..=NUM_BINS).map(|edge| smoothed(edge as f64 / NUM_BINS as f64)).collect();
            let dips: Vec<usize> = (1..NUM_BINS)
                .filter(|&edge| samples[edge] < samples[edge - 1] && samples[edge] <= samples[edge + 1])
                .collect();
            assert_eq!(dips.len() + 1, num_clusters, "the clusters lie apart");
            let quantizer = Quantizer::mean_shift(&histogram, BANDWIDTH, 0.0);
            assert_eq!(quantizer.num_classes(), num_clusters);
            for (boundary, dip) in quantizer.boundaries.iter().zip(dips) {
                let distance_bins = (f64::from(*boundary) * NUM_BINS as f64 - dip as f64).abs();
                assert!(distance_bins <= 2.0, "a boundary lies {distance_bins} bins from the dip");
            }
        }
    }

    #[test]
    fn a_rare_mode_joins_its_nearer_neighbor() {
        let quantizer = Quantizer::mean_shift(&histogram_of(&[(0.3, 500), (0.6, 3), (0.8, 500)]), 0.03, 0.01);
        assert_eq!(quantizer.num_classes(), 2);
        assert_eq!([0.3, 0.6, 0.8].map(|density| quantizer.class_of(density)), [0, 1, 1]);
    }

    #[test]
    fn nothing_observed_is_one_class() {
        assert_eq!(Quantizer::mean_shift(&DensityHistogram::default(), 0.03, 0.01).num_classes(), 1);
    }

    #[test]
    fn a_new_mode_moves_only_its_observations() {
        let before = histogram_of(&[(0.3, 500), (0.5, 500)]);
        let mut after = before.clone();
        after.merge(&histogram_of(&[(0.9, 250)]));
        let (old, new) =
            (Quantizer::mean_shift(&before, 0.03, 0.01), Quantizer::mean_shift(&after, 0.03, 0.01));
        assert_eq!(old.moved_share(&old, &after), 0.0);
        assert!((new.moved_share(&old, &after) - 0.2).abs() < 1e-9);
        assert!((old.moved_share(&new, &after) - 0.2).abs() < 1e-9);
    }
}
