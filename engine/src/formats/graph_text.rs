//! What g2o and TORO files have in common: named vertices, edges, lines of words, and lines of other data.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use thiserror::Error;

use crate::geometry::Pose2;
use crate::pose_graph::{InformationMatrix, PoseConstraint, PoseGraph, PoseGraphError, spanning_tree_start};

/// A line that cannot be read.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("line {line}: {problem}")]
pub struct GraphTextError {
    /// Number of the line, from 1; 0 when the text as a whole is at fault.
    pub line: usize,
    /// What is wrong with it.
    pub problem: String,
}

impl GraphTextError {
    pub(super) fn new(line: usize, problem: impl std::fmt::Display) -> Self {
        Self { line, problem: problem.to_string() }
    }
}

/// A pose graph with the names that its file gave to the poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GraphDocument {
    /// The graph; poses are in ascending order of their identifiers.
    pub graph: PoseGraph,
    /// Identifier of every pose in the file.
    pub ids: Vec<u64>,
    /// Lines that were passed over since they put no constraint on poses, such as scans and parameters: how many of
    /// each tag.
    pub passed_over: BTreeMap<String, usize>,
}

impl GraphDocument {
    /// Names the poses of a graph 0, 1, 2 …
    pub fn numbered(graph: PoseGraph) -> Self {
        let ids = (0..graph.poses().len() as u64).collect();
        Self { graph, ids, passed_over: BTreeMap::new() }
    }
}

/// An edge as it stands in the file.
pub(super) struct EdgeLine {
    pub line: usize,
    pub i: u64,
    pub j: u64,
    pub i_from_j: Pose2,
    pub information: Matrix3<f64>,
}

/// The lines of a file, before identifiers become indices.
#[derive(Default)]
pub(super) struct GraphLines {
    /// Identifier → first guess, if the file has one.
    vertices: BTreeMap<u64, Option<Pose2>>,
    /// Identifiers as the file mentions them first.
    mentioned: Vec<u64>,
    edges: Vec<EdgeLine>,
    fixed: Vec<(usize, u64)>,
    passed_over: BTreeMap<String, usize>,
}

/// Tags and beginnings of tags of lines that carry data beside the graph: scans, parameters, marks, odometry.
const DATA_TAGS: [&str; 11] = [
    "PARAMS_",
    "DATA_",
    "LASER_",
    "ROBOTLASER",
    "RAWLASER",
    "FLASER",
    "RLASER",
    "ODOM",
    "VERTEX_TAG",
    "VERTEX_ELLIPSE",
    "EQUIV",
];

impl GraphLines {
    pub fn add_vertex(&mut self, line: usize, id: u64, pose: Pose2) -> Result<(), GraphTextError> {
        if !pose.is_finite() {
            return Err(GraphTextError::new(line, format!("the pose of vertex {id} is not finite")));
        }
        self.mention(id);
        match self.vertices.insert(id, Some(pose)) {
            Some(Some(_)) => Err(GraphTextError::new(line, format!("vertex {id} was given before"))),
            _ => Ok(()),
        }
    }

    /// An edge may stand before its vertices, or have none in the file.
    pub fn add_edge(&mut self, edge: EdgeLine) {
        for id in [edge.i, edge.j] {
            self.mention(id);
            self.vertices.entry(id).or_insert(None);
        }
        self.edges.push(edge);
    }

    fn mention(&mut self, id: u64) {
        if !self.vertices.contains_key(&id) {
            self.mentioned.push(id);
        }
    }

    /// Takes a line of another tag than the format's own.
    ///
    /// # Errors
    /// The line may constrain poses in a way that cannot be used, or nothing is known of it.
    pub fn pass_over(&mut self, line: usize, tag: &str) -> Result<(), GraphTextError> {
        if DATA_TAGS.iter().any(|data| tag.starts_with(data)) {
            *self.passed_over.entry(tag.to_owned()).or_default() += 1;
            return Ok(());
        }
        let names_any = |words: &[&str]| words.iter().any(|word| tag.contains(word));
        let kind = if !tag.starts_with("VERTEX") && !tag.starts_with("EDGE") {
            return Err(GraphTextError::new(line, format!("unknown tag {tag:?}")));
        } else if names_any(&["SE3", "VERTEX3", "EDGE3", "3D", "XYZ"]) {
            "graphs in three dimensions"
        } else if names_any(&["PRIOR"]) {
            "priors on poses"
        } else if names_any(&["XY", "POINT", "BEARING", "LANDMARK", "LINE", "SEGMENT"]) {
            "landmarks"
        } else if names_any(&["SWITCH", "MAXMIX"]) {
            "edges with switches of their own"
        } else {
            "vertices and edges of this kind"
        };
        Err(GraphTextError::new(line, format!("{kind} are not supported ({tag}): only poses in the plane")))
    }

