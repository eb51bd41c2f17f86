//! Pairwise-consistent sets of constraints between components (Mangelson et al. 2018).
//!
//! Two runs that never met share no frame, so no single constraint between them can be checked: any would fit. But
//! two of them, with the driving between their ends in either run, form a cycle that must close:
//!
//! ```text
//!   run A   i_k ────────── i_l
//!            │ z_k          │ z_l
//!   run B   j_k ────────── j_l
//! ```
//!
//! The largest set of which all pairs close is right unless wrong matches conspire; those outside it are not.

use serde::{Deserialize, Serialize};

use super::clique::largest_clique;
use super::support::Uncertain;
use super::{Components, CovarianceSolver, PoseConstraint, PoseGraph, PoseGraphError};
use crate::config_error::ConfigError;

/// Settings of [`consistent_sets`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConsistencyConfig {
    /// Largest χ² of a cycle that closes; three degrees of freedom exceed 11.34 once in a hundred.
    pub cycle_chi2_max: f64,
    /// Budget of the search for the largest set of each pair of components.
    pub num_nodes_max: u32,
}

impl Default for ConsistencyConfig {
    fn default() -> Self {
        Self { cycle_chi2_max: 11.34, num_nodes_max: 20_000 }
    }
}

impl ConsistencyConfig {
    /// Checks every value; `path` is prefixed to the name of the offending field.
    ///
    /// # Errors
    /// The first field that cannot work.
    pub fn validate(&self, path: &str) -> Result<(), ConfigError> {
        if !(self.cycle_chi2_max > 0.0 && self.cycle_chi2_max.is_finite()) {
            return Err(ConfigError::new(format!("{path}.cycle_chi2_max"), "must be positive"));
        }
        Ok(())
    }
}

/// Constraints between two components that hold together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConsistentSet {
    /// The components they join, smaller first.
    pub components: (u32, u32),
    /// Indices of the candidates in the set, ascending; a lone candidate is a set of one.
    pub members: Vec<u32>,
    /// Number of candidates between the two components.
    pub num_candidates: usize,
}

/// Finds the largest pairwise-consistent set for every pair of components that candidates join, in order of the
/// components.
///
/// `graph` holds the constraints that are sure, its poses optimised within each component; `candidates` are not part
/// of it. Candidates within one component are judged in the same way. Cost: two solves per candidate and one
/// composition per pair of them.
///
/// # Errors
/// `Empty`, `NotPositiveDefinite`, `UnknownPose`, `Config`.
pub fn consistent_sets(
    graph: &PoseGraph,
    candidates: &[PoseConstraint],
    config: &ConsistencyConfig,
) -> Result<Vec<ConsistentSet>, PoseGraphError> {
    config.validate("consistency")?;
    for candidate in candidates {
        graph.check_pose(candidate.i)?;
        graph.check_pose(candidate.j)?;
    }
    let components = Components::of(graph, |_| true);
    let mut solver = CovarianceSolver::new(graph)?;
    let mut groups = std::collections::BTreeMap::<(u32, u32), Vec<(u32, Bridge)>>::new();
    for (index, candidate) in candidates.iter().enumerate() {
        if let Some(bridge) = Bridge::new(candidate, &components) {
            groups.entry(bridge.components).or_default().push((index as u32, bridge));
        }
    }
    let mut sets = Vec::with_capacity(groups.len());
    for (components, group) in groups {
        let agrees = agreements(&mut solver, &group, config)?;
        let clique = largest_clique(&agrees, config.num_nodes_max);
        let members = clique.into_iter().map(|position| group[position].0).collect();
        sets.push(ConsistentSet { components, members, num_candidates: group.len() });
    }
    Ok(sets)
}

/// A candidate, turned so that it leads from the smaller component to the larger.
struct Bridge {
    components: (u32, u32),
    i: u32,
    j: u32,
    measured: Uncertain,
}

impl Bridge {
    /// `None` when the candidate does not determine all of the relative pose.
    fn new(candidate: &PoseConstraint, components: &Components) -> Option<Self> {
        let measured = Uncertain::of(candidate)?;
        let component_of = |pose: u32| components.component_of_pose[pose as usize];
        let (from, to) = (component_of(candidate.i), component_of(candidate.j));
        Some(if (from, candidate.i) <= (to, candidate.j) {
            Self { components: (from, to), i: candidate.i, j: candidate.j, measured }
        } else {
            Self { components: (to, from), i: candidate.j, j: candidate.i, measured: measured.inverse() }
        })
    }
}

