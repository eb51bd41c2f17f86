//! Scenarios of the kind of thesis sections 4.3.1 and 5.3.1.
//!
//! The thesis gives loop lengths, routes and the sequence of door configurations but not the drawings in numbers.
//! Who may follow whom in Table 4.1 determines how the corridors hang together; their proportions are ours.

use crate::simulation::{SimulatedRun, SimulationConfig, Task, World, simulate_run};
use anyhow::Result;
use clap::ValueEnum;
use locution_engine::formats::LabeledPlaces;
use locution_engine::geometry::Point2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::corridor_graph::{Corridor, CorridorGraph};
use super::floor_plan::FloorPlan;

/// Recordings of one scenario with their truth.
pub(super) struct Scenario {
    /// Its name in the thesis.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// Runs whose start poses are unknown.
    pub runs: Vec<SimulatedRun>,
}

fn points(list: &[(f64, f64)]) -> Vec<Point2> {
    list.iter().map(|&(x, y)| Point2::new(x, y)).collect()
}

fn floor(graph: &CorridorGraph, size_m: (f64, f64)) -> Result<World> {
    let mut plan = FloorPlan::new(size_m, 3.0);
    for corridor in &graph.corridors {
        plan.corridor(&corridor.points, corridor.width_m);
    }
    plan.world()
}

/// A Pioneer with a SICK laser: 181 readings over 180°, 8 m of clear range are plenty in corridors.
fn pioneer(num_people: usize) -> SimulationConfig {
    let mut config = SimulationConfig::default();
    config.people.num_people = num_people;
    config
}

fn drive(
    world: &World,
    routes: &[Vec<Point2>],
    config: &SimulationConfig,
    seed: u64,
) -> Result<Vec<SimulatedRun>> {
    let numbered = routes.iter().enumerate();
    numbered
        .map(|(idx, route)| Ok(simulate_run(world, &Task::Route(route.clone()), config, seed + idx as u64)?))
        .collect()
}

/// A floor of chapter 4, of which is known what kind of place each spot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Plan {
    /// Four adjacent loops of 44 to 78 m.
    #[value(name = "four-loops")]
    Adjacent,
    /// Three nested loops, the largest of 88 m.
    #[value(name = "nested-loops")]
    Nested,
    /// Two adjacent loops of 60 and 90 m.
    #[value(name = "two-loops")]
    Pair,
}

impl Plan {
    /// The floor as a world, and what its places are.
    ///
    /// # Errors
    /// The world cannot be made.
    pub fn draw(self) -> Result<(World, LabeledPlaces)> {
        let (graph, size_m) = match self {
            Self::Adjacent => four_loops_graph(),
            Self::Nested => nested_loops_graph(),
            Self::Pair => two_loops_graph(),
        };
        Ok((floor(&graph, size_m)?, graph.labeled_places()))
    }
}

/// Corridors A to D are the outer corners, E to H the spokes that meet in the middle.
fn four_loops_graph() -> (CorridorGraph, (f64, f64)) {
    let corridor = |letter, list: &[(f64, f64)], width_m| Corridor { letter, points: points(list), width_m };
    let graph = CorridorGraph {
        corridors: vec![
            corridor('A', &[(0.0, 9.0), (0.0, 28.0), (13.0, 28.0)], 2.2),
            corridor('B', &[(13.0, 28.0), (33.0, 28.0), (33.0, 9.0)], 1.8),
            corridor('C', &[(33.0, 9.0), (33.0, 0.0), (13.0, 0.0)], 2.4),
            corridor('D', &[(13.0, 0.0), (0.0, 0.0), (0.0, 9.0)], 2.0),
            corridor('E', &[(0.0, 9.0), (13.0, 9.0)], 2.0),
            corridor('F', &[(13.0, 28.0), (13.0, 9.0)], 2.6),
            corridor('G', &[(33.0, 9.0), (13.0, 9.0)], 2.2),
            corridor('H', &[(13.0, 0.0), (13.0, 9.0)], 1.8),
        ],
    };
    (graph, (33.0, 28.0))
}

