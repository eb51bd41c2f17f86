//! Where two drives of the finished map run along each other: the claims that a map makes.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, PI};

use super::indices::BodyIdx;
use super::run::RunRecord;
use crate::geometry::{Pose2, angle_between};
use crate::matching::claimed_between;
use crate::text::{Direction, Interval};

/// Two stretches that lie beside each other in the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    /// The stretch driven first.
    pub earlier: Interval,
    /// The stretch driven later.
    pub later: Interval,
    /// Same or opposite way.
    pub direction: Direction,
}

/// What counts as beside each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StretchSettings {
    /// Largest distance, metres.
    pub distance_m: f64,
    /// Travel that must lie between two places of one run, metres.
    pub min_gap_m: f64,
    /// Longest stretch, observations: short ones are proportional enough.
    pub max_observations: u32,
    /// Passes of each direction with which one visit is matched.
    pub max_passes: usize,
}

/// A pair of observations beside each other.
#[derive(Clone, Copy, Debug)]
struct Link {
    run_idx: u32,
    observation: u32,
    direction: Direction,
    distance_m: f64,
}

/// A stretch that may still grow.
#[derive(Clone, Copy, Debug)]
struct Growing {
    stretch: Stretch,
    last: Link,
}

/// A run and an observation of it.
pub(crate) type Place = (u32, u32);

type Cells = BTreeMap<(u32, i32, i32), Vec<Place>>;

