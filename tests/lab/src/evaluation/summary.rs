//! Mean, spread and quantiles.

use serde::{Deserialize, Serialize};

/// Mean and standard deviation of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanSd {
    /// Arithmetic mean; 0 of nothing.
    pub mean: f64,
    /// Standard deviation (divided by n).
    pub sd: f64,
}

impl MeanSd {
    /// Of all values, summed in their order.
    pub(super) fn of(values: &[f64]) -> Self {
        if values.is_empty() {
            return Self::default();
        }
        let num = values.len() as f64;
        let mean = values.iter().sum::<f64>() / num;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / num;
        Self { mean, sd: variance.sqrt() }
    }
}

/// The smallest value that at least this share of all values does not exceed.
pub(super) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

/// `part / whole`, and 0 of nothing.
pub(super) fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_samples() {
        assert_eq!(MeanSd::of(&[1.0, 3.0]), MeanSd { mean: 2.0, sd: 1.0 });
        assert_eq!(MeanSd::of(&[]), MeanSd::default());
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.9), Some(3.0));
        assert_eq!(quantile(&[], 0.5), None);
    }
}