fn nested_loops_graph() -> (CorridorGraph, (f64, f64)) {
    let corridor = |letter, list: &[(f64, f64)]| Corridor { letter, points: points(list), width_m: 1.8 };
    let graph = CorridorGraph {
        corridors: vec![
            corridor('A', &[(0.0, 10.0), (0.0, 20.0), (12.0, 20.0)]),
            corridor('D', &[(12.0, 20.0), (24.0, 20.0), (24.0, 10.0)]),
            corridor('B', &[(0.0, 10.0), (0.0, 0.0), (12.0, 0.0)]),
            corridor('C', &[(12.0, 0.0), (24.0, 0.0), (24.0, 10.0)]),
            corridor('F', &[(0.0, 10.0), (4.0, 10.0), (4.0, 16.5), (12.0, 16.5)]),
            corridor('G', &[(12.0, 16.5), (20.0, 16.5), (20.0, 10.0), (24.0, 10.0)]),
            corridor('E', &[(0.0, 10.0), (4.0, 10.0), (4.0, 3.5), (12.0, 3.5)]),
            corridor('H', &[(12.0, 3.5), (20.0, 3.5), (20.0, 10.0), (24.0, 10.0)]),
            corridor('K', &[(12.0, 16.5), (12.0, 13.0), (8.0, 13.0), (8.0, 10.0)]),
            corridor('L', &[(8.0, 10.0), (8.0, 7.0), (12.0, 7.0), (12.0, 3.5)]),
            corridor('J', &[(12.0, 16.5), (12.0, 13.0), (16.0, 13.0), (16.0, 10.0)]),
            corridor('I', &[(16.0, 10.0), (16.0, 7.0), (12.0, 7.0), (12.0, 3.5)]),
        ],
    };
    (graph, (24.0, 20.0))
}

fn two_loops_graph() -> (CorridorGraph, (f64, f64)) {
    let corridor = |letter, list: &[(f64, f64)], width_m| Corridor { letter, points: points(list), width_m };
    let graph = CorridorGraph {
        corridors: vec![
            corridor('A', &[(12.0, 18.0), (0.0, 18.0), (0.0, 9.0)], 2.4),
            corridor('D', &[(0.0, 9.0), (0.0, 0.0), (12.0, 0.0)], 2.0),
            corridor('E', &[(12.0, 0.0), (12.0, 18.0)], 2.8),
            corridor('B', &[(12.0, 18.0), (39.0, 18.0), (39.0, 9.0)], 2.2),
            corridor('C', &[(39.0, 9.0), (39.0, 0.0), (12.0, 0.0)], 1.8),
        ],
    };
    (graph, (39.0, 18.0))
}

/// Scenario A of chapter 4: four adjacent loops of 44, 58, 64 and 78 m.
pub(super) fn four_loops() -> Result<Scenario> {
    let (graph, size_m) = four_loops_graph();
    let route = "ABCD ABCH GCDA BCHG BADC BABH GCDA BCHE DCGH DABC DEGB FEAB CHGB FHDA BCDE GBFE ABCH GBFH ABCD EGBF \
                 EABC HGBF HDAB CDEG CHGB FEAB CDAF HCGH DEGB ADCB FHDE GCDA BCHG BFED CBAD HEDC GHDA FGBA EHC B \
                 FDCG HDAB CDEG BFEA BCHG BFHD ABCD EGBF EABC HGBF HDAB CDEG BFEA B";
    let world = floor(&graph, size_m)?;
    let runs = drive(&world, &[graph.waypoints(route)?], &pioneer(0), 401)?;
    Ok(Scenario { name: "A", what: "four adjacent loops of 44 to 78 m, one run", runs })
}

/// Scenario B of chapter 4: three nested loops, the largest of 88 m; very symmetric, as the thesis says of its own.
pub(super) fn nested_loops() -> Result<Scenario> {
    let (graph, size_m) = nested_loops_graph();
    let route = "AFGHIJ KLEBCD AFGHIJ KLEBCD AFGHIJ KLEBCD AFGHIJ KLEBCD AFGHIJ KLEBCD AFGHIJ KLEBCD AFGHLK JIEBCD \
                 AFGHLK JIEFGD ABCHEF KLIJGD ABCHEF GDABCH IJKLEF GDABCH LKJIEF GDABCH IJKLEF GDABCH IJKLIJ GDAFGH \
                 EBCDAF KLIJGH EBCDAF GHIJKL EBCDAF GHIJKL EBCDAF GHEFKL IJGDAB CHE";
    let world = floor(&graph, size_m)?;
    let runs = drive(&world, &[graph.waypoints(route)?], &pioneer(0), 402)?;
    Ok(Scenario { name: "B", what: "three nested loops, the largest of 88 m, one run", runs })
}

