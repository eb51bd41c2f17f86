//! Learned labels: boosted trees say what a position may be, a hidden Markov chain makes one sequence of a run.
//!
//! The weights are data: `labels.model` beside this file, written by the laboratory's example `learn_labels`.

use std::sync::LazyLock;

use super::features::NUM_FEATURES;
use super::label::PlaceLabel;

/// Kinds of places.
const NUM_LABELS: usize = PlaceLabel::ALL.len();
/// One number for each label, in the order of [`PlaceLabel::ALL`].
pub type PerLabel = [f64; NUM_LABELS];

/// A node of a tree; children stand behind their parents.
#[derive(Clone, Debug, PartialEq)]
pub enum TreeNode {
    /// Asks whether a number is at most a limit.
    Split {
        /// Which number.
        feature: u16,
        /// The limit.
        limit: f32,
        /// Node of the numbers at most the limit; those above it follow this one's.
        low: u16,
        /// Node of the others.
        high: u16,
    },
    /// Log odds of each label to be added.
    Leaf([f32; NUM_LABELS]),
}

/// Weights of the learned labels.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedLabels {
    /// Trees whose leaves are added up; the first node of each is its root.
    pub trees: Vec<Vec<TreeNode>>,
    /// The share of what the trees say that each position counts for in a sequence: neighbours see nearly the same.
    pub evidence_share: f64,
    /// Mean length of a stretch of each label, metres.
    pub mean_length_m: PerLabel,
    /// Share of each label among those that follow one; 0 for itself.
    pub follows: [PerLabel; NUM_LABELS],
}

/// Checked by a test, so that a release cannot hold others.
static BUILT_IN: LazyLock<LearnedLabels> = LazyLock::new(|| {
    LearnedLabels::from_text(include_str!("labels.model"))
        .expect("the weights in the repository are read by a test")
});

impl LearnedLabels {
    /// The weights that come with the engine.
    pub fn built_in() -> &'static Self {
        &BUILT_IN
    }

    /// How many numbers a position has.
    pub const NUM_NUMBERS: usize = NUM_FEATURES;

    /// What each label is worth for a position with these numbers: the probabilities if all were as frequent.
    pub fn likelihoods(&self, numbers: &[f32]) -> PerLabel {
        let mut odds = [0.0f64; NUM_LABELS];
        for tree in &self.trees {
            for (sum, leaf) in odds.iter_mut().zip(leaf_of(tree, numbers)) {
                *sum += f64::from(*leaf);
            }
        }
        let highest = odds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        normalized(odds.map(|odds| (odds - highest).exp()))
    }

    /// The label of each position of a run that are `spacing_m` apart and its probability, given all positions
    /// (forward and backward through the chain).
    pub fn in_sequence(&self, likelihoods: &[PerLabel], spacing_m: f64) -> Vec<(PlaceLabel, f32)> {
        let weights: Vec<PerLabel> = likelihoods
            .iter()
            .map(|of| of.map(|likelihood| likelihood.max(1e-6).powf(self.evidence_share)))
            .collect();
        let steps = self.steps(spacing_m);
        let mut forward: Vec<PerLabel> = Vec::with_capacity(weights.len());
        for weight in &weights {
            let before = forward.last().map_or([1.0; NUM_LABELS], |last| {
                std::array::from_fn(|to| (0..NUM_LABELS).map(|from| last[from] * steps[from][to]).sum())
            });
            forward.push(normalized(std::array::from_fn(|label| before[label] * weight[label])));
        }
        let mut backward = [1.0; NUM_LABELS];
        let mut labels = Vec::with_capacity(weights.len());
        for (position, weight) in weights.iter().enumerate().rev() {
            let both = normalized(std::array::from_fn(|label| forward[position][label] * backward[label]));
            let best =
                PlaceLabel::ALL.into_iter().rev().max_by(|a, b| both[a.index()].total_cmp(&both[b.index()]));
            let best = best.expect("there are labels");
            labels.push((best, both[best.index()] as f32));
            backward = normalized(std::array::from_fn(|from| {
                (0..NUM_LABELS).map(|to| steps[from][to] * weight[to] * backward[to]).sum()
            }));
        }
        labels.reverse();
        labels
    }

    /// Probability of each label so much farther on, by the label here.
    fn steps(&self, spacing_m: f64) -> [PerLabel; NUM_LABELS] {
        std::array::from_fn(|from| {
            let stays = (-spacing_m / self.mean_length_m[from].max(1e-3)).exp();
            std::array::from_fn(|to| if to == from { stays } else { (1.0 - stays) * self.follows[from][to] })
        })
    }
}