/// For every pair of bridges whether their cycle closes.
fn agreements(
    solver: &mut CovarianceSolver,
    group: &[(u32, Bridge)],
    config: &ConsistencyConfig,
) -> Result<Vec<Vec<bool>>, PoseGraphError> {
    let mut agrees = vec![vec![false; group.len()]; group.len()];
    for (k, (_, bridge)) in group.iter().enumerate() {
        let others = &group[..k];
        let starts: Vec<u32> = others.iter().map(|(_, other)| other.i).collect();
        let ends: Vec<u32> = others.iter().map(|(_, other)| other.j).collect();
        let relatives = solver.relatives(&[(bridge.i, starts), (bridge.j, ends)])?;
        for (l, (_, other)) in others.iter().enumerate() {
            let [first, second] =
                [relatives[0][l], relatives[1][l]].map(|(pose, covariance)| Uncertain { pose, covariance });
            let around = bridge.measured.compose(&second).compose(&other.measured.inverse());
            let closes = around.chi2_against(&first).is_some_and(|chi2| chi2 <= config.cycle_chi2_max);
            agrees[k][l] = closes;
            agrees[l][k] = closes;
        }
    }
    Ok(agrees)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{constraint, random_drive, random_pose};
    use super::*;
    use crate::geometry::Pose2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const WEIGHTS: [f64; 3] = [900.0, 1200.0, 2500.0];

    /// Two runs through the same places without a common frame.
    fn two_runs(seed: u64) -> (PoseGraph, Vec<Pose2>, u32) {
        let (mut graph, truth) = random_drive(seed, 80, 40);
        let (other, _) = random_drive(seed, 80, 40);
        for pose in other.poses() {
            graph.add_pose(Pose2::new(50.0, -20.0, 1.0).compose(pose)).unwrap();
        }
        for c in other.constraints() {
            graph.add_constraint(PoseConstraint { i: c.i + 80, j: c.j + 80, ..*c }).unwrap();
        }
        super::super::optimize(&mut graph, &super::super::PoseGraphConfig::default()).unwrap();
        (graph, truth, 80)
    }

    #[test]
    fn keeps_the_right_matches_among_as_many_wrong_ones() {
        for seed in 0..5 {
            let (graph, truth, offset) = two_runs(seed);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut candidates = Vec::new();
            for k in 0..40u32 {
                let (i, j) = (rng.random_range(0..80u32), rng.random_range(0..80u32));
                let z = if k % 2 == 0 {
                    let noise = random_pose(&mut rng, 0.03, 0.02);
                    truth[i as usize].between(&truth[j as usize]).compose(&noise)
                } else {
                    random_pose(&mut rng, 30.0, 3.0)
                };
                // Every other right match is given from the second run to the first.
                candidates.push(if k % 4 == 0 {
                    constraint(j + offset, i, z.inverse(), WEIGHTS)
                } else {
                    constraint(i, j + offset, z, WEIGHTS)
                });
            }
            let sets = consistent_sets(&graph, &candidates, &ConsistencyConfig::default()).unwrap();
            assert_eq!(sets.len(), 1);
            assert_eq!(sets[0].components, (0, 1));
            let num_wrong = sets[0].members.iter().filter(|&&member| member % 2 == 1).count();
            assert_eq!(num_wrong, 0, "seed {seed}: {sets:?}");
            assert!(sets[0].members.len() >= 17, "seed {seed}: {sets:?}");
        }
    }

    #[test]
    fn groups_by_pair_of_components() {
        let (mut graph, _, offset) = two_runs(1);
        let lone = graph.add_pose(Pose2::identity()).unwrap();
        let candidates = [
            constraint(0, offset, Pose2::identity(), WEIGHTS),
            constraint(lone, 3, Pose2::identity(), WEIGHTS),
        ];
        let sets = consistent_sets(&graph, &candidates, &ConsistencyConfig::default()).unwrap();
        let pairs: Vec<_> = sets.iter().map(|set| (set.components, set.members.clone())).collect();
        assert_eq!(pairs, [((0, 1), vec![0]), ((0, 2), vec![1])]);
        let unknown = [constraint(0, 999, Pose2::identity(), WEIGHTS)];
        assert!(consistent_sets(&graph, &unknown, &ConsistencyConfig::default()).is_err());
    }
}
