//! Noise for tens of thousands of particles.
//!
//! A stream cipher per particle would cost more than the whole update, so a number is a hash of its place in the
//! sequence under a key. The key is drawn from the filter's generator at every use: the filter's seed still determines
//! every bit, and as no number waits for the one before, loops over particles run in vector registers.

use rand::Rng;

/// A sequence of random numbers, looked up by their place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    key: u32,
}

impl Noise {
    /// A sequence whose key is drawn from a generator.
    pub fn new(rng: &mut impl Rng) -> Self {
        Self { key: rng.next_u32() }
    }

    /// A number of mean 0 and standard deviation 1, nearly normal: a centred sum of four bytes, so none exceeds 3.46.
    #[inline(always)]
    pub fn normal(&self, index: u32) -> f32 {
        /// Standard deviation of the sum of four uniform bytes.
        const DEVIATION: f32 = 147.801;
        let bits = mixed(index ^ self.key);
        let pairs = (bits & 0x00ff_00ff) + (bits >> 8 & 0x00ff_00ff);
        let sum = (pairs & 0xffff) + (pairs >> 16);
        (sum as i32 - 510) as f32 * (1.0 / DEVIATION)
    }

    /// A number in [0, 1), uniform.
    #[inline(always)]
    pub fn uniform(&self, index: u32) -> f32 {
        (mixed(index ^ self.key) >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

/// A bijection of 32 bits in which every bit depends on all (the finaliser of MurmurHash3).
#[inline(always)]
fn mixed(bits: u32) -> u32 {
    let bits = (bits ^ bits >> 16).wrapping_mul(0x85eb_ca6b);
    let bits = (bits ^ bits >> 13).wrapping_mul(0xc2b2_ae35);
    bits ^ bits >> 16
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn mean_and_variance(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64)
    }

    #[test]
    fn noise_is_nearly_normal() {
        let noise = Noise::new(&mut ChaCha8Rng::seed_from_u64(3));
        let values: Vec<f64> = (0..160_000).map(|index| f64::from(noise.normal(index))).collect();
        let (mean, variance) = mean_and_variance(&values);
        let within_one = values.iter().filter(|value| value.abs() < 1.0).count() as f64 / values.len() as f64;
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.02, "variance {variance}");
        assert!((within_one - 0.6827).abs() < 0.02, "share within one deviation {within_one}");
    }

    #[test]
    fn uniform_noise_fills_the_unit_interval() {
        let noise = Noise::new(&mut ChaCha8Rng::seed_from_u64(4));
        let values: Vec<f64> = (0..160_000).map(|index| f64::from(noise.uniform(index))).collect();
        let (mean, variance) = mean_and_variance(&values);
        assert!((mean - 0.5).abs() < 0.005, "mean {mean}");
        assert!((variance - 1.0 / 12.0).abs() < 0.002, "variance {variance}");
        assert!(values.iter().all(|value| (0.0..1.0).contains(value)));
    }

    #[test]
    fn neighbors_and_sequences_are_independent() {
        let rng = &mut ChaCha8Rng::seed_from_u64(5);
        let (one, other) = (Noise::new(rng), Noise::new(rng));
        let correlation = |pair: &dyn Fn(u32) -> (f32, f32)| {
            let products = (0..100_000).map(|index| {
                let (first, second) = pair(index);
                f64::from(first) * f64::from(second)
            });
            products.sum::<f64>() / 100_000.0
        };
        let along = correlation(&|index| (one.normal(index), one.normal(index + 1)));
        let across = correlation(&|index| (one.normal(index), other.normal(index)));
        assert!(along.abs() < 0.02 && across.abs() < 0.02, "{along} along, {across} across");
    }
}