fn leaf_of<'a>(tree: &'a [TreeNode], numbers: &[f32]) -> &'a [f32; NUM_LABELS] {
    const NOTHING: [f32; NUM_LABELS] = [0.0; NUM_LABELS];
    let mut at = 0;
    loop {
        match tree.get(at) {
            Some(TreeNode::Split { feature, limit, low, high }) => {
                let number = numbers.get(usize::from(*feature)).copied().unwrap_or(0.0);
                at = usize::from(if number <= *limit { *low } else { *high });
            }
            Some(TreeNode::Leaf(odds)) => return odds,
            None => return &NOTHING,
        }
    }
}

fn normalized(values: PerLabel) -> PerLabel {
    let sum: f64 = values.iter().sum();
    if sum > 0.0 { values.map(|value| value / sum) } else { [1.0 / NUM_LABELS as f64; NUM_LABELS] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One question: number 3 above a half is a corner, below it a corridor.
    fn model() -> LearnedLabels {
        let odds = |label: PlaceLabel| {
            let mut odds = [0.0; NUM_LABELS];
            odds[label.index()] = 3.0;
            TreeNode::Leaf(odds)
        };
        LearnedLabels {
            trees: vec![vec![
                TreeNode::Split { feature: 3, limit: 0.5, low: 1, high: 2 },
                odds(PlaceLabel::Corridor),
                odds(PlaceLabel::Corner),
            ]],
            evidence_share: 0.5,
            mean_length_m: [4.0; NUM_LABELS],
            follows: [[0.25; NUM_LABELS]; NUM_LABELS],
        }
    }

    #[test]
    fn a_flicker_is_outvoted_and_a_stretch_is_not() {
        let model = model();
        let numbers = |is_corner: bool| [0.0, 0.0, 0.0, f32::from(u8::from(is_corner))];
        let labels = |corners: std::ops::Range<usize>| -> Vec<PlaceLabel> {
            let seen: Vec<PerLabel> =
                (0..20).map(|position| model.likelihoods(&numbers(corners.contains(&position)))).collect();
            model.in_sequence(&seen, 0.4).into_iter().map(|(label, _)| label).collect()
        };
        assert!(labels(9..10).iter().all(|label| *label == PlaceLabel::Corridor));
        let long = labels(6..14);
        assert_eq!(long[9], PlaceLabel::Corner);
        assert_eq!((long[2], long[17]), (PlaceLabel::Corridor, PlaceLabel::Corridor));
        assert!(model.in_sequence(&[], 0.4).is_empty());
    }

    #[test]
    fn weights_survive_their_text() {
        let model = model();
        assert_eq!(LearnedLabels::from_text(&model.to_text()).unwrap(), model);
        let bent = model.to_text().replace("split 3 0.5 1 2", "split 3 0.5 1 9");
        assert!(LearnedLabels::from_text(&bent).unwrap_err().contains("leads nowhere"));
        assert!(LearnedLabels::from_text("tree\nleaf 1 2").unwrap_err().starts_with("line 2"));
        assert!(LearnedLabels::from_text("").is_err());
    }

    #[test]
    fn the_weights_of_the_repository_are_read() {
        let model = LearnedLabels::built_in();
        assert!(!model.trees.is_empty());
        for row in &model.follows {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-3, "{row:?}");
        }
    }
}
