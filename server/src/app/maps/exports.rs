//! Map versions in the formats of other tools.

use std::collections::BTreeSet;

use locution_engine::formats::{GraphDocument, GrayImage, write_g2o};
use locution_engine::geometry::Point2;
use locution_engine::occupancy::{CellState, GridMap};
use locution_engine::pose_graph::{InformationMatrix, PoseConstraint, PoseGraph};

use super::matches::{MatchFilter, MatchOrder, matches};
use crate::app::runs::{StampedPose, trajectory_of};
use crate::app::site::Site;
use crate::app::{App, AppError, on_blocking_thread};
use crate::picture::{Line, Panel, draw_png, draw_svg};
use crate::records::{Map, PlacedRun};

/// Components drawn in one picture, the largest first.
const NUM_PANELS_MAX: usize = 12;

/// Head of every graph that is served.
const GRAPH_HEAD: &str = "\
# A vertex per keyframe, an edge per motion, and one per registration of verified matches; the first is held.
# The vertices are where the map has them, which is not quite the optimum of these edges: the map weighs registrations
# between submaps against each other, of which a match names the one that speaks for it, and shares out among the
# keyframes in between. Solving these edges anew therefore moves vertices, by a few decimeters where few matches tie a run.
";

/// The pose graph of a component in g2o's format: a vertex per keyframe, an edge per motion and per registration of verified
/// matches, the first vertex held. Comments say which run and scan each vertex is.
///
/// # Errors
/// Those of the storage; [`AppError::Internal`] for a graph that cannot be.
pub async fn graph_as_g2o(map: &Map, component: u32) -> Result<String, AppError> {
    let runs = map.placed_runs(Some(component)).await?;
    let mut graph = PoseGraph::new();
    // For each run or piece of one which keyframes of the run are vertices, and the number of the first.
    let mut vertices: Vec<(u32, std::ops::Range<u64>, u32)> = Vec::new();
    let mut text = GRAPH_HEAD.to_owned();
    for placed in &runs {
        let first = graph.poses().len() as u32;
        vertices.push((placed.map_run.run, placed.map_run.keyframes(), first));
        for (vertex, pose) in (first..).zip(&placed.poses) {
            graph.add_pose(pose.map_from_robot).map_err(AppError::internal)?;
            text += &format!("# {vertex} run {} scan {}\n", placed.map_run.name, pose.scan_seq);
        }
        if first == 0 && !placed.poses.is_empty() {
            graph.hold(first).map_err(AppError::internal)?;
        }
        add_motions(&mut graph, first, placed).await?;
    }
    // One registration may speak for several matches; it is one measurement all the same.
    let mut measured = BTreeSet::new();
    for numbered in matches(map, &MatchFilter::verified(), MatchOrder::Number, 0, usize::MAX).await?.0 {
        let found = numbered.found;
        let Some(fit) = found.evidence.registration else { continue };
        let vertex = |run: u32, keyframe: u32| {
            let keyframe = u64::from(keyframe);
            let holds = |of: &&(u32, std::ops::Range<u64>, u32)| of.0 == run && of.1.contains(&keyframe);
            vertices
                .iter()
                .find(holds)
                .map(|(_, keyframes, first)| first + (keyframe - keyframes.start) as u32)
        };
        let ends = (
            vertex(found.earlier.run_idx, fit.earlier_keyframe),
            vertex(found.later.run_idx, fit.later_keyframe),
        );
        if let (Some(earlier), Some(later)) = ends {
            let ends = (earlier, later);
            if !measured.insert(ends) {
                continue;
            }
            add_edge(&mut graph, ends, fit.earlier_from_later, &fit.covariance);
        }
    }
    text += &write_g2o(&GraphDocument::numbered(graph));
    Ok(text)
}

async fn add_motions(graph: &mut PoseGraph, first: u32, placed: &PlacedRun) -> Result<(), AppError> {
    let keyframes = placed.run.stored_keyframes().await?;
    let num_poses = placed.poses.len();
    let of_piece = keyframes.get(placed.map_run.first_keyframe as usize..).unwrap_or_default();
    for (idx, two) in of_piece.windows(2).take(num_poses.saturating_sub(1)).enumerate() {
        let motion = two[0].run_from_robot.between(&two[1].run_from_robot);
        let ends = (first + idx as u32, first + idx as u32 + 1);
        add_edge(graph, ends, motion, &two[1].motion_covariance);
    }
    Ok(())
}

/// Runs of a component, in their order, each with its pose at every scan of those of its pieces that lie there.
///
/// # Errors
/// Those of the storage.
pub async fn ways_of_runs(map: &Map, component: u32) -> Result<Vec<(String, Vec<StampedPose>)>, AppError> {
    let mut ways: Vec<(String, Vec<StampedPose>)> = Vec::new();
    for run in &map.record.runs {
        if run.num_poses > 0 && component == run.component {
            let stored = map.reader().run(run.run).await?;
            let way = trajectory_of(map, run, &stored).await?;
            match ways.last_mut() {
                // Another piece of the same run.
                Some((name, poses)) if *name == run.name => poses.extend(way),
                _ => ways.push((run.name.clone(), way)),
            }
        }
    }
    Ok(ways)
}

