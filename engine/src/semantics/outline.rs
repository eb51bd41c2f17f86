//! The borders of a set of cells.

use std::collections::BTreeMap;

use crate::geometry::Point2;

type Corner = (i64, i64);

/// The outer border of cells that hang together, counter-clockwise, corners only, metres.
///
/// Cells that touch only at a corner are kept together by stepping over that corner. O(n log n).
pub(super) fn outline(cells: &[(i64, i64)], cell_m: f64) -> Vec<Point2> {
    rings(cells, cell_m).into_iter().next().unwrap_or_default()
}

/// All borders of cells that hang together: the outer one first, counter-clockwise, then those of the holes, clockwise;
/// corners only, metres. O(n log n).
pub(super) fn rings(cells: &[(i64, i64)], cell_m: f64) -> Vec<Vec<Point2>> {
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
    let mut rings = Vec::new();
    // The lowest corner of the leftmost cell lies on the outer border, and has the smallest coordinates of all.
    while let Some((&start, _)) = edges.first_key_value() {
        let ring = walk(&mut edges, start);
        rings.push(ring.iter().map(|&(x, y)| Point2::new(x as f64 * cell_m, y as f64 * cell_m)).collect());
    }
    rings
}

/// Takes the edges of one ring out, from a corner where it begins, and gives the corners where it turns.
fn walk(edges: &mut BTreeMap<Corner, Vec<Corner>>, start: Corner) -> Vec<Corner> {
    let mut ring = vec![start];
    let mut here = start;
    let mut heading: Option<(i64, i64)> = None;
    while let Some(next) = take_rightmost(edges, here, heading) {
        let step = (next.0 - here.0, next.1 - here.1);
        if heading == Some(step) {
            ring.pop();
        }
        ring.push(next);
        (here, heading) = (next, Some(step));
        if here == start {
            break;
        }
    }
    ring.pop();
    ring
}

/// Where two borders meet in a corner, turning right walks around both cells instead of cutting one off.
fn take_rightmost(
    edges: &mut BTreeMap<Corner, Vec<Corner>>,
    here: Corner,
    heading: Option<(i64, i64)>,
) -> Option<Corner> {
    let nexts = edges.get_mut(&here)?;
    let turn = |next: &Corner| {
        let step = (next.0 - here.0, next.1 - here.1);
        heading.map_or(0, |heading| heading.0 * step.1 - heading.1 * step.0)
    };
    let rightmost = (0..nexts.len()).min_by_key(|&idx| turn(&nexts[idx]))?;
    let next = nexts.remove(rightmost);
    if nexts.is_empty() {
        edges.remove(&here);
    }
    Some(next)
}

/// A ring with fewer corners, none of whose old ones lies farther than `tolerance_m` from it (Douglas and Peucker). A
/// ring that would vanish stays as it is. O(n²) at worst.
pub(super) fn simplified(ring: &[Point2], tolerance_m: f64) -> Vec<Point2> {
    let farthest_from = |from: usize| {
        let distance = |idx: &usize| ring[*idx].distance(&ring[from]);
        (0..ring.len()).max_by(|a, b| distance(a).total_cmp(&distance(b)).then(b.cmp(a)))
    };
    let Some(far) = farthest_from(0).filter(|far| *far > 0) else { return ring.to_vec() };
    let mut is_kept = vec![false; ring.len() + 1];
    (is_kept[0], is_kept[far]) = (true, true);
    let at = |idx: usize| &ring[idx % ring.len()];
    let mut waiting = vec![(0, far), (far, ring.len())];
    while let Some((first, last)) = waiting.pop() {
        let distance = |idx: &usize| distance_to_segment(at(*idx), at(first), at(last));
        let farthest = (first + 1..last).max_by(|a, b| distance(a).total_cmp(&distance(b)).then(b.cmp(a)));
        if let Some(middle) = farthest.filter(|middle| distance(middle) > tolerance_m) {
            is_kept[middle] = true;
            waiting.extend([(first, middle), (middle, last)]);
        }
    }
    let kept: Vec<Point2> = (0..ring.len()).filter(|&idx| is_kept[idx]).map(|idx| ring[idx]).collect();
    if kept.len() < 3 { ring.to_vec() } else { kept }
}

fn distance_to_segment(point: &Point2, from: &Point2, to: &Point2) -> f64 {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let length_squared = dx * dx + dy * dy;
    let along = (point.x - from.x) * dx + (point.y - from.y) * dy;
    let share = if length_squared > 0.0 { (along / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(&Point2::new(from.x + share * dx, from.y + share * dy))
}

/// Whether a point lies inside rings of which the holes are some: a line from it crosses them an odd number of times.
pub(super) fn is_inside(rings: &[Vec<Point2>], point: &Point2) -> bool {
    let crosses = |(a, b): (&Point2, &Point2)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    let crossings = |ring: &Vec<Point2>| {
        let nexts = ring.iter().cycle().skip(1);
        ring.iter().zip(nexts).filter(|side| crosses(*side)).count()
    };
    rings.iter().map(crossings).sum::<usize>() % 2 == 1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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

    #[test]
    fn steps_along_a_slanted_wall_become_one_side() {
        let cells: Vec<(i64, i64)> = (0..40).flat_map(|x| (0..=x / 4 + 5).map(move |y| (x, y))).collect();
        let ring = outline(&cells, 0.1);
        let simple = simplified(&ring, 0.1);
        assert!(ring.len() > 15 && simple.len() <= 5, "{} {}", ring.len(), simple.len());
        assert!((area(&simple) - area(&ring)).abs() < 0.4);
        assert_eq!(simplified(&ring[..2], 0.1), ring[..2]);
    }

    proptest! {
        #[test]
        fn rings_hold_exactly_their_cells(is_held in prop::collection::vec(prop::bool::weighted(0.6), 80)) {
            let all = || (0..80i64).map(|idx| (idx % 10, idx / 10));
            let cells: Vec<(i64, i64)> = all().zip(&is_held).filter(|(_, held)| **held).map(|(cell, _)| cell).collect();
            let rings = rings(&cells, 1.0);
            prop_assert_eq!(rings.iter().map(|ring| area(ring)).sum::<f64>(), cells.len() as f64);
            for ((x, y), held) in all().zip(&is_held) {
                prop_assert_eq!(is_inside(&rings, &Point2::new(x as f64 + 0.5, y as f64 + 0.5)), *held);
            }
        }
    }
}
