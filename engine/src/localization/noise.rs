//! Noise for tens of thousands of particles: eight xorshift lanes seeded by the filter's generator.
//!
//! A stream cipher per particle would cost more than the whole update. The lanes are seeded afresh from ChaCha at
//! every use, so that a filter's seed still determines every bit.

use rand::Rng;

/// Lanes that the compiler can keep in vector registers.
pub(super) const LANES: usize = 8;

/// Eight values side by side.
pub(super) type Lanes = [f32; LANES];

/// A generator of approximately normal numbers, eight at a time.
#[derive(Clone, Debug)]
pub(super) struct NoiseLanes {
    state: [u32; LANES],
}

impl NoiseLanes {
    /// Lanes seeded from a generator.
    pub fn new(rng: &mut impl Rng) -> Self {
        // A xorshift lane must not start at zero.
        Self { state: std::array::from_fn(|_| rng.next_u32() | 1) }
    }

    /// Eight numbers of mean 0 and standard deviation 1: centred sums of four bytes, so none exceeds 3.46.
    #[inline]
    pub fn normals(&mut self) -> Lanes {
        /// Standard deviation of the sum of four uniform bytes.
        const DEVIATION: f32 = 147.801;
        let mut normals = [0.0; LANES];
        for (state, normal) in self.state.iter_mut().zip(&mut normals) {
            *state ^= *state << 13;
            *state ^= *state >> 17;
            *state ^= *state << 5;
            let pairs = (*state & 0x00ff_00ff) + (*state >> 8 & 0x00ff_00ff);
            let sum = (pairs & 0xffff) + (pairs >> 16);
            *normal = (sum as i32 - 510) as f32 * (1.0 / DEVIATION);
        }
        normals
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn noise_is_nearly_normal() {
        let mut noise = NoiseLanes::new(&mut ChaCha8Rng::seed_from_u64(3));
        let values: Vec<f64> = (0..20_000).flat_map(|_| noise.normals()).map(f64::from).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        let within_one = values.iter().filter(|value| value.abs() < 1.0).count() as f64 / count;
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.02, "variance {variance}");
        assert!((within_one - 0.6827).abs() < 0.02, "share within one deviation {within_one}");
    }
}
