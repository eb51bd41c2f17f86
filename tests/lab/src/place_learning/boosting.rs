//! Gradient boosting of small trees whose leaves hold the log odds of all labels at once.
//!
//! Every round draws a share of the examples and, for each node, a share of the numbers; the split taken is the one that
//! gains most by Newton's step on the cross entropy. Numbers are looked at in bins of about equally many examples. All
//! draws come from the seed.

use locution_engine::semantics::TreeNode;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NUM_LABELS: usize = 5;
/// Bins of a number.
const NUM_BINS: usize = 48;

/// How trees are grown.
#[derive(Clone, Copy, Debug)]
pub struct BoostingConfig {
    /// Trees.
    pub num_trees: usize,
    /// Splits between a root and its leaves.
    pub depth: usize,
    /// Share of its step that a leaf takes.
    pub rate: f64,
    /// Share of the examples that each tree sees.
    pub example_share: f64,
    /// Share of the numbers that each node may ask.
    pub number_share: f64,
    /// Weight of examples below which a leaf is too small, in examples.
    pub leaf_min: f64,
    /// Keeps the steps of small leaves small.
    pub ridge: f64,
    /// Chooses all draws.
    pub seed: u64,
}

impl Default for BoostingConfig {
    fn default() -> Self {
        Self {
            num_trees: 100,
            depth: 4,
            rate: 0.1,
            example_share: 0.4,
            number_share: 0.25,
            leaf_min: 20.0,
            ridge: 5.0,
            seed: 1,
        }
    }
}

/// Examples of one training.
pub struct Examples<'a> {
    /// Numbers of each.
    pub numbers: Vec<&'a [f32]>,
    /// Position of the label of each in `PlaceLabel::ALL`.
    pub labels: Vec<usize>,
    /// What each counts for; 1 on average.
    pub weights: Vec<f64>,
}

/// Grows trees on examples.
pub fn boost(examples: &Examples<'_>, config: &BoostingConfig) -> Vec<Vec<TreeNode>> {
    let num = examples.labels.len();
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let limits = limits(&examples.numbers);
    let bins: Vec<Vec<u8>> = limits
        .iter()
        .enumerate()
        .map(|(feature, limits)| {
            let bin = |numbers: &&[f32]| limits.partition_point(|limit| *limit < numbers[feature]) as u8;
            examples.numbers.iter().map(bin).collect()
        })
        .collect();
    let mut odds = vec![[0.0f64; NUM_LABELS]; num];
    let mut trees = Vec::with_capacity(config.num_trees);
    for _ in 0..config.num_trees {
        let steps: Vec<Step> =
            (0..num).map(|idx| Step::of(&odds[idx], examples.labels[idx], examples.weights[idx])).collect();
        let drawn: Vec<u32> =
            (0..num as u32).filter(|_| rng.random_range(0.0..1.0) < config.example_share).collect();
        let mut grower = Grower { config, bins: &bins, limits: &limits, steps: &steps, nodes: Vec::new() };
        grower.grow(drawn, config.depth, &mut rng);
        let tree = grower.nodes;
        for (idx, odds) in odds.iter_mut().enumerate() {
            let mut at = 0;
            loop {
                match &tree[at] {
                    TreeNode::Split { feature, limit, low, high } => {
                        let is_low = examples.numbers[idx][usize::from(*feature)] <= *limit;
                        at = usize::from(if is_low { *low } else { *high });
                    }
                    TreeNode::Leaf(leaf) => {
                        odds.iter_mut().zip(leaf).for_each(|(sum, part)| *sum += f64::from(*part));
                        break;
                    }
                }
            }
        }
        trees.push(tree);
    }
    trees
}

/// Upper limits of the bins of each number but the last.
fn limits(numbers: &[&[f32]]) -> Vec<Vec<f32>> {
    let num_features = numbers.first().map_or(0, |first| first.len());
    (0..num_features)
        .map(|feature| {
            let mut values: Vec<f32> = numbers.iter().map(|of| of[feature]).collect();
            values.sort_by(f32::total_cmp);
            let mut limits: Vec<f32> =
                (1..NUM_BINS).map(|bin| values[bin * (values.len() - 1) / NUM_BINS]).collect();
            limits.dedup();
            limits
        })
        .collect()
}

/// Gradient and curvature of the cross entropy of one example, weighted.
#[derive(Clone, Copy)]
struct Step {
    gradient: [f32; NUM_LABELS],
    curvature: [f32; NUM_LABELS],
    weight: f32,
}

impl Step {
    fn of(odds: &[f64; NUM_LABELS], label: usize, weight: f64) -> Self {
        let highest = odds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let shares = odds.map(|odds| (odds - highest).exp());
        let sum: f64 = shares.iter().sum();
        let share = |of: usize| shares[of] / sum;
        let is = |of: usize| f64::from(u8::from(of == label));
        Self {
            gradient: std::array::from_fn(|of| (weight * (is(of) - share(of))) as f32),
            curvature: std::array::from_fn(|of| (weight * share(of) * (1.0 - share(of))) as f32),
            weight: weight as f32,
        }
    }
}

