//! Corridors named by letters, as Table 4.1 names them, and routes spelled with the letters.

use anyhow::{Context, Result};
use locution_engine::geometry::Point2;

/// A corridor: its letter, the places it runs through and its width.
#[derive(Clone, Debug)]
pub(super) struct Corridor {
    pub letter: char,
    /// From junction to junction, each leg along an axis.
    pub points: Vec<Point2>,
    pub width_m: f64,
}

/// All corridors of a floor.
#[derive(Clone, Debug)]
pub(super) struct CorridorGraph {
    pub corridors: Vec<Corridor>,
}

impl CorridorGraph {
    /// Waypoints of a route: through each corridor's inner points, in the direction that leads to the next letter.
    pub(super) fn waypoints(&self, route: &str) -> Result<Vec<Point2>> {
        let letters: Vec<char> = route.chars().filter(|letter| letter.is_ascii_alphabetic()).collect();
        let corridors: Vec<&Corridor> = letters
            .iter()
            .map(|letter| self.corridors.iter().find(|corridor| corridor.letter == *letter))
            .collect::<Option<_>>()
            .with_context(|| format!("route {route} names an unknown corridor"))?;
        let mut waypoints: Vec<Point2> = Vec::new();
        let mut here: Option<Point2> = None;
        for (idx, corridor) in corridors.iter().enumerate() {
            let (Some(&first), Some(&last)) = (corridor.points.first(), corridor.points.last()) else {
                continue;
            };
            let next = corridors.get(idx + 1);
            let leads_on = |end: &Point2| next.is_none_or(|next| near_an_end(next, end));
            // Entered at the junction where the last corridor was left, or such that the next one can be reached.
            let is_forward = match here {
                Some(here) => first.distance(&here) <= last.distance(&here),
                None => leads_on(&last),
            };
            let mut inner = with_middle(&corridor.points);
            if !is_forward {
                inner.reverse();
            }
            let exit = if is_forward { last } else { first };
            if leads_on(&exit) {
                waypoints.extend(inner);
                here = Some(exit);
            } else {
                // The next letter is behind: the robot turned round half way along.
                waypoints.extend(inner.into_iter().take(1));
                here = Some(if is_forward { first } else { last });
            }
        }
        waypoints.dedup();
        Ok(waypoints)
    }
}

/// The corners of a corridor, or the middle of a straight one.
fn with_middle(points: &[Point2]) -> Vec<Point2> {
    match points {
        [first, last] => vec![Point2::new((first.x + last.x) / 2.0, (first.y + last.y) / 2.0)],
        [_, inner @ .., _] => inner.to_vec(),
        _ => points.to_vec(),
    }
}

fn near_an_end(corridor: &Corridor, place: &Point2) -> bool {
    let ends = corridor.points.first().into_iter().chain(corridor.points.last());
    ends.into_iter().any(|end| end.distance(place) < 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn routes_follow_their_letters() {
        let corridor = |letter, points: &[(f64, f64)]| Corridor {
            letter,
            points: points.iter().map(|&(x, y)| Point2::new(x, y)).collect(),
            width_m: 2.0,
        };
        let graph = CorridorGraph {
            corridors: vec![
                corridor('A', &[(0.0, 0.0), (10.0, 0.0)]),
                corridor('B', &[(0.0, 0.0), (0.0, 5.0), (10.0, 5.0), (10.0, 0.0)]),
            ],
        };
        let waypoints = graph.waypoints("A B A").unwrap();
        let expected = [(5.0, 0.0), (10.0, 5.0), (0.0, 5.0), (5.0, 0.0)].map(|(x, y)| Point2::new(x, y));
        assert_eq!(waypoints, expected);
        assert!(graph.waypoints("AX").is_err());
    }
}
