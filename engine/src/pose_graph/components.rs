//! Connected components of a graph.

use super::PoseGraph;

/// Which poses hang together through constraints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Component of every pose; components are numbered by their first pose.
    pub component_of_pose: Vec<u32>,
    /// Number of components; 0 for an empty graph.
    pub num_components: usize,
}

impl Components {
    /// Finds the components over the constraints that `is_used` keeps; nearly linear in their number.
    pub fn of(graph: &PoseGraph, is_used: impl Fn(usize) -> bool) -> Self {
        let mut sets = DisjointSets::new(graph.poses().len());
        for (index, constraint) in graph.constraints().iter().enumerate() {
            if is_used(index) {
                sets.union(constraint.i, constraint.j);
            }
        }
        let mut component_of_root = vec![u32::MAX; graph.poses().len()];
        let mut num_components = 0;
        let component_of_pose = (0..graph.poses().len() as u32)
            .map(|pose| {
                let component = &mut component_of_root[sets.find(pose) as usize];
                if *component == u32::MAX {
                    *component = num_components;
                    num_components += 1;
                }
                *component
            })
            .collect();
        Self { component_of_pose, num_components: num_components as usize }
    }
}

/// For every pose whether it is held: those of the graph, and the first of each component that has none.
pub(super) fn held_poses(graph: &PoseGraph, components: &Components) -> Vec<bool> {
    let mut is_held = vec![false; graph.poses().len()];
    let mut component_is_held = vec![false; components.num_components];
    for &pose in graph.held() {
        is_held[pose as usize] = true;
        component_is_held[components.component_of_pose[pose as usize] as usize] = true;
    }
    for (pose, &component) in components.component_of_pose.iter().enumerate() {
        if !component_is_held[component as usize] {
            component_is_held[component as usize] = true;
            is_held[pose] = true;
        }
    }
    is_held
}

/// Union-find with path halving; the smaller root wins, so that the result does not depend on the order.
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    pub fn new(num_items: usize) -> Self {
        Self { parents: (0..num_items as u32).collect() }
    }

    pub fn find(&mut self, item: u32) -> u32 {
        let mut item = item as usize;
        while self.parents[item] as usize != item {
            let grandparent = self.parents[self.parents[item] as usize];
            self.parents[item] = grandparent;
            item = grandparent as usize;
        }
        item as u32
    }

    /// Joins two sets; false when they were one already.
    pub fn union(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
        a != b
    }
}