/// Scenario C of chapter 4: two adjacent loops of 60 and 90 m in four short runs.
pub(super) fn two_loops() -> Result<Scenario> {
    let (graph, size_m) = two_loops_graph();
    let routes = [
        "DEBCEA DEBCEA DEBC",
        "DEBCEA DEBCEA DEBCEA DEBC",
        "DEBCEA DEBCEA DEBCEA DEBCEA D",
        "DEADEB CEBCEA DEADE",
    ];
    let routes = routes.iter().map(|route| graph.waypoints(route)).collect::<Result<Vec<_>>>()?;
    let world = floor(&graph, size_m)?;
    // The real one: a few people walk by.
    Ok(Scenario {
        name: "C",
        what: "two adjacent loops of 60 and 90 m, four runs",
        runs: drive(&world, &routes, &pioneer(1), 403)?,
    })
}

/// Share of the 40 laps under each of the twelve configurations (Figure 5.7).
const CONFIGURATION_SHARES: [f64; 12] =
    [0.214, 0.071, 0.024, 0.012, 0.107, 0.048, 0.096, 0.214, 0.071, 0.024, 0.012, 0.107];
const NUM_LAPS: f64 = 40.0;
const LAP_M: f64 = 120.0;

/// Which doors are open, as (configuration) of the twelve stretches of scenario B (Figure 5.7).
const FEW_DOORS: [usize; 12] = [0, 1, 2, 0, 1, 2, 1, 0, 1, 0, 2, 1];
/// And of scenario C.
const MANY_DOORS: [usize; 12] = [0, 3, 4, 5, 6, 7, 0, 0, 3, 4, 5, 6];

/// Rooms along the corridors: the place of the door, and the direction in which the room lies.
const ROOMS: [((f64, f64), (f64, f64)); 16] = [
    ((6.0, 20.0), (0.0, 1.0)),
    ((13.0, 20.0), (0.0, -1.0)),
    ((27.0, 20.0), (0.0, 1.0)),
    ((34.0, 20.0), (0.0, -1.0)),
    ((40.0, 15.0), (1.0, 0.0)),
    ((40.0, 8.0), (-1.0, 0.0)),
    ((40.0, 3.2), (1.0, 0.0)),
    ((33.0, 0.0), (0.0, -1.0)),
    ((26.0, 0.0), (0.0, 1.0)),
    ((12.0, 0.0), (0.0, -1.0)),
    ((7.0, 0.0), (0.0, 1.0)),
    ((0.0, 5.0), (-1.0, 0.0)),
    ((0.0, 12.0), (1.0, 0.0)),
    ((0.0, 17.0), (-1.0, 0.0)),
    ((3.2, 20.0), (0.0, 1.0)),
    ((36.8, 0.0), (0.0, -1.0)),
];

/// Open rooms of each configuration: none; one a corridor, twice (scenario B); several a corridor or near corners
/// (scenario C).
const OPEN_ROOMS: [&[usize]; 8] = [
    &[],
    &[0, 4, 8, 12],
    &[2, 5, 9, 11],
    &[0, 1, 4, 5, 8, 12],
    &[2, 3, 6, 7, 9, 13],
    &[14, 6, 15, 13],
    &[0, 2, 3, 4, 6, 8, 10, 11],
    &[1, 3, 5, 7, 9, 10, 12, 14],
];

/// Scenarios B and C of chapter 5: forty laps of 120 m while doors open and close twelve times.
pub(super) fn changing_doors(has_many: bool) -> Result<Scenario> {
    let sequence = if has_many { MANY_DOORS } else { FEW_DOORS };
    let mut rng = ChaCha8Rng::seed_from_u64(if has_many { 503 } else { 502 });
    let mut runs = Vec::new();
    for (idx, (share, configuration)) in CONFIGURATION_SHARES.iter().zip(sequence).enumerate() {
        let route = lap_route(share * NUM_LAPS * LAP_M, &mut rng);
        let seed = 500 + idx as u64 + 20 * u64::from(has_many);
        runs.extend(drive(&circuit(OPEN_ROOMS[configuration])?, &[route], &pioneer(0), seed)?);
    }
    let (name, what) = if has_many {
        ("C", "40 laps of 120 m, several doors of a corridor or doors near corners open and close")
    } else {
        ("B", "40 laps of 120 m, single doors open and close")
    };
    Ok(Scenario { name, what, runs })
}