    pub fn fix(&mut self, line: usize, id: u64) {
        self.fixed.push((line, id));
    }

    /// Builds the graph; vertices without a pose get one by chaining edges, consecutive ones first.
    pub fn into_document(self) -> Result<GraphDocument, GraphTextError> {
        let mut graph = PoseGraph::new();
        let ids: Vec<u64> = self.vertices.keys().copied().collect();
        let has_poses = self.vertices.values().all(Option::is_some);
        for pose in self.vertices.values() {
            graph.add_pose(pose.unwrap_or_default()).map_err(|error| GraphTextError::new(0, error))?;
        }
        let index_of = |id: u64| ids.binary_search(&id).map(|index| index as u32);
        let successors = self.successors(&ids);
        for edge in &self.edges {
            let at_line = |problem: &dyn std::fmt::Display| GraphTextError::new(edge.line, problem);
            let (Ok(i), Ok(j)) = (index_of(edge.i), index_of(edge.j)) else { continue };
            let information = InformationMatrix::try_new(edge.information)
                .map_err(|error| at_line(&format!("information: {error}")))?;
            // The formats do not say what an edge is; between consecutive vertices it is odometry.
            let constraint = PoseConstraint { i, j, i_from_j: edge.i_from_j, information };
            let follows = |from: u64, to: u64| successors.get(&from) == Some(&to);
            let added = if follows(edge.i, edge.j) || follows(edge.j, edge.i) {
                graph.add_constraint(constraint)
            } else {
                graph.add_doubtful(constraint)
            };
            added.map_err(|error| match error {
                PoseGraphError::SelfConstraint { .. } => at_line(&"the edge joins a vertex to itself"),
                PoseGraphError::MeasurementNotFinite { .. } => at_line(&"the measurement is not finite"),
                other => at_line(&other),
            })?;
        }
        for &(line, id) in &self.fixed {
            let index =
                index_of(id).map_err(|_| GraphTextError::new(line, format!("vertex {id} is unknown")))?;
            graph.hold(index).map_err(|error| GraphTextError::new(line, error))?;
        }
        if !has_poses {
            let is_known: Vec<bool> = self.vertices.values().map(Option::is_some).collect();
            spanning_tree_start(&mut graph, &is_known);
        }
        Ok(GraphDocument { graph, ids, passed_over: self.passed_over })
    }

    /// Which vertex follows which along the drive. Identifiers are only names: the drive's order is theirs or that in
    /// which the file mentions them, whichever is chained by more edges.
    fn successors(&self, ascending: &[u64]) -> BTreeMap<u64, u64> {
        let edges: BTreeSet<(u64, u64)> =
            self.edges.iter().flat_map(|edge| [(edge.i, edge.j), (edge.j, edge.i)]).collect();
        let num_chained =
            |order: &[u64]| order.windows(2).filter(|pair| edges.contains(&(pair[0], pair[1]))).count();
        let is_mixed = num_chained(&self.mentioned) > num_chained(ascending);
        let order = if is_mixed { &self.mentioned } else { ascending };
        order.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }
}

/// The words of one line, taken one by one.
pub(super) struct Words<'a> {
    line: usize,
    words: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Words<'a> {
    /// The line's tag and the words after it; `None` for a blank line or a comment.
    pub fn of(line: usize, text: &'a str) -> Option<(&'a str, Self)> {
        let mut words = text.split_ascii_whitespace();
        let tag = words.next().filter(|tag| !tag.starts_with('#'))?;
        Some((tag, Self { line, words }))
    }

    fn next(&mut self, name: &str) -> Result<&'a str, GraphTextError> {
        self.words.next().ok_or_else(|| GraphTextError::new(self.line, format!("{name} is missing")))
    }

    pub fn id(&mut self, name: &str) -> Result<u64, GraphTextError> {
        let word = self.next(name)?;
        word.parse().map_err(|_| {
            GraphTextError::new(self.line, format!("{name} must be a whole number, not {word:?}"))
        })
    }

    pub fn number(&mut self, name: &str) -> Result<f64, GraphTextError> {
        let word = self.next(name)?;
        word.parse()
            .map_err(|_| GraphTextError::new(self.line, format!("{name} must be a number, not {word:?}")))
    }

    pub fn pose(&mut self) -> Result<Pose2, GraphTextError> {
        let (x, y, theta) = (self.number("x")?, self.number("y")?, self.number("theta")?);
        Ok(Pose2::new(x, y, theta))
    }

    pub fn numbers<const N: usize>(&mut self, name: &str) -> Result<[f64; N], GraphTextError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(name)?;
        }
        Ok(numbers)
    }

    /// Fails when words are left over.
    pub fn end(mut self) -> Result<(), GraphTextError> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(GraphTextError::new(self.line, format!("unexpected {word:?} at the end"))),
        }
    }
}
