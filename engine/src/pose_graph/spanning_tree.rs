//! First guesses for poses that have none, by chaining measurements.

use super::components::DisjointSets;
use super::{PoseConstraint, PoseGraph, Trust};
use crate::geometry::Pose2;

/// Places the poses that are not `is_known` by chaining constraints from those that are.
///
/// The chain prefers trusted constraints, and then the order in which they were added. A component without a known
/// pose begins with its first pose at the identity.
pub fn spanning_tree_start(graph: &mut PoseGraph, is_known: &[bool]) {
    let tree = spanning_tree(graph);
    let mut poses = graph.poses().to_vec();
    let mut is_placed = is_known.to_vec();
    is_placed.resize(poses.len(), false);
    let known: Vec<u32> = (0..poses.len() as u32).filter(|&pose| is_placed[pose as usize]).collect();
    place_neighbors(graph.constraints(), &tree, known, &mut is_placed, &mut poses);
    for root in 0..poses.len() as u32 {
        if !is_placed[root as usize] {
            is_placed[root as usize] = true;
            poses[root as usize] = Pose2::identity();
            place_neighbors(graph.constraints(), &tree, vec![root], &mut is_placed, &mut poses);
        }
    }
    graph.replace_poses(poses);
}

/// Constraints of a spanning forest by pose.
fn spanning_tree(graph: &PoseGraph) -> Vec<Vec<u32>> {
    let mut sets = DisjointSets::new(graph.poses().len());
    let mut tree = vec![Vec::new(); graph.poses().len()];
    for trust in [Trust::Trusted, Trust::Doubtful] {
        for (index, constraint) in graph.constraints().iter().enumerate() {
            if graph.trusts()[index] == trust && sets.union(constraint.i, constraint.j) {
                tree[constraint.i as usize].push(index as u32);
                tree[constraint.j as usize].push(index as u32);
            }
        }
    }
    tree
}

fn place_neighbors(
    constraints: &[PoseConstraint],
    tree: &[Vec<u32>],
    mut stack: Vec<u32>,
    is_placed: &mut [bool],
    poses: &mut [Pose2],
) {
    while let Some(pose) = stack.pop() {
        for &constraint in &tree[pose as usize] {
            let PoseConstraint { i, j, i_from_j, .. } = constraints[constraint as usize];
            let (other, step) = if pose == i { (j, i_from_j) } else { (i, i_from_j.inverse()) };
            if !is_placed[other as usize] {
                is_placed[other as usize] = true;
                poses[other as usize] = poses[pose as usize].compose(&step);
                stack.push(other);
            }
        }
    }
}