/// Scenario A of chapter 5: eight laps with people about and no door that changes.
pub(super) fn busy_corridors() -> Result<Scenario> {
    let mut rng = ChaCha8Rng::seed_from_u64(501);
    let routes: Vec<Vec<Point2>> = (0..4).map(|_| lap_route(2.0 * LAP_M, &mut rng)).collect();
    let runs = drive(&circuit(OPEN_ROOMS[1])?, &routes, &pioneer(4), 550)?;
    Ok(Scenario { name: "A", what: "8 laps of 120 m in four runs, people walking", runs })
}

/// Where the corridor across the circuit runs, metres from its west end. Not in the middle: a building that looks the
/// same after half a turn could not be told from itself by anybody.
const ACROSS_X_M: f64 = 17.0;

/// A circuit of four corridors of unlike widths with one across.
fn circuit(open_rooms: &[usize]) -> Result<World> {
    let mut plan = FloorPlan::new((40.0, 20.0), 8.0);
    for (ends, width_m) in [
        ([(0.0, 20.0), (40.0, 20.0)], 2.4),
        ([(40.0, 20.0), (40.0, 0.0)], 2.0),
        ([(40.0, 0.0), (0.0, 0.0)], 2.8),
        ([(0.0, 0.0), (0.0, 20.0)], 1.8),
        ([(ACROSS_X_M, 0.0), (ACROSS_X_M, 20.0)], 2.2),
    ] {
        plan.corridor(&points(&ends), width_m);
    }
    for &room in open_rooms {
        let ((x, y), (dx, dy)) = ROOMS[room];
        // At most 1.4 m to the wall, a door of 0.9 m, and a room of 4 × 5 m behind it.
        let along =
            |out_m: f64, side_m: f64| Point2::new(x + out_m * dx + side_m * dy, y + out_m * dy + side_m * dx);
        plan.cut(along(0.8, -0.45), along(1.7, 0.45));
        plan.cut(along(1.65, -2.0), along(6.6, 2.0));
    }
    plan.world()
}

/// Corners and junctions passed in about `length_m`: always on, but into the middle corridor half the times that it
/// is reached, and out of it either way.
fn lap_route(length_m: f64, rng: &mut ChaCha8Rng) -> Vec<Point2> {
    let (north, south) = (Point2::new(ACROSS_X_M, 20.0), Point2::new(ACROSS_X_M, 0.0));
    let mut route = vec![Point2::new(rng.random_range(4.0..14.0), 20.0), north];
    let (mut at_north, mut is_clockwise, mut came_by_middle) = (true, true, false);
    let mut driven_m = 0.0;
    while driven_m < length_m {
        let turns = rng.random_bool(0.5);
        if !came_by_middle && turns {
            came_by_middle = true;
            driven_m += 20.0;
        } else {
            is_clockwise = if came_by_middle { turns } else { is_clockwise };
            came_by_middle = false;
            let x = if at_north == is_clockwise { 40.0 } else { 0.0 };
            let (near_y, far_y) = if at_north { (20.0, 0.0) } else { (0.0, 20.0) };
            route.extend([Point2::new(x, near_y), Point2::new(x, far_y)]);
            driven_m += 20.0 + 2.0 * (x - ACROSS_X_M).abs();
        }
        at_north = !at_north;
        route.push(if at_north { north } else { south });
    }
    route
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laps_run_on_from_junction_to_junction() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let route = lap_route(1000.0, &mut rng);
        for leg in route.windows(2) {
            assert!(leg[0].x == leg[1].x || leg[0].y == leg[1].y, "{leg:?}");
            assert!(leg[0].distance(&leg[1]) <= 40.0 - ACROSS_X_M, "{leg:?}");
        }
        for place in route.windows(3) {
            assert!(place[0] != place[2], "the robot never turns round: {place:?}");
        }
    }
}
