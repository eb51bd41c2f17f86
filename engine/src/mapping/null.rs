//! How alike different places of this very building are: what a likeness is measured by.
//!
//! A run on its own has one frame, so two stretches of it that lie far apart are certainly different places. Whatever
//! lays the run over itself there is wrong, however well it fits. How far such ways reach, and how little contradicts
//! them, is what a join between runs must exceed.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::candidates::candidates_within;
use super::component::{Component, Workshop};
use super::config::MappingConfig;
use super::indices::AnchorIdx;
use super::join_evidence::{BESIDE_M, JoinEvidence};
use super::overlap::overlap;
use super::watch::MappingError;
use super::ways::{Groups, Way};
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// Ways of each run that are looked at, those with most fits first.
const NUM_WAYS: usize = 3;

/// The wrong ways to lay the runs of a site over themselves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Null {
    ways: Vec<WrongWay>,
}

/// What a wrong way looks like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct WrongWay {
    /// Anchors that then lie beside others.
    num_beside: usize,
    /// Share of the returns that contradict, in the direction in which it is less.
    one_sided_contradiction: f64,
}

impl Null {
    /// Lays every run over itself in the wrong ways that its candidates propose.
    ///
    /// # Errors
    /// [`MappingError::Stopped`].
    pub fn of(alone: &[Component<'_>], workshop: Workshop<'_>) -> Result<Self, MappingError> {
        let of_run = |(idx, component): (usize, &Component<'_>)| {
            wrong_ways(component, workshop.part(idx, alone.len()))
        };
        let ways = alone.par_iter().enumerate().map(of_run).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { ways: ways.into_iter().flatten().collect() })
    }

    /// The ways of both, without those that others explain whatever they explain: there are few others.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut all = [self.ways.as_slice(), &other.ways].concat();
        all.sort_by(|a, b| {
            let contradicted = a.one_sided_contradiction.total_cmp(&b.one_sided_contradiction);
            contradicted.then(b.num_beside.cmp(&a.num_beside))
        });
        let mut longest = None;
        all.retain(|way| {
            let is_longer = longest.is_none_or(|longest| way.num_beside > longest);
            longest = longest.max(Some(way.num_beside));
            is_longer
        });
        Self { ways: all }
    }

    /// True when a wrong way of this building reaches about as far and is contradicted as little.
    pub fn explains(&self, evidence: &JoinEvidence, config: &MappingConfig) -> bool {
        let reach = config.min_reach_over_null * evidence.num_beside as f64;
        let contradiction = config.null_slack * evidence.one_sided_contradiction;
        self.ways
            .iter()
            .any(|way| way.num_beside as f64 >= reach && way.one_sided_contradiction <= contradiction)
    }
}

fn wrong_ways(component: &Component<'_>, workshop: Workshop<'_>) -> Result<Vec<WrongWay>, MappingError> {
    let (graph, site) = (&component.graph, workshop.site);
    let mut candidates = Vec::new();
    for &run in graph.runs() {
        candidates.extend(candidates_within(site, run));
    }
    let apart_m = site.config.neighbor_distance_m;
    candidates.retain(|found| graph.pose(found.earlier).distance(&graph.pose(found.later)) > apart_m);
    let registered = Groups::new(component, component, &candidates).ways(workshop)?;
    Ok(registered.ways.iter().take(NUM_WAYS).map(|way| wrong_way(component, way, workshop)).collect())
}

/// The component laid over itself, moved as a whole.
fn wrong_way(component: &Component<'_>, way: &Way, workshop: Workshop<'_>) -> WrongWay {
    let hosts = component.graph.placed(component.graph.anchors());
    let moved = |(anchor, pose): &(AnchorIdx, Pose2)| (*anchor, way.host_from_guest.compose(pose));
    let guests: Vec<_> = hosts.iter().map(moved).collect();
    let locals = overlap(workshop, &guests, &hosts);
    let mut opinions = Opinions::default();
    locals.iter().for_each(|local| opinions += local.opinions);
    WrongWay {
        num_beside: locals.iter().filter(|local| local.nearest_m < BESIDE_M).count(),
        one_sided_contradiction: opinions.one_sided_contradiction(),
    }
}
