//! Low-variance resampling: one random number, then even steps through the running sum of weights (Probabilistic
//! Robotics, table 4.4).
//!
//! Weights are as good as random, so nothing here branches on them. Every particle writes its index where its first heir
//! stands, whether it has one or not: who has none is overwritten by the next. An heir's ancestor is then the largest
//! index written up to its place.

use pulp::{Arch, Simd, WithSimd};

use super::particles::{Particles, total};

/// Draws generation after generation in the same memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Resampling {
    /// Where first heirs stand: the index of their ancestor.
    ancestors: Vec<u32>,
}

impl Resampling {
    /// Draws as many heirs as there are parents, in the parents' order and all of weight 1, with probability
    /// proportional to weight; `start` in [0, 1) is the one random number.
    ///
    /// False, and nothing drawn, when no weight is positive. Cost: linear.
    pub fn draw_heirs(&mut self, parents: &Particles, start: f64, heirs: &mut Particles) -> bool {
        let total = total(&parents.weight);
        if !(total > 0.0 && total.is_finite()) {
            return false;
        }
        let num_draws = parents.len();
        self.ancestors.clear();
        // One more place, for those behind the last draw.
        self.ancestors.resize(num_draws + 1, 0);
        for coordinate in [&mut heirs.x_m, &mut heirs.y_m, &mut heirs.heading_turns] {
            coordinate.resize(num_draws, 0.0);
        }
        heirs.weight.clear();
        heirs.weight.resize(num_draws, 1.0);
        let (arch, draws_per_weight) = (Arch::new(), num_draws as f64 / total);
        let ancestors = &mut self.ancestors;
        arch.dispatch(Draws { parents, draws_per_weight, start, ancestors, heirs });
        true
    }
}

/// The draws of one resampling, a loop for the widest vectors at hand.
struct Draws<'a> {
    parents: &'a Particles,
    draws_per_weight: f64,
    start: f64,
    ancestors: &'a mut [u32],
    heirs: &'a mut Particles,
}

/// Weights that are taken side by side.
const LANES: usize = 64;

impl WithSimd for Draws<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { parents, draws_per_weight, start, ancestors, heirs } = self;
        let count = parents.len();
        let (x_m, y_m) = (&parents.x_m[..count], &parents.y_m[..count]);
        let headings = &parents.heading_turns[..count];
        let (heirs_x, heirs_y) = (&mut heirs.x_m[..count], &mut heirs.y_m[..count]);
        let heirs_heading = &mut heirs.heading_turns[..count];
        let (mut running, mut num_drawn, mut index) = (0.0, 0u32, 0);
        let (mut num_settled, mut ancestor) = (0usize, 0u32);
        for weights in parents.weight.chunks(LANES) {
            let mut block = [0.0; LANES];
            block[..weights.len()].copy_from_slice(weights);
            let (sums, end) = running_sums(&block, running);
            running = end;
            let ends = sums.map(|sum| num_below(sum * draws_per_weight - start).min(count as u32));
            for end in &ends[..weights.len()] {
                ancestors[num_drawn as usize] = index;
                num_drawn = *end;
                index += 1;
            }
            // The heirs so far are settled, while their ancestors are at hand.
            let settled = num_settled..num_drawn as usize;
            let into = heirs_x[settled.clone()]
                .iter_mut()
                .zip(&mut heirs_y[settled.clone()])
                .zip(&mut heirs_heading[settled.clone()]);
            for (&written, ((x, y), heading)) in ancestors[settled.clone()].iter().zip(into) {
                ancestor = ancestor.max(written);
                // No index exceeds the last one; the compiler need not check each.
                let from = (ancestor as usize).min(count - 1);
                (*x, *y, *heading) = (x_m[from], y_m[from], headings[from]);
            }
            num_settled = num_drawn as usize;
        }
        // Rounding may leave the very last draw beyond the sum.
        let from = (ancestor as usize).min(count - 1);
        for place in num_settled..count {
            (heirs_x[place], heirs_y[place], heirs_heading[place]) = (x_m[from], y_m[from], headings[from]);
        }
    }
}

/// The sums of weights up to each, and of all, from `start` on: four at a time, so that only every fourth waits for the
/// one before.
#[inline(always)]
fn running_sums(weights: &[f32; LANES], start: f64) -> ([f64; LANES], f64) {
    let mut sums = [0.0; LANES];
    let mut running = start;
    for (sums, weights) in sums.as_chunks_mut().0.iter_mut().zip(weights.as_chunks().0) {
        let [first, second, third, fourth] = weights.map(f64::from);
        let (two, last_two) = (first + second, third + fourth);
        *sums = [running + first, running + two, running + (two + third), running + (two + last_two)];
        running = sums[3];
    }
    (sums, running)
}

/// How many of 0, 1, 2, … lie below a number in (−2³¹, 2³¹).
#[inline(always)]
fn num_below(number: f64) -> u32 {
    /// Of such a number plus this one, the low bits are the nearest integer.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    let sum = number + SHIFT;
    (sum.to_bits() as u32).wrapping_add(u32::from(sum - SHIFT < number))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The textbook loop: step through the sum anew for every draw.
    fn draw_one_by_one(weights: &[f32], start: f64) -> Vec<usize> {
        let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let draws_per_weight = weights.len() as f64 / total;
        let draw = |number: usize| {
            let mut running = 0.0;
            weights.iter().position(|&weight| {
                running += f64::from(weight);
                (number as f64) < running * draws_per_weight - start
            })
        };
        (0..weights.len()).map(|number| draw(number).expect("the draw lies below the sum")).collect()
    }

    /// Particles whose coordinates tell their index.
    fn numbered(weights: &[f32]) -> Particles {
        let numbers = |scale: f32| (0..weights.len()).map(|index| index as f32 * scale).collect();
        Particles {
            x_m: numbers(1.0),
            y_m: numbers(2.0),
            heading_turns: numbers(0.001),
            weight: weights.to_vec(),
        }
    }

    fn drawn(weights: &[f32], start: f64) -> Option<Vec<usize>> {
        let (parents, mut heirs) = (numbered(weights), Particles::default());
        Resampling::default().draw_heirs(&parents, start, &mut heirs).then(|| {
            let ancestors: Vec<usize> = heirs.x_m.iter().map(|&x| x as usize).collect();
            for (heir, &parent) in ancestors.iter().enumerate() {
                assert_eq!(heirs.y_m[heir], parents.y_m[parent]);
                assert_eq!(heirs.heading_turns[heir], parents.heading_turns[parent]);
            }
            assert!(heirs.weight.iter().all(|&weight| weight == 1.0) && heirs.weight.len() == weights.len());
            ancestors
        })
    }

    proptest! {
        #[test]
        fn one_pass_equals_one_by_one(halvings in prop::collection::vec(0u32..9, 1..300), start in 0.0..0.99f64) {
            let weights: Vec<f32> =
                halvings.iter().map(|&n| if n == 8 { 0.0 } else { 0.5f32.powi(n as i32) }).collect();
            match drawn(&weights, start) {
                Some(ancestors) => prop_assert_eq!(ancestors, draw_one_by_one(&weights, start)),
                None => prop_assert!(weights.iter().all(|&weight| weight == 0.0)),
            }
        }
    }

    #[test]
    fn heirs_come_in_proportion() {
        assert_eq!(drawn(&[1.0, 0.0, 3.0, 0.0], 0.5), Some(vec![0, 2, 2, 2]));
        assert_eq!(drawn(&[0.0, 0.0], 0.5), None);
    }
}
