//! What two maps laid over each other say of each other, wherever they overlap.
//!
//! A registration looks at one place. Two corridors of equal width fit each other there, and some metres on again; but
//! the rooms beside them do not: returns of one map lie where the other saw free space. So everything that both maps
//! saw is compared as it lies, nothing is moved. How much contradiction a true overlap brings depends on the place:
//! people, doors and glass make a run contradict itself, and that is what a join is measured by.

use super::anchors::AnchorSet;
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// Submaps whose anchors are farther apart have little in common, metres.
const REACH_M: f64 = 6.0;
/// Submaps of the host compared with one of the guest.
const MAX_HOSTS: usize = 4;

/// Compares every guest anchor with the host anchors nearest to it, at these poses.
pub(crate) fn overlap(set: &AnchorSet, poses: &[Pose2], guests: &[usize], hosts: &[usize]) -> Opinions {
    let mut all = Opinions::default();
    for &guest in guests {
        let mut near: Vec<(f64, usize)> = hosts
            .iter()
            .map(|&host| (poses[host].distance(&poses[guest]), host))
            .filter(|(distance_m, _)| *distance_m < REACH_M)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(_, host) in near.iter().take(MAX_HOSTS) {
            let host_from_guest = poses[host].between(&poses[guest]);
            all += Opinions::of(&set.submaps[host], &set.submaps[guest], &host_from_guest);
        }
    }
    all
}

/// What the places of a run say of those a little later, which were seen by other scans.
pub(crate) fn own_opinions(set: &AnchorSet, run_idx: usize, submap_half_length_m: f64) -> Opinions {
    let range = set.of_run(run_idx);
    let mut all = Opinions::default();
    for from in range.clone() {
        let here = &set.anchors[from];
        let apart_m = here.travel_m + 2.0 * submap_half_length_m;
        let to = range.start + set.anchors[range.clone()].partition_point(|anchor| anchor.travel_m < apart_m);
        let Some(there) = set.anchors[..range.end].get(to) else { break };
        let relative = here.run_from_anchor.between(&there.run_from_anchor);
        all += Opinions::of(&set.submaps[from], &set.submaps[to], &relative);
    }
    all
}
