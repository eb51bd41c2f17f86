//! The text in which learned labels are kept: a line for each node, so that a change can be read.
//!
//! ```text
//! evidence_share 0.3
//! mean_length_m 3.1 2.2 9.0 6.5 8.0
//! follows 0 0.1 0.8 0.1 0          one line for each label, in the order of PlaceLabel::ALL
//! tree
//! split 35 2.5 1 2                  number, limit, node of those at most the limit, node of the others
//! leaf -0.1 0 0.2 0.1 0             log odds of each label
//! ```

use std::fmt::Write;

use super::features::NUM_FEATURES;
use super::learned::{LearnedLabels, PerLabel, TreeNode};

impl LearnedLabels {
    /// The text of these weights.
    pub fn to_text(&self) -> String {
        let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let mut text =
            format!("evidence_share {}\nmean_length_m {}\n", self.evidence_share, list(&self.mean_length_m));
        for row in &self.follows {
            text.push_str(&format!("follows {}\n", list(row)));
        }
        for tree in &self.trees {
            text.push_str("tree\n");
            for node in tree {
                let written = match node {
                    TreeNode::Split { feature, limit, low, high } => {
                        writeln!(text, "split {feature} {limit} {low} {high}")
                    }
                    TreeNode::Leaf(odds) => {
                        let odds: Vec<String> = odds.iter().map(f32::to_string).collect();
                        writeln!(text, "leaf {}", odds.join(" "))
                    }
                };
                written.expect("a string takes every line");
            }
        }
        text
    }

    /// Weights from their text.
    ///
    /// # Errors
    /// The first line that makes no sense, by its number from 1, or what is missing.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let mut weights =
            Self { trees: Vec::new(), evidence_share: 1.0, mean_length_m: [1.0; 5], follows: [[0.0; 5]; 5] };
        let mut num_rows = 0;
        for (idx, line) in text.lines().enumerate() {
            let mut words = line.split_whitespace();
            let kind = words.next().unwrap_or_default();
            let rest: Vec<&str> = words.collect();
            let understood = match kind {
                "evidence_share" => number(&rest).map(|share| weights.evidence_share = share),
                "mean_length_m" => numbers(&rest).map(|lengths| weights.mean_length_m = lengths),
                "follows" => numbers(&rest).and_then(|row| {
                    *weights.follows.get_mut(num_rows)? = row;
                    num_rows += 1;
                    Some(())
                }),
                "tree" => {
                    weights.trees.push(Vec::new());
                    Some(())
                }
                "split" => split(&rest).and_then(|node| weights.trees.last_mut().map(|tree| tree.push(node))),
                "leaf" => numbers(&rest).and_then(|odds| {
                    let leaf = TreeNode::Leaf(odds.map(|value| value as f32));
                    weights.trees.last_mut().map(|tree| tree.push(leaf))
                }),
                _ => None,
            };
            understood.ok_or_else(|| format!("line {} makes no sense: {line}", idx + 1))?;
        }
        if num_rows != weights.follows.len() {
            return Err(format!("{num_rows} lines of follows instead of {}", weights.follows.len()));
        }
        weights
            .trees
            .iter()
            .enumerate()
            .try_for_each(|(idx, tree)| check(tree).map_err(|problem| format!("tree {idx}: {problem}")))?;
        Ok(weights)
    }
}

fn number<T: std::str::FromStr>(words: &[&str]) -> Option<T> {
    let [word] = words else { return None };
    word.parse().ok()
}

fn numbers(words: &[&str]) -> Option<PerLabel> {
    let values: Vec<f64> = words.iter().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    values.try_into().ok()
}

fn split(words: &[&str]) -> Option<TreeNode> {
    let [feature, limit, low, high] = words else { return None };
    Some(TreeNode::Split {
        feature: feature.parse().ok()?,
        limit: limit.parse().ok()?,
        low: low.parse().ok()?,
        high: high.parse().ok()?,
    })
}

/// Every way down a tree must end: children stand behind their parents, and there is a number for every question.
fn check(tree: &[TreeNode]) -> Result<(), String> {
    if tree.is_empty() {
        return Err("has no node".into());
    }
    for (idx, node) in tree.iter().enumerate() {
        if let TreeNode::Split { feature, low, high, .. } = node {
            let is_behind = |child: u16| (idx + 1..tree.len()).contains(&usize::from(child));
            if !is_behind(*low) || !is_behind(*high) || usize::from(*feature) >= NUM_FEATURES {
                return Err(format!("node {idx} leads nowhere"));
            }
        }
    }
    Ok(())
}