/// All stretches, in order of the later one.
///
/// `poses` holds for each run the poses of its observations, `components` the frame in which they are given, `bodies` the
/// body of the foundation that it is an exemplar of: what two exemplars of one body share was found before. Of many
/// passes beside a visit those come first that were registered with it, then those that lie nearest: a place that was
/// driven a thousand times is worth no more matches than one that was driven twice.
pub(crate) fn find_stretches(
    runs: &[RunRecord<'_>],
    poses: &[Vec<Pose2>],
    (components, bodies): (&[u32], &[Option<BodyIdx>]),
    is_registered: &impl Fn(Place, Place) -> bool,
    settings: &StretchSettings,
) -> Vec<Stretch> {
    let cell_of = |value: f64| (value / settings.distance_m).floor() as i32;
    let mut cells: Cells = BTreeMap::new();
    let mut finished = Vec::new();
    for (run_idx, run_poses) in poses.iter().enumerate() {
        let mut growing: Vec<Growing> = Vec::new();
        // Observations enter the cells once the gap lies behind them, so that whatever is found may be matched.
        let mut num_entered = 0;
        for (index, pose) in run_poses.iter().enumerate() {
            let travel_m = runs[run_idx].observations[index].travel_m;
            while runs[run_idx].observations[num_entered].travel_m + settings.min_gap_m <= travel_m {
                let entering = &run_poses[num_entered];
                let cell = (components[run_idx], cell_of(entering.x), cell_of(entering.y));
                cells.entry(cell).or_default().push((run_idx as u32, num_entered as u32));
                num_entered += 1;
            }
            let mut near = Vec::new();
            for dy in -1..=1 {
                for dx in -1..=1 {
                    let cell = (components[run_idx], cell_of(pose.x) + dx, cell_of(pose.y) + dy);
                    near.extend(cells.get(&cell).into_iter().flatten().copied());
                }
            }
            if bodies[run_idx].is_some() {
                near.retain(|&(other, _)| bodies[other as usize] != bodies[run_idx]);
            }
            near.sort_unstable();
            let mut links = closest_of_each_pass(pose, &near, poses, settings);
            let here = (run_idx as u32, index as u32);
            if links.len() > settings.max_passes {
                let rank =
                    |link: &Link| (!is_registered((link.run_idx, link.observation), here), link.distance_m);
                let mut ranked: Vec<((bool, f64), Link)> =
                    links.iter().map(|link| (rank(link), *link)).collect();
                ranked.sort_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
                links = ranked.into_iter().map(|(_, link)| link).collect();
            }
            growing = grow(growing, &links, here, settings, poses, &mut finished);
        }
        for (index, pose) in run_poses.iter().enumerate().skip(num_entered) {
            let cell = (components[run_idx], cell_of(pose.x), cell_of(pose.y));
            cells.entry(cell).or_default().push((run_idx as u32, index as u32));
        }
        finished.extend(growing.iter().map(|growing| growing.stretch));
    }
    finished.sort_by_key(|stretch| (stretch.later, stretch.earlier, stretch.direction));
    finished
}

/// Of every pass beside a pose the closest observation.
fn closest_of_each_pass(
    pose: &Pose2,
    near: &[(u32, u32)],
    poses: &[Vec<Pose2>],
    settings: &StretchSettings,
) -> Vec<Link> {
    let mut links: Vec<Link> = Vec::new();
    let mut previous: Option<(u32, u32, Direction)> = None;
    for &(run_idx, observation) in near {
        let other = &poses[run_idx as usize][observation as usize];
        let distance_m = pose.distance(other);
        let Some(direction) = direction_beside(pose, other, settings) else { continue };
        let continues = previous
            .is_some_and(|(run, last, way)| run == run_idx && way == direction && observation - last <= 5);
        previous = Some((run_idx, observation, direction));
        let link = Link { run_idx, observation, direction, distance_m };
        match links.last_mut() {
            Some(last) if continues => {
                if distance_m < last.distance_m {
                    *last = link;
                }
            }
            _ => links.push(link),
        }
    }
    links
}

/// The way in which two poses lie beside each other, if they do.
fn direction_beside(pose: &Pose2, other: &Pose2, settings: &StretchSettings) -> Option<Direction> {
    if pose.distance(other) > settings.distance_m {
        return None;
    }
    match angle_between(pose.theta, other.theta) {
        apart_rad if apart_rad <= FRAC_PI_4 => Some(Direction::Same),
        apart_rad if apart_rad >= PI - FRAC_PI_4 => Some(Direction::Opposite),
        _ => None,
    }
}

/// Lengthens what continues, finishes what does not, begins what is new.
///
/// A stretch claims its pairs proportionally. Where a robot turns on the spot or cuts a corner, such a pair may be none
/// although the links at both ends are: there it ends.
fn grow(
    growing: Vec<Growing>,
    links: &[Link],
    (run_idx, index): (u32, u32),
    settings: &StretchSettings,
    poses: &[Vec<Pose2>],
    finished: &mut Vec<Stretch>,
) -> Vec<Growing> {
    let mut is_used = vec![false; links.len()];
    let mut alive: Vec<Growing> = Vec::new();
    for old in growing {
        let next =
            links.iter().enumerate().find(|(link_idx, link)| !is_used[*link_idx] && continues(&old, link));
        let is_short = index - old.stretch.later.first < settings.max_observations;
        let longer = next.filter(|_| is_short).map(|(link_idx, link)| {
            let mut stretch = old.stretch;
            stretch.later.last = index;
            stretch.earlier.first = stretch.earlier.first.min(link.observation);
            stretch.earlier.last = stretch.earlier.last.max(link.observation);
            (link_idx, Growing { stretch, last: *link })
        });
        match longer.filter(|(_, longer)| holds(&longer.stretch, poses, settings)) {
            Some((link_idx, longer)) => {
                is_used[link_idx] = true;
                alive.push(longer);
            }
            None => finished.push(old.stretch),
        }
    }
    for (link, _) in links.iter().zip(&is_used).filter(|(_, used)| !**used) {
        let is_this_way = |growing: &&Growing| growing.stretch.direction == link.direction;
        if alive.iter().filter(is_this_way).count() >= settings.max_passes {
            continue;
        }
        let earlier = Interval { run_idx: link.run_idx, first: link.observation, last: link.observation };
        let later = Interval { run_idx, first: index, last: index };
        let stretch = Stretch { earlier, later, direction: link.direction };
        alive.push(Growing { stretch, last: *link });
    }
    alive
}

fn continues(growing: &Growing, link: &Link) -> bool {
    let last = &growing.last;
    let advance = i64::from(link.observation) - i64::from(last.observation);
    let forward = match link.direction {
        Direction::Same => advance,
        Direction::Opposite => -advance,
    };
    last.run_idx == link.run_idx && last.direction == link.direction && (0..=4).contains(&forward)
}

/// True when everything that a stretch claims lies beside each other and the way it says.
fn holds(stretch: &Stretch, poses: &[Vec<Pose2>], settings: &StretchSettings) -> bool {
    let Stretch { earlier, later, direction } = stretch;
    let (earlier_poses, later_poses) = (&poses[earlier.run_idx as usize], &poses[later.run_idx as usize]);
    claimed_between((earlier.first, earlier.last), (later.first, later.last), *direction).all(|pair| {
        let (a, b) = (&later_poses[pair.later as usize], &earlier_poses[pair.earlier as usize]);
        direction_beside(a, b, settings) == Some(*direction)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::ScanGeometry;
    use crate::text::Observation;

    const SETTINGS: StretchSettings =
        StretchSettings { distance_m: 1.1, min_gap_m: 10.0, max_observations: 25, max_passes: 2 };

    /// A run that stood at these poses, one a tenth of a metre.
    fn observations(poses: &[Pose2]) -> Vec<Observation> {
        let observation = |(index, pose): (usize, &Pose2)| Observation {
            scan_seq: index as u64,
            timestamp_ns: 0,
            travel_m: index as f64 * 0.1,
            odom_from_robot: *pose,
            run_from_robot: *pose,
            densities: vec![0.5],
            is_hard: true,
            num_frontiers: 0,
        };
        poses.iter().enumerate().map(observation).collect()
    }

    fn found(runs: &[Vec<Pose2>]) -> Vec<Stretch> {
        let geometry = ScanGeometry {
            num_ranges: 1,
            angle_min_rad: 0.0,
            angle_increment_rad: 0.1,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        };
        let driven: Vec<Vec<Observation>> = runs.iter().map(|poses| observations(poses)).collect();
        let record = |observations| RunRecord {
            geometry: &geometry,
            observations,
            words: &[],
            keyframes: &[],
            area: None,
        };
        let records: Vec<RunRecord<'_>> = driven.iter().map(|run| record(run)).collect();
        // What the first run and the last saw of each other was registered.
        let is_registered = |earlier: Place, _| earlier.0 == 0;
        find_stretches(
            &records,
            runs,
            (&vec![0; runs.len()], &vec![None; runs.len()]),
            &is_registered,
            &SETTINGS,
        )
    }

    #[test]
    fn a_stretch_ends_where_one_of_its_pairs_would_face_another_way() {
        let ahead = |index: i32| Pose2::new(f64::from(index) * 0.1, 0.0, 0.0);
        let second: Vec<Pose2> = (0..40).map(ahead).collect();
        // The first robot looked aside at one place; the second passed it looking ahead.
        let mut first = second.clone();
        (19..22).for_each(|index| first[index].theta = 0.9);
        let runs = [first, second];
        let stretches = found(&runs);
        assert!(stretches.iter().all(|stretch| holds(stretch, &runs, &SETTINGS)), "{stretches:?}");
        let is_claimed = |observation: u32| {
            stretches.iter().any(|stretch| (stretch.later.first..=stretch.later.last).contains(&observation))
        };
        assert!((0..40).all(is_claimed), "{stretches:?}");
    }

    #[test]
    fn a_place_that_was_passed_often_is_matched_with_few_passes_and_with_those_that_were_registered() {
        let pass = |aside_m: f64| (0..100).map(move |index| Pose2::new(f64::from(index) * 0.1, aside_m, 0.0));
        // The registered pass lies farthest from the last one.
        let runs: Vec<Vec<Pose2>> = (0..9).map(|run| pass(f64::from(run) * 0.1).collect()).collect();
        let stretches = found(&runs);
        let of_last: Vec<&Stretch> = stretches.iter().filter(|stretch| stretch.later.run_idx == 8).collect();
        for observation in 0..100 {
            let holds = |interval: &Interval| (interval.first..=interval.last).contains(&observation);
            let matched: Vec<u32> = (of_last.iter().filter(|stretch| holds(&stretch.later)))
                .map(|stretch| stretch.earlier.run_idx)
                .collect();
            assert!(matched.len() == 2 && matched.contains(&0), "{observation}: {matched:?}");
        }
    }
}
