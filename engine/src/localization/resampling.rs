//! Low-variance resampling: one random number, then even steps through the running sum of weights (Probabilistic
//! Robotics, table 4.4).

use super::particles::{Particles, total};

/// Draws `count` ancestors in ascending order, with probability proportional to weight; `start` in [0, 1) is the one
/// random number. False, and nothing drawn, when no weight is positive. Cost: linear.
pub(super) fn draw_ancestors(weights: &[f32], count: usize, start: f64, ancestors: &mut Vec<u32>) -> bool {
    let total = total(weights);
    if !(total > 0.0 && total.is_finite()) {
        return false;
    }
    ancestors.resize(count, 0);
    let step = total / count as f64;
    let (mut target, mut running) = (start * step, 0.0);
    let (mut num_drawn, mut last) = (0, 0);
    for (index, &weight) in weights.iter().enumerate() {
        running += f64::from(weight);
        while target < running && num_drawn < count {
            last = index as u32;
            ancestors[num_drawn] = last;
            num_drawn += 1;
            target = (start + num_drawn as f64) * step;
        }
    }
    // Rounding may leave the very last steps beyond the sum.
    ancestors[num_drawn..].fill(last);
    true
}

/// Copies the ancestors' poses into `heirs`, all of weight 1.
pub(super) fn inherit(parents: &Particles, ancestors: &[u32], heirs: &mut Particles) {
    let copy = |from: &[f32], into: &mut Vec<f32>| {
        into.clear();
        into.extend(ancestors.iter().map(|&ancestor| from[ancestor as usize]));
    };
    copy(&parents.x_m, &mut heirs.x_m);
    copy(&parents.y_m, &mut heirs.y_m);
    copy(&parents.heading_turns, &mut heirs.heading_turns);
    heirs.weight.clear();
    heirs.weight.resize(ancestors.len(), 1.0);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The textbook loop: step through the sum anew for every draw.
    fn draw_one_by_one(weights: &[f32], count: usize, start: f64) -> Vec<u32> {
        let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let draw = |number: usize| {
            let target = (start + number as f64) * (total / count as f64);
            let mut running = 0.0;
            weights.iter().position(|&weight| {
                running += f64::from(weight);
                target < running
            })
        };
        (0..count).map(|number| draw(number).expect("the target lies below the sum") as u32).collect()
    }

    proptest! {
        #[test]
        fn one_pass_equals_one_by_one(
            halvings in prop::collection::vec(0u32..9, 1..80), count in 1usize..120, start in 0.0..0.99f64,
        ) {
            let weights: Vec<f32> =
                halvings.iter().map(|&n| if n == 8 { 0.0 } else { 0.5f32.powi(n as i32) }).collect();
            let mut ancestors = Vec::new();
            if draw_ancestors(&weights, count, start, &mut ancestors) {
                prop_assert_eq!(ancestors, draw_one_by_one(&weights, count, start));
            } else {
                prop_assert!(weights.iter().all(|&weight| weight == 0.0));
            }
        }
    }

    #[test]
    fn heirs_come_in_proportion() {
        let mut ancestors = Vec::new();
        assert!(draw_ancestors(&[1.0, 0.0, 3.0], 8, 0.5, &mut ancestors));
        assert_eq!(ancestors, [0, 0, 2, 2, 2, 2, 2, 2]);
        assert!(!draw_ancestors(&[0.0, 0.0], 8, 0.5, &mut ancestors));
    }
}
