//! What two maps laid over each other say of each other, wherever they overlap.
//!
//! A registration looks at one place. Two corridors of equal width fit each other there, and some metres on again; but
//! the rooms beside them do not: returns of one map lie where the other saw free space. So everything that both maps
//! saw is compared as it lies, nothing is moved. How much contradiction a true overlap brings depends on the place:
//! people, doors and glass make a run contradict itself, and that is what a join is measured by.

use super::coarse_graph::CoarseGraph;
use super::indices::AnchorIdx;
use crate::registration::Opinions;

/// Submaps whose anchors are farther apart have little in common, metres.
const REACH_M: f64 = 6.0;
/// Submaps of the host compared with one of the guest.
const MAX_HOSTS: usize = 4;

/// What one anchor of the guest and the host around it say of each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalOpinions {
    pub guest: AnchorIdx,
    pub opinions: Opinions,
}

/// Compares every guest anchor that lies on the host with the host anchors nearest to it, at the graph's poses.
pub(crate) fn overlap(
    graph: &CoarseGraph<'_>,
    guests: &[AnchorIdx],
    hosts: &[AnchorIdx],
) -> Vec<LocalOpinions> {
    let mut found = Vec::new();
    for &guest in guests {
        let mut near: Vec<(f64, AnchorIdx)> = hosts
            .iter()
            .map(|&host| (graph.pose(host).distance(&graph.pose(guest)), host))
            .filter(|(distance_m, _)| *distance_m < REACH_M)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut opinions = Opinions::default();
        for &(_, host) in near.iter().take(MAX_HOSTS) {
            let host_from_guest = graph.pose(host).between(&graph.pose(guest));
            opinions += Opinions::of(graph.site.submap(host), graph.site.submap(guest), &host_from_guest);
        }
        if !near.is_empty() {
            found.push(LocalOpinions { guest, opinions });
        }
    }
    found
}
