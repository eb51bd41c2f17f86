//! The g2o text format for graphs in the plane.
//!
//! ```text
//! VERTEX_SE2 id x y theta
//! FIX id …
//! EDGE_SE2 i j dx dy dtheta I11 I12 I13 I22 I23 I33
//! ```
//!
//! The information is the upper triangle, row by row. Vertices may be missing; they then start where the edges lead.

use std::fmt::Write as _;

use nalgebra::Matrix3;

use super::fields::without_mark;
use super::graph_text::{EdgeLine, GraphDocument, GraphLines, GraphTextError, Words};

/// Reads a graph.
///
/// # Errors
/// [`GraphTextError`] naming the first line that is malformed, of an unknown kind, a constraint that cannot be used
/// (landmarks, priors, three dimensions), or impossible (NaN, information that is not positive semidefinite, an edge
/// from a vertex to itself, a vertex given twice).
pub fn read_g2o(text: &str) -> Result<GraphDocument, GraphTextError> {
    let mut lines = GraphLines::default();
    for (index, text) in without_mark(text).lines().enumerate() {
        let line = index + 1;
        let Some((tag, mut words)) = Words::of(line, text) else { continue };
        match tag {
            "VERTEX_SE2" => {
                let id = words.id("id")?;
                lines.add_vertex(line, id, words.pose()?)?;
                words.end()?;
            }
            "EDGE_SE2" => {
                let (i, j) = (words.id("first id")?, words.id("second id")?);
                let i_from_j = words.pose()?;
                let [xx, xy, xt, yy, yt, tt] = words.numbers("information")?;
                words.end()?;
                let information = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
                lines.add_edge(EdgeLine { line, i, j, i_from_j, information });
            }
            "FIX" => {
                for word in text.split_ascii_whitespace().skip(1) {
                    let problem = || GraphTextError::new(line, format!("{word:?} is no vertex"));
                    lines.fix(line, word.parse().map_err(|_| problem())?);
                }
            }
            other => lines.pass_over(line, other)?,
        }
    }
    lines.into_document()
}

