//! People who walk from place to place and take no part in the map.

use rand::{Rng, RngExt};

use super::config::PeopleConfig;
use super::planner::Planner;
use super::ray_cast::Disc;
use locution_engine::geometry::Point2;

/// People keep off the walls by this much.
const COMFORT_M: f64 = 0.5;

/// One walker on the way to somewhere.
#[derive(Clone, Debug)]
struct Walker {
    way: Vec<Point2>,
    next_idx: usize,
    position: Point2,
    speed_m_per_s: f64,
}

/// Everybody in the building.
#[derive(Clone, Debug)]
pub(super) struct People {
    radius_m: f64,
    walkers: Vec<Walker>,
    /// Where people may stand: what can be reached from the robot's start.
    places: Vec<Point2>,
}

impl People {
    /// People at random places among `places`.
    pub(super) fn new(config: &PeopleConfig, places: Vec<Point2>, rng: &mut impl Rng) -> Self {
        let num_people = if places.is_empty() { 0 } else { config.num_people };
        let walkers = (0..num_people)
            .map(|_| Walker {
                way: Vec::new(),
                next_idx: 0,
                position: places[rng.random_range(0..places.len())],
                speed_m_per_s: config.speed_m_per_s * rng.random_range(0.7..1.3),
            })
            .collect();
        Self { radius_m: config.radius_m, walkers, places }
    }

    /// Everybody walks on for `duration_s`; who has arrived goes somewhere else.
    pub(super) fn walk(&mut self, duration_s: f64, planner: &Planner, rng: &mut impl Rng) {
        for walker in &mut self.walkers {
            if walker.next_idx >= walker.way.len() {
                let goal = self.places[rng.random_range(0..self.places.len())];
                let ways = planner.ways_from(&walker.position, COMFORT_M);
                walker.way = ways.and_then(|ways| planner.way_to(&ways, &goal)).unwrap_or_default();
                walker.next_idx = 0;
            }
            let mut left_m = walker.speed_m_per_s * duration_s;
            while let Some(&next) = walker.way.get(walker.next_idx) {
                let distance_m = walker.position.distance(&next);
                if distance_m > left_m {
                    let share = left_m / distance_m;
                    walker.position.x += share * (next.x - walker.position.x);
                    walker.position.y += share * (next.y - walker.position.y);
                    break;
                }
                left_m -= distance_m;
                walker.position = next;
                walker.next_idx += 1;
            }
        }
    }

    /// Where everybody is.
    pub(super) fn discs(&self) -> Vec<Disc> {
        self.walkers.iter().map(|walker| Disc { center: walker.position, radius_m: self.radius_m }).collect()
    }
}
