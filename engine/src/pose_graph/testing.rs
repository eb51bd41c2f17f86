//! Small graphs for the tests of this room.

use nalgebra::Matrix3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{InformationMatrix, PoseConstraint, PoseGraph};
use crate::geometry::Pose2;

/// A constraint with independent coordinates.
pub(super) fn constraint(i: u32, j: u32, i_from_j: Pose2, weights: [f64; 3]) -> PoseConstraint {
    let information = InformationMatrix::try_new(Matrix3::from_diagonal(&weights.into())).unwrap();
    PoseConstraint { i, j, i_from_j, information }
}

/// A pose with coordinates within ± the given sizes.
pub(super) fn random_pose(rng: &mut impl Rng, size_m: f64, turn_rad: f64) -> Pose2 {
    let mut within = |size: f64| (rng.random::<f64>() * 2.0 - 1.0) * size;
    Pose2::new(within(size_m), within(size_m), within(turn_rad))
}

/// A random drive with random closures, measured with small noise; the graph starts at the true poses, returned too.
pub(super) fn random_drive(seed: u64, num_poses: u32, num_closures: u32) -> (PoseGraph, Vec<Pose2>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = vec![Pose2::identity()];
    for _ in 1..num_poses {
        let step = Pose2::new(1.0, 0.0, 0.0).compose(&random_pose(&mut rng, 0.3, 0.8));
        truth.push(truth[truth.len() - 1].compose(&step));
    }
    let mut graph = PoseGraph::new();
    for pose in &truth {
        graph.add_pose(*pose).unwrap();
    }
    let mut pairs: Vec<(u32, u32)> = (1..num_poses).map(|j| (j - 1, j)).collect();
    for _ in 0..num_closures {
        let i = rng.random_range(0..num_poses);
        pairs.push((i, (i + rng.random_range(1..num_poses)) % num_poses));
    }
    for (i, j) in pairs {
        let noise = random_pose(&mut rng, 0.03, 0.02);
        let z = truth[i as usize].between(&truth[j as usize]).compose(&noise);
        let measured = constraint(i, j, z, [900.0, 1200.0, 2500.0]);
        if j == i + 1 { graph.add_constraint(measured) } else { graph.add_doubtful(measured) }.unwrap();
    }
    (graph, truth)
}

/// Dense H without the rows and columns of the first pose, straight from Eq B.14 by finite differences.
pub(super) fn dense_information(graph: &PoseGraph) -> nalgebra::DMatrix<f64> {
    let num_unknowns = 3 * graph.poses().len();
    let mut dense = nalgebra::DMatrix::zeros(num_unknowns, num_unknowns);
    for c in graph.constraints() {
        let error = |x_i: &Pose2, x_j: &Pose2| c.i_from_j.between(&x_i.between(x_j)).to_vector();
        let (x_i, x_j) = (graph.poses()[c.i as usize], graph.poses()[c.j as usize]);
        let mut jacobian = nalgebra::Matrix3x6::zeros();
        for column in 0..6 {
            let at = |step: f64| {
                let (mut a, mut b) = (x_i.to_vector(), x_j.to_vector());
                if column < 3 {
                    a[column] += step
                } else {
                    b[column - 3] += step
                }
                error(&Pose2::from_vector(&a), &Pose2::from_vector(&b))
            };
            jacobian.set_column(column, &((at(1e-5) - at(-1e-5)) / 2e-5));
        }
        let block = jacobian.transpose() * c.information.as_matrix() * jacobian;
        let unknown = |k: usize| if k < 3 { 3 * c.i as usize + k } else { 3 * c.j as usize + k - 3 };
        for row in 0..6 {
            for column in 0..6 {
                dense[(unknown(row), unknown(column))] += block[(row, column)];
            }
        }
    }
    dense.view((3, 3), (num_unknowns - 3, num_unknowns - 3)).into_owned()
}
