//! The TORO text format for graphs in the plane.
//!
//! ```text
//! VERTEX2 id x y theta
//! EDGE2 i j dx dy dtheta I11 I12 I22 I33 I13 I23
//! EQUIV i j
//! ```
//!
//! The information comes in another order than in g2o. An `EQUIV` line says that two vertices are the same place; as
//! TORO's own optimiser does not constrain them, it is passed over like lines of scans.

use std::fmt::Write as _;

use nalgebra::Matrix3;

use super::fields::without_mark;
use super::graph_text::{EdgeLine, GraphDocument, GraphLines, GraphTextError, Words};

/// Reads a graph; `VERTEX` and `EDGE` are older names of `VERTEX2` and `EDGE2`.
///
/// # Errors
/// [`GraphTextError`] naming the first line that is malformed, of an unknown kind, a constraint that cannot be used
/// (landmarks, priors, three dimensions), or impossible (NaN, information that is not positive semidefinite, an edge
/// from a vertex to itself, a vertex given twice).
pub fn read_toro(text: &str) -> Result<GraphDocument, GraphTextError> {
    let mut lines = GraphLines::default();
    for (index, text) in without_mark(text).lines().enumerate() {
        let line = index + 1;
        let Some((tag, mut words)) = Words::of(line, text) else { continue };
        match tag {
            "VERTEX2" | "VERTEX" => {
                let id = words.id("id")?;
                lines.add_vertex(line, id, words.pose()?)?;
                words.end()?;
            }
            "EDGE2" | "EDGE" => {
                let (i, j) = (words.id("first id")?, words.id("second id")?);
                let i_from_j = words.pose()?;
                let [xx, xy, yy, tt, xt, yt] = words.numbers("information")?;
                words.end()?;
                let information = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
                lines.add_edge(EdgeLine { line, i, j, i_from_j, information });
            }
            other => lines.pass_over(line, other)?,
        }
    }
    lines.into_document()
}

/// Writes a graph so that reading it gives the same numbers, bit by bit. The format cannot say which poses are held.
pub fn write_toro(document: &GraphDocument) -> String {
    let mut text = String::new();
    for (id, pose) in document.ids.iter().zip(document.graph.poses()) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "VERTEX2 {id} {} {} {}", pose.x, pose.y, pose.theta);
    }
    for constraint in document.graph.constraints() {
        let (i, j) = (document.ids[constraint.i as usize], document.ids[constraint.j as usize]);
        let (z, m) = (constraint.i_from_j, constraint.information.as_matrix());
        let _ = writeln!(
            text,
            "EDGE2 {i} {j} {} {} {} {} {} {} {} {} {}",
            z.x,
            z.y,
            z.theta,
            m[(0, 0)],
            m[(0, 1)],
            m[(1, 1)],
            m[(2, 2)],
            m[(0, 2)],
            m[(1, 2)]
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0.5\nEDGE2 0 1 1 0 0.5 10 1 20 30 2 3\nEQUIV 0 1\n";

    #[test]
    fn knows_the_order_of_the_information() {
        let document = read_toro(TEXT).unwrap();
        let information = document.graph.constraints()[0].information;
        let expected = Matrix3::new(10.0, 1.0, 2.0, 1.0, 20.0, 3.0, 2.0, 3.0, 30.0);
        assert_eq!(*information.as_matrix(), expected);
    }

    #[test]
    fn writes_what_it_read() {
        let document = read_toro(TEXT).unwrap();
        let written = read_toro(&write_toro(&document)).unwrap();
        assert_eq!((written.graph, written.ids), (document.graph, document.ids));
        assert_eq!(document.passed_over["EQUIV"], 1);
    }

    #[test]
    fn errors_name_the_line() {
        let error = read_toro("VERTEX2 0 0 0 0\nEDGE2 0 1 1 0 0.5 10 1 20 30 2 oops\n").unwrap_err();
        assert_eq!((error.line, error.problem.contains("oops")), (2, true));
        assert!(read_toro("VERTEX3 0 0 0 0").unwrap_err().problem.contains("three dimensions"));
    }

    #[test]
    fn scans_beside_the_vertices_are_passed_over() {
        let laser = "ROBOTLASER1 0 -1.5 3.1 1.5 30 0.1 0 3 1 2 3 0 0 0 0 0 0 0 0 0 0 0 0 1 h 1";
        let text = TEXT.replace("EDGE2", &format!("{laser}\nEDGE2"));
        let document = read_toro(&text).unwrap();
        assert_eq!(document.graph, read_toro(TEXT).unwrap().graph);
        assert_eq!(document.passed_over["ROBOTLASER1"], 1);
    }
}
