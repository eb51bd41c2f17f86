//! Pose graphs into which wrong closures are forged, drawn as the papers on robust back ends draw them.
//!
//! Two generators are in use, and they differ in what they claim:
//! - the Vertigo suite (also of IPC and TACO): ends at random or at most 20 poses apart, relative poses near the
//!   identity (0.3 m, 10°), the information of a closure of the graph;
//! - riSAM: the identity between poses that are truly elsewhere, with a standard deviation of 0.1 m and 0.1 rad.
//!
//! In a group, following poses are claimed to be one place with the same relative pose.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::judge_trajectory;
use crate::simulation::standard_normal;
use locution_engine::geometry::Pose2;
use locution_engine::pose_graph::{InformationMatrix, PoseConstraint, PoseGraph, PoseGraphError, Trust};

/// Which generator draws the wrong closures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Generator {
    /// Vertigo, ends anywhere.
    VertigoRandom,
    /// Vertigo, ends at most 20 poses apart.
    VertigoLocal,
    /// riSAM, ends anywhere that is not the same place.
    RisamRandom,
    /// riSAM, ends within 10 m of each other that are not the same place.
    RisamClose,
}

/// How wrong closures are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutlierDraw {
    /// Who draws them.
    pub generator: Generator,
    /// Closures in a row that agree.
    pub group_size: u32,
}

/// Vertigo: farthest ends of local closures, poses.
const LOCAL_POSES: u32 = 20;
/// Vertigo: standard deviations of the relative pose.
const VERTIGO_SD: (f64, f64) = (0.3, 10.0 * std::f64::consts::PI / 180.0);
/// riSAM: standard deviation of a wrong closure, metres and radians.
const RISAM_SD: f64 = 0.1;
/// riSAM: a closure is wrong if the true pose is at least as many standard deviations away as its script compares with,
/// the 99 % bound of χ² with three degrees of freedom.
const RISAM_SD_MIN: f64 = 11.345;
/// riSAM: radius of close closures, metres.
const CLOSE_M: f64 = 10.0;

/// Adds wrong closures until they are `percent` of all closures. `solution` holds the poses of the clean graph, in the
/// order of its poses, which is that of the drive.
///
/// # Errors
/// The graph has fewer poses than a group needs, or no closure.
pub fn spoil(
    graph: &PoseGraph,
    solution: &[Pose2],
    draw: OutlierDraw,
    percent: u32,
    rng: &mut impl Rng,
) -> Result<PoseGraph, PoseGraphError> {
    let closures =
        || graph.constraints().iter().zip(graph.trusts()).filter(|(_, trust)| **trust == Trust::Doubtful);
    let num_poses = graph.poses().len() as u32;
    let Some((first, _)) = closures().next() else { return Ok(graph.clone()) };
    if num_poses < draw.group_size + 3 {
        return Err(PoseGraphError::Empty);
    }
    let num_wanted = closures().count() * percent.min(99) as usize / (100 - percent.min(99) as usize);
    let mut spoiled = graph.clone();
    let mut num_added = 0;
    while num_added < num_wanted {
        let (mut i, mut j) = ends(solution, draw, rng);
        let (i_from_j, information) = match draw.generator {
            Generator::VertigoRandom | Generator::VertigoLocal => {
                let mut near_zero = |sd: f64| sd * standard_normal(rng);
                let (x, y, theta) =
                    (near_zero(VERTIGO_SD.0), near_zero(VERTIGO_SD.0), near_zero(VERTIGO_SD.1));
                (Pose2::new(x, y, theta), first.information)
            }
            Generator::RisamRandom | Generator::RisamClose => (Pose2::identity(), risam_information()),
        };
        for _ in 0..draw.group_size {
            if num_added == num_wanted || i.max(j) >= num_poses {
                break;
            }
            spoiled.add_doubtful(PoseConstraint { i, j, i_from_j, information })?;
            num_added += 1;
            (i, j) = (i + 1, j + 1);
        }
    }
    Ok(spoiled)
}

fn risam_information() -> InformationMatrix {
    InformationMatrix::from_standard_deviations(RISAM_SD, RISAM_SD, RISAM_SD)
        .expect("positive standard deviations make an information matrix")
}

