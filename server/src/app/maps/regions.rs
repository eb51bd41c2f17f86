//! The topological view of a map: regions of equal density along the runs, and what is beside what.
//!
//! A region is a word of level 0 placed in the map. Regions that follow one another in a run are connected; so are two
//! regions that a verified match says are the same place.

use locution_engine::geometry::Pose2;
use locution_engine::mapping::Interval;

use super::matches::{MatchFilter, MatchOrder, matches};
use crate::app::AppError;
use crate::records::{Map, PlacedRun};

/// A word placed in the map.
#[derive(Clone, Debug)]
pub struct Region {
    /// Number of the run in the site.
    pub run: u32,
    /// Component of the run.
    pub component: u32,
    /// Number of the word of level 0.
    pub word: u32,
    pub class: u8,
    /// First and last observation.
    pub observations: (u32, u32),
    /// Metres along it.
    pub length_m: f64,
    /// Radians turned in it.
    pub turn_rad: f64,
    pub map_from_middle: Pose2,
}

/// Regions and their connections, by position.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// In the order of runs and travel.
    pub regions: Vec<Region>,
    /// Regions that follow one another.
    pub driven: Vec<(usize, usize)>,
    /// Regions that are the same place.
    pub same_place: Vec<(usize, usize)>,
}

/// The topological view of a version, as far as some of its runs make it.
pub async fn topology(map: &Map, runs: &[PlacedRun]) -> Result<Topology, AppError> {
    let mut topology = Topology::default();
    for placed in runs {
        let first = topology.regions.len();
        topology.regions.extend(regions_of(placed).await?);
        topology.driven.extend((first + 1..topology.regions.len()).map(|idx| (idx - 1, idx)));
    }
    for numbered in matches(map, &MatchFilter::verified(), MatchOrder::Number, 0, usize::MAX).await?.0 {
        let sides =
            [&numbered.found.earlier, &numbered.found.later].map(|side| region_at(&topology.regions, side));
        if let [Some(earlier), Some(later)] = sides
            && earlier != later
        {
            topology.same_place.push((earlier, later));
        }
    }
    topology.same_place.sort_unstable();
    topology.same_place.dedup();
    Ok(topology)
}

async fn regions_of(placed: &PlacedRun) -> Result<Vec<Region>, AppError> {
    let words = placed.run.words(0, 0, usize::MAX).await?;
    let observations = placed.run.all_observations().await?;
    let trajectory = placed.trajectory().await?;
    let mut regions = Vec::new();
    for word in words {
        let (first, last) = (word.observations.0 as usize, word.observations.1 as usize);
        let Some(stretch) = observations.get(first..=last).filter(|stretch| !stretch.is_empty()) else {
            continue;
        };
        let middle = &stretch[stretch.len() / 2];
        // The run may have gone on since the map was built, and other pieces of it lie elsewhere.
        if !placed.map_run.scans().contains(&middle.scan_seq) {
            continue;
        }
        let Some(map_from_middle) = trajectory.at(middle.scan_seq, &middle.run_from_robot) else { break };
        regions.push(Region {
            run: placed.map_run.run,
            component: placed.map_run.component,
            word: word.id.index,
            class: word.class,
            observations: word.observations,
            length_m: stretch[stretch.len() - 1].travel_m - stretch[0].travel_m,
            turn_rad: f64::from(word.turn_rad),
            map_from_middle,
        });
    }
    Ok(regions)
}

/// The region that holds the middle of a stretch.
fn region_at(regions: &[Region], stretch: &Interval) -> Option<usize> {
    let middle = stretch.first + (stretch.last - stretch.first) / 2;
    let before =
        regions.partition_point(|region| (region.run, region.observations.1) < (stretch.run_idx, middle));
    let region = regions.get(before)?;
    (region.run == stretch.run_idx && region.observations.0 <= middle).then_some(before)
}