/// A covariance that cannot be inverted brings no edge: the graph is for looking at, not for trusting blindly.
fn add_edge(
    graph: &mut PoseGraph,
    (i, j): (u32, u32),
    i_from_j: locution_engine::geometry::Pose2,
    covariance: &[[f64; 3]; 3],
) {
    let covariance = in_axes_of_measurement(covariance, i_from_j.theta);
    if let Ok(information) = InformationMatrix::from_covariance(&covariance) {
        let _ = graph.add_constraint(PoseConstraint { i, j, i_from_j, information });
    }
}

/// Covariances are kept in the axes of the first pose; a graph's edge has them in those of the second, which is turned by
/// `theta` against it.
fn in_axes_of_measurement(covariance: &[[f64; 3]; 3], theta: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = theta.sin_cos();
    let turned = |[x, y, turn]: [f64; 3]| [cos * x + sin * y, cos * y - sin * x, turn];
    let transposed = |m: [[f64; 3]; 3]| [0, 1, 2].map(|column| m.map(|row| row[column]));
    transposed(transposed(covariance.map(turned)).map(turned))
}

/// The grey values of `map_server`: 254 free, 0 occupied, 205 unknown, the first row on top.
pub fn gray_image(grid: &GridMap) -> GrayImage {
    let gray = |cell: &CellState| match cell {
        CellState::Free => 254,
        CellState::Occupied => 0,
        CellState::Unknown => 205,
    };
    let rows = grid.cells().chunks(grid.width()).rev();
    GrayImage { width: grid.width(), height: grid.height(), pixels: rows.flatten().map(gray).collect() }
}

/// Which form a picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureForm {
    Png,
    Svg,
}

impl App {
    /// A picture of a version: walls, a colour per run, verified matches.
    pub async fn picture(
        &self,
        site: &Site,
        map: &Map,
        component: Option<u32>,
        form: PictureForm,
    ) -> Result<Vec<u8>, AppError> {
        let mut components: Vec<u32> =
            map.record.runs.iter().filter(|run| run.num_poses > 0).map(|run| run.component).collect();
        components.sort_unstable();
        components.dedup();
        components.retain(|known| component.is_none_or(|wanted| wanted == *known));
        components.truncate(NUM_PANELS_MAX);
        let mut drawn = Vec::new();
        for component in components {
            let grid = self.grid(site, map, component).await?;
            drawn.push((grid, lines_of(map, component).await?));
        }
        let drawing = move || {
            let panels: Vec<Panel<'_>> = drawn
                .iter()
                .map(|(grid, lines)| Panel { grid: grid.as_ref(), lines: lines.clone() })
                .collect();
            match form {
                PictureForm::Png => draw_png(&panels),
                PictureForm::Svg => Ok(draw_svg(&panels).into_bytes()),
            }
        };
        on_blocking_thread(drawing).await?.map_err(AppError::internal)
    }
}

/// Trajectories and verified matches of one component.
async fn lines_of(map: &Map, component: u32) -> Result<Vec<Line>, AppError> {
    let runs = map.placed_runs(Some(component)).await?;
    let mut lines: Vec<Line> = Vec::new();
    for numbered in matches(map, &MatchFilter::verified(), MatchOrder::Number, 0, usize::MAX).await?.0 {
        let Some(fit) = numbered.found.evidence.registration else { continue };
        let end = |run: u32, keyframe: u32| -> Option<Point2> {
            let keyframe = u64::from(keyframe);
            let is_held = |placed: &&PlacedRun| {
                placed.map_run.run == run && placed.map_run.keyframes().contains(&keyframe)
            };
            let placed = runs.iter().find(is_held)?;
            let idx = (keyframe - placed.map_run.first_keyframe) as usize;
            Some(placed.poses.get(idx)?.map_from_robot.position())
        };
        let ends = (
            end(numbered.found.earlier.run_idx, fit.earlier_keyframe),
            end(numbered.found.later.run_idx, fit.later_keyframe),
        );
        if let (Some(earlier), Some(later)) = ends {
            lines.push(Line { run: None, points: vec![earlier, later] });
        }
    }
    for placed in &runs {
        let points = placed.poses.iter().map(|pose| pose.map_from_robot.position()).collect();
        lines.push(Line { run: Some(placed.map_run.run as usize), points });
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sure_along_the_first_pose_is_sure_across_one_that_is_turned_by_a_quarter() {
        let covariance = [[4.0, 1.0, 0.5], [1.0, 9.0, 0.25], [0.5, 0.25, 1.0]];
        let turned = in_axes_of_measurement(&covariance, std::f64::consts::FRAC_PI_2);
        let expected = [[9.0, -1.0, 0.25], [-1.0, 4.0, -0.5], [0.25, -0.5, 1.0]];
        for (row, wanted) in turned.iter().flatten().zip(expected.iter().flatten()) {
            assert!((row - wanted).abs() < 1e-12, "{turned:?}");
        }
        assert_eq!(in_axes_of_measurement(&covariance, 0.0), covariance);
    }
}