/// The first two ends of a group.
fn ends(solution: &[Pose2], draw: OutlierDraw, rng: &mut impl Rng) -> (u32, u32) {
    let num_poses = solution.len() as u32;
    let last = num_poses - 1 - draw.group_size;
    loop {
        match draw.generator {
            Generator::VertigoRandom | Generator::VertigoLocal => {
                let first = rng.random_range(0..=last);
                let second = if draw.generator == Generator::VertigoLocal {
                    rng.random_range(first..=last.min(first + LOCAL_POSES))
                } else {
                    rng.random_range(0..=last)
                };
                let (first, second) = (first.min(second), first.max(second));
                // Neighbours in the drive would be odometry.
                let second = if second == first + 1 { first + 2 } else { second };
                if first != second {
                    return (first, second);
                }
            }
            Generator::RisamRandom | Generator::RisamClose => {
                let (first, second) =
                    (rng.random_range(0..num_poses - 1), rng.random_range(0..num_poses - 1));
                let true_pose = solution[first as usize].between(&solution[second as usize]);
                let is_far_off = true_pose.to_vector().norm() / RISAM_SD >= RISAM_SD_MIN;
                let is_close = true_pose.x.hypot(true_pose.y) <= CLOSE_M;
                if is_far_off
                    && first.abs_diff(second) >= 2
                    && (draw.generator == Generator::RisamRandom || is_close)
                {
                    return (first.max(second), first.min(second));
                }
            }
        }
    }
}

/// Root mean square distance of the poses from the true ones after the best rigid motion, metres.
pub fn rms_error_m(poses: &[Pose2], truth: &[Pose2]) -> f64 {
    let pairs: Vec<(Pose2, Pose2)> = poses.iter().copied().zip(truth.iter().copied()).collect();
    let error = judge_trajectory(&pairs).translation_m;
    error.mean.hypot(error.sd)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// A straight drive and back, with a closure at every fifth pose.
    fn there_and_back() -> (PoseGraph, Vec<Pose2>) {
        let along = |k: u32| Pose2::new(f64::from(k.min(199 - k)), 0.0, if k < 100 { 0.0 } else { 3.1 });
        let truth: Vec<Pose2> = (0..200).map(along).collect();
        let mut graph = PoseGraph::new();
        for pose in &truth {
            graph.add_pose(*pose).unwrap();
        }
        let mut add = |i: u32, j: u32| {
            let i_from_j = truth[i as usize].between(&truth[j as usize]);
            let information = risam_information();
            let constraint = PoseConstraint { i, j, i_from_j, information };
            if j == i + 1 { graph.add_constraint(constraint) } else { graph.add_doubtful(constraint) }
                .unwrap();
        };
        (0..199).for_each(|k| add(k, k + 1));
        (0..95).step_by(5).for_each(|k| add(k, 199 - k));
        (graph, truth)
    }

    #[test]
    fn draws_as_many_wrong_closures_as_asked_for_in_groups() {
        let (graph, truth) = there_and_back();
        let num_before = graph.constraints().len();
        for generator in
            [Generator::VertigoRandom, Generator::VertigoLocal, Generator::RisamRandom, Generator::RisamClose]
        {
            for group_size in [1, 10, 50] {
                let draw = OutlierDraw { generator, group_size };
                let spoil =
                    |seed| spoil(&graph, &truth, draw, 90, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
                let wrong = spoil(3).constraints()[num_before..].to_vec();
                assert_eq!(wrong.len(), 19 * 9, "{draw:?}");
                assert!(spoil(3) == spoil(3) && spoil(3) != spoil(4));
                let follows =
                    |pair: &&[PoseConstraint]| pair[1].i == pair[0].i + 1 && pair[1].j == pair[0].j + 1;
                let num_following = wrong.windows(2).filter(follows).count();
                let num_expected = (group_size as usize - 1) * wrong.len() / group_size as usize;
                assert!(num_following + 8 + wrong.len() / 4 >= num_expected, "{draw:?}: {num_following}");
                for closure in &wrong {
                    assert!(closure.i.abs_diff(closure.j) >= 2);
                    let apart = closure.i.abs_diff(closure.j);
                    assert!(generator != Generator::VertigoLocal || apart <= LOCAL_POSES, "{apart}");
                }
            }
        }
    }

    #[test]
    fn wrong_closures_of_risam_are_wrong() {
        let (graph, truth) = there_and_back();
        let draw = OutlierDraw { generator: Generator::RisamClose, group_size: 1 };
        let spoiled = spoil(&graph, &truth, draw, 50, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        for closure in &spoiled.constraints()[graph.constraints().len()..] {
            let true_pose = truth[closure.i as usize].between(&truth[closure.j as usize]);
            assert!(true_pose.to_vector().norm() > 1.1 && true_pose.x.hypot(true_pose.y) <= 10.0);
        }
        assert!(rms_error_m(&truth, &truth) < 1e-9);
    }
}