/// Writes a graph so that reading it gives the same numbers, bit by bit.
pub fn write_g2o(document: &GraphDocument) -> String {
    let mut text = String::new();
    for (id, pose) in document.ids.iter().zip(document.graph.poses()) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "VERTEX_SE2 {id} {} {} {}", pose.x, pose.y, pose.theta);
    }
    for &held in document.graph.held() {
        let _ = writeln!(text, "FIX {}", document.ids[held as usize]);
    }
    for constraint in document.graph.constraints() {
        let (i, j) = (document.ids[constraint.i as usize], document.ids[constraint.j as usize]);
        let (z, m) = (constraint.i_from_j, constraint.information.as_matrix());
        let _ = writeln!(
            text,
            "EDGE_SE2 {i} {j} {} {} {} {} {} {} {} {} {}",
            z.x,
            z.y,
            z.theta,
            m[(0, 0)],
            m[(0, 1)],
            m[(0, 2)],
            m[(1, 1)],
            m[(1, 2)],
            m[(2, 2)]
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a triangle\nEDGE_SE2 7 3 1 0 0 1 0 0 2 0 3\nVERTEX_SE2 3 0.1 0.2 0.3\nVERTEX_SE2 7 1 2 3\n\n\
        EDGE_SE2 3 9 1 0 1.5 1 0.1 0.2 2 0.3 3\nVERTEX_SE2 9 4 5 6\nFIX 7\n";

    #[test]
    fn reads_lines_in_any_order() {
        let document = read_g2o(TEXT).unwrap();
        assert_eq!(document.ids, [3, 7, 9]);
        assert_eq!(document.graph.poses()[1].theta, 3.0);
        assert_eq!(document.graph.held(), [1]);
        let second = &document.graph.constraints()[1];
        assert_eq!((second.i, second.j), (0, 2));
        assert_eq!(second.information.as_matrix()[(2, 1)], 0.3);
    }

    #[test]
    fn writes_what_it_read() {
        let document = read_g2o(TEXT).unwrap();
        assert_eq!(read_g2o(&write_g2o(&document)).unwrap(), document);
    }

    #[test]
    fn lines_that_constrain_nothing_are_passed_over_and_counted() {
        let data = "PARAMS_SE2OFFSET 0 0 0 0\nVERTEX_TAG 3\nVERTEX_TAG 7\nROBOTLASER1 0 -1 2\n\
            DATA_FEATURE_POINTXY 1 2\nLASER_ROBOT_DATA 1\n";
        let document = read_g2o(&format!("\u{feff}{data}{}", TEXT.replace('\n', "\r\n"))).unwrap();
        assert_eq!(document.graph, read_g2o(TEXT).unwrap().graph);
        assert_eq!((document.passed_over["VERTEX_TAG"], document.passed_over.len()), (2, 5));
    }

    #[test]
    fn odometry_is_what_chains_the_vertices_whatever_their_names() {
        use crate::pose_graph::Trust::{Doubtful, Trusted};
        // Drive 0 1 2 3, closure 0 3, under four ways to name the poses.
        for names in [[0, 1, 2, 3], [0, 10, 20, 30], [5, 6, 9, 100], [40, 2, 17, 3]] {
            let vertices: String = names.iter().map(|id| format!("VERTEX_SE2 {id} 0 0 0\n")).collect();
            let edge = |i: usize, j: usize| format!("EDGE_SE2 {} {} 1 0 0 1 0 0 1 0 1\n", names[i], names[j]);
            let text = vertices + &edge(0, 3) + &edge(1, 2) + &edge(1, 0) + &edge(2, 3);
            let document = read_g2o(&text).unwrap();
            assert_eq!(document.graph.trusts(), [Doubtful, Trusted, Trusted, Trusted], "{names:?}");
        }
    }

    #[test]
    fn chains_edges_where_vertices_are_missing() {
        let text = "EDGE_SE2 0 1 1 0 1.5707963267948966 1 0 0 1 0 1\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\n";
        let document = read_g2o(text).unwrap();
        let last = document.graph.poses()[2];
        assert!((last.x - 1.0).abs() < 1e-12 && (last.y - 1.0).abs() < 1e-12);
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("\nVERTEX_SE2 0 1 2", 2, "theta is missing"),
            ("VERTEX_SE2 0 1 2 NaN", 1, "not finite"),
            ("VERTEX_SE2 0 1 2 3 4", 1, "unexpected"),
            ("VERTEX_SE2 0 1 2 3\nVERTEX_SE2 0 1 2 3", 2, "before"),
            ("VERTEX_SE2 a 1 2 3", 1, "whole number"),
            ("EDGE_SE2 0 0 1 0 0 1 0 0 1 0 1", 1, "itself"),
            ("EDGE_SE2 0 1 1 0 inf 1 0 0 1 0 1", 1, "not finite"),
            ("EDGE_SE2 0 1 1 0 0 1 5 0 1 0 1", 1, "semidefinite"),
            ("EDGE_SE2 0 1 1 0 0 1 0 0 1 0", 1, "information is missing"),
            ("FIX 4", 1, "unknown"),
            ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1", 1, "three dimensions are not supported"),
            ("EDGE_SE3:QUAT 0 1 0 0 0", 1, "three dimensions are not supported"),
            ("VERTEX_XY 4 1 2", 1, "landmarks are not supported"),
            ("EDGE_SE2_XY 0 4 1 2 1 0 1", 1, "landmarks are not supported"),
            ("EDGE_PRIOR_SE2 0 1 2 3 1 0 0 1 0 1", 1, "priors on poses are not supported"),
            ("EDGE_SE2_SWITCHABLE 0 1 2", 1, "switches of their own"),
            ("EDGE_SE2_OFFSET 0 1 2", 1, "of this kind are not supported"),
            ("WALL 0 1 2", 1, "unknown tag"),
        ];
        for (text, line, problem) in cases {
            let error = read_g2o(text).unwrap_err();
            assert_eq!(error.line, line, "{text:?}");
            assert!(error.problem.contains(problem), "{text:?}: {error}");
        }
    }
}