/// Sums of steps.
#[derive(Clone, Copy, Default)]
struct Sums {
    gradient: [f64; NUM_LABELS],
    curvature: [f64; NUM_LABELS],
    weight: f64,
}

impl Sums {
    fn add(&mut self, step: &Step) {
        for of in 0..NUM_LABELS {
            self.gradient[of] += f64::from(step.gradient[of]);
            self.curvature[of] += f64::from(step.curvature[of]);
        }
        self.weight += f64::from(step.weight);
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            gradient: std::array::from_fn(|of| self.gradient[of] + other.gradient[of]),
            curvature: std::array::from_fn(|of| self.curvature[of] + other.curvature[of]),
            weight: self.weight + other.weight,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        Self {
            gradient: std::array::from_fn(|of| self.gradient[of] - other.gradient[of]),
            curvature: std::array::from_fn(|of| self.curvature[of] - other.curvature[of]),
            weight: self.weight - other.weight,
        }
    }

    fn worth(&self, ridge: f64) -> f64 {
        (0..NUM_LABELS).map(|of| self.gradient[of].powi(2) / (self.curvature[of] + ridge)).sum()
    }
}

struct Grower<'a> {
    config: &'a BoostingConfig,
    bins: &'a [Vec<u8>],
    limits: &'a [Vec<f32>],
    steps: &'a [Step],
    nodes: Vec<TreeNode>,
}

impl Grower<'_> {
    /// Grows the node of some examples and all below it; answers its position.
    fn grow(&mut self, members: Vec<u32>, depth: usize, rng: &mut ChaCha8Rng) -> u16 {
        let mut all = Sums::default();
        members.iter().for_each(|&idx| all.add(&self.steps[idx as usize]));
        let at = self.nodes.len();
        let config = self.config;
        let leaf = std::array::from_fn(|of| {
            let step = config.rate * all.gradient[of] / (all.curvature[of] + config.ridge);
            // Four digits are more than the step is sure of, and keep the file small.
            ((step * 1e4).round() / 1e4) as f32
        });
        self.nodes.push(TreeNode::Leaf(leaf));
        if depth == 0 {
            return at as u16;
        }
        if let Some((feature, bin)) = self.best_split(&members, &all, rng) {
            let (low, high): (Vec<u32>, Vec<u32>) =
                members.into_iter().partition(|&idx| usize::from(self.bins[feature][idx as usize]) <= bin);
            let low = self.grow(low, depth - 1, rng);
            let high = self.grow(high, depth - 1, rng);
            let limit = self.limits[feature][bin];
            self.nodes[at] = TreeNode::Split { feature: feature as u16, limit, low, high };
        }
        at as u16
    }

    /// The number and the bin after which a split gains most.
    fn best_split(&self, members: &[u32], all: &Sums, rng: &mut ChaCha8Rng) -> Option<(usize, usize)> {
        let config = self.config;
        let mut best: Option<(f64, usize, usize)> = None;
        for (feature, bins) in self.bins.iter().enumerate() {
            if rng.random_range(0.0..1.0) >= config.number_share {
                continue;
            }
            let mut by_bin = [Sums::default(); NUM_BINS];
            for &idx in members {
                by_bin[usize::from(bins[idx as usize])].add(&self.steps[idx as usize]);
            }
            let mut low = Sums::default();
            for (bin, sums) in by_bin.iter().enumerate().take(self.limits[feature].len()) {
                low = low.plus(sums);
                let high = all.minus(&low);
                if low.weight < config.leaf_min || high.weight < config.leaf_min {
                    continue;
                }
                let gain = low.worth(config.ridge) + high.worth(config.ridge) - all.worth(config.ridge);
                if gain > best.map_or(1e-6, |(most, _, _)| most) {
                    best = Some((gain, feature, bin));
                }
            }
        }
        best.map(|(_, feature, bin)| (feature, bin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_learn_which_number_matters() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let numbers: Vec<Vec<f32>> =
            (0..600).map(|_| (0..4).map(|_| rng.random_range(0.0..1.0)).collect()).collect();
        let labels: Vec<usize> = numbers.iter().map(|of| usize::from(of[2] > 0.6) * 3).collect();
        let examples = Examples {
            numbers: numbers.iter().map(Vec::as_slice).collect(),
            labels,
            weights: vec![1.0; numbers.len()],
        };
        let config = BoostingConfig { num_trees: 20, number_share: 1.0, ..BoostingConfig::default() };
        let trees = boost(&examples, &config);
        assert_eq!(trees, boost(&examples, &config), "one seed, one result");
        let TreeNode::Split { feature, limit, .. } = trees[0][0] else { panic!("the first tree splits") };
        assert!(feature == 2 && (limit - 0.6).abs() < 0.03, "{feature} {limit}");
    }
}
