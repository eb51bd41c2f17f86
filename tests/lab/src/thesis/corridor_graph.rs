//! Corridors named by letters, as Table 4.1 names them, and routes spelled with the letters.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result};
use locution_engine::formats::{LabeledPlaces, LabeledRegion};
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

/// Where corridors meet or bend.
#[derive(Clone, Debug, Default)]
struct Meeting {
    /// Directions in which a corridor leaves, as signs along the axes.
    ways: BTreeSet<(i8, i8)>,
    /// Width of the widest of them.
    width_m: f64,
}

impl Meeting {
    /// What kind of place it is; none when a corridor runs straight through or ends.
    fn label(&self) -> Option<&'static str> {
        let ways: Vec<(i8, i8)> = self.ways.iter().copied().collect();
        match ways.as_slice() {
            [] | [_] => None,
            [a, b] => ((a.0 + b.0, a.1 + b.1) != (0, 0)).then_some("corner"),
            _ => Some("bifurcation"),
        }
    }
}

impl CorridorGraph {
    /// What kind of place each spot is: bifurcations and corners reach half a corridor's width beyond the crossing into
    /// each arm, as those that people drew on the recordings do; everything else is corridor.
    pub(super) fn labeled_places(&self) -> LabeledPlaces {
        let mut meetings: BTreeMap<(i64, i64), Meeting> = BTreeMap::new();
        let tenths = |meters: f64| (meters * 10.0).round() as i64;
        for corridor in &self.corridors {
            for leg in corridor.points.windows(2) {
                for (from, to) in [(leg[0], leg[1]), (leg[1], leg[0])] {
                    let sign = |by: i64| by.signum() as i8;
                    let way = (sign(tenths(to.x) - tenths(from.x)), sign(tenths(to.y) - tenths(from.y)));
                    let meeting = meetings.entry((tenths(from.x), tenths(from.y))).or_default();
                    meeting.ways.insert(way);
                    meeting.width_m = meeting.width_m.max(corridor.width_m);
                }
            }
        }
        let mut regions: Vec<LabeledRegion> = meetings
            .iter()
            .filter_map(|(&(x, y), meeting)| {
                let (x, y, reach) = (x as f64 / 10.0, y as f64 / 10.0, meeting.width_m);
                Some(region(meeting.label()?, (x - reach, y - reach), (x + reach, y + reach)))
            })
            .collect();
        // Crossings before corners where both claim a spot.
        regions.sort_by(|a, b| a.label.cmp(&b.label));
        regions.extend(self.corridors.iter().flat_map(|corridor| {
            let half = corridor.width_m / 2.0;
            corridor.points.windows(2).map(move |leg| {
                let low = (leg[0].x.min(leg[1].x) - half, leg[0].y.min(leg[1].y) - half);
                let high = (leg[0].x.max(leg[1].x) + half, leg[0].y.max(leg[1].y) + half);
                region("corridor", low, high)
            })
        }));
        LabeledPlaces { frame: "world".into(), notes: "Labelled by the simulator.".into(), regions }
    }
}

/// A rectangle between two opposite corners.
fn region(label: &str, low: (f64, f64), high: (f64, f64)) -> LabeledRegion {
    let polygon = vec![[low.0, low.1], [high.0, low.1], [high.0, high.1], [low.0, high.1]];
    LabeledRegion { label: label.into(), polygon }
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

    fn corridor(letter: char, points: &[(f64, f64)]) -> Corridor {
        let points = points.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        Corridor { letter, points, width_m: 2.0 }
    }

    #[test]
    fn routes_follow_their_letters() {
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

    #[test]
    fn places_are_what_meets_in_them() {
        let graph = CorridorGraph {
            corridors: vec![
                corridor('A', &[(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)]),
                corridor('B', &[(20.0, 0.0), (20.0, 9.0), (10.0, 9.0)]),
                corridor('C', &[(10.0, 0.0), (10.0, 9.0)]),
            ],
        };
        let places = graph.labeled_places();
        let label = |x, y| places.label_at(&Point2::new(x, y));
        assert_eq!(label(5.0, 0.5), Some("corridor"));
        assert_eq!(label(10.0, 1.5), Some("bifurcation"));
        assert_eq!(label(20.0, 0.0), Some("corner"));
        assert_eq!(label(10.0, 9.0), Some("corner"));
        assert_eq!(label(10.0, 4.5), Some("corridor"));
        assert_eq!(label(5.0, 5.0), None);
    }
}
