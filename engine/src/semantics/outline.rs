//! The border of a set of cells.

use std::collections::BTreeMap;

use crate::geometry::Point2;

type Corner = (i64, i64);

/// The outer border of cells that hang together, counter-clockwise, corners only, metres.
///
/// Cells that touch only at a corner are kept together by stepping over that corner. O(n log n).
pub(super) fn outline(cells: &[(i64, i64)], cell_m: f64) -> Vec<Point2> {
    let mut sorted = cells.to_vec();
    sorted.sort_unstable();
    let holds = |cell: (i64, i64)| sorted.binary_search(&cell).is_ok();
    // Edges with the inside on their left, by the corner where they begin.
    let mut edges: BTreeMap<Corner, Vec<Corner>> = BTreeMap::new();
    for &(x, y) in &sorted {
        let sides = [
            ((x, y - 1), (x, y), (x + 1, y)),
            ((x + 1, y), (x + 1, y), (x + 1, y + 1)),
            ((x, y + 1), (x + 1, y + 1), (x, y + 1)),
            ((x - 1, y), (x, y + 1), (x, y)),
        ];
        for (beside, from, to) in sides {
            if !holds(beside) {
                edges.entry(from).or_default().push(to);
            }
        }
    }
    // The lowest corner of the leftmost cell lies on the outer border.
    let Some(&start) = sorted.first() else { return Vec::new() };
    let mut ring: Vec<Corner> = vec![start];
    let mut here = start;
    let mut heading = (1, 0);
    let num_edges: usize = edges.values().map(Vec::len).sum();
    for _ in 0..num_edges {
        let Some(next) = edges.get(&here).and_then(|nexts| rightmost(here, heading, nexts)) else { break };
        let step = (next.0 - here.0, next.1 - here.1);
        if step == heading && ring.len() > 1 {
            ring.pop();
        }
        ring.push(next);
        (here, heading) = (next, step);
        if here == start {
            break;
        }
    }
    ring.pop();
    ring.iter().map(|&(x, y)| Point2::new(x as f64 * cell_m, y as f64 * cell_m)).collect()
}

/// Where two borders meet in a corner, turning right walks around both cells instead of cutting one off.
fn rightmost(here: Corner, heading: (i64, i64), nexts: &[Corner]) -> Option<Corner> {
    nexts.iter().copied().min_by_key(|next| {
        let step = (next.0 - here.0, next.1 - here.1);
        heading.0 * step.1 - heading.1 * step.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(ring: &[Point2]) -> f64 {
        let next = ring.iter().cycle().skip(1);
        ring.iter().zip(next).map(|(a, b)| a.x * b.y - a.y * b.x).sum::<f64>() / 2.0
    }

    #[test]
    fn a_bar_has_four_corners() {
        let ring = outline(&[(2, 1), (3, 1), (4, 1)], 0.5);
        assert_eq!(ring.len(), 4);
        assert!((area(&ring) - 0.75).abs() < 1e-12);
    }

    #[test]
    fn an_angle_has_six_and_a_diagonal_holds_together() {
        let angle = outline(&[(0, 0), (1, 0), (0, 1)], 1.0);
        assert_eq!((angle.len(), area(&angle)), (6, 3.0));
        let diagonal = outline(&[(0, 0), (1, 1)], 1.0);
        assert_eq!(area(&diagonal), 2.0);
        assert!(outline(&[], 1.0).is_empty());
    }
}
