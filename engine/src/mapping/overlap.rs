//! What two maps laid over each other say of each other, wherever they overlap.
//!
//! A registration looks at one place. Two corridors of equal width fit each other there, and some metres on again; but
//! the rooms beside them do not: returns of one map lie where the other saw free space. So everything that both maps
//! saw is compared as it lies, nothing is moved. How much contradiction a true overlap brings depends on the place:
//! people, doors and glass make a run contradict itself, and that is what a join is measured by.

use super::component::Workshop;
use super::indices::AnchorIdx;
use crate::geometry::Pose2;
use crate::registration::Opinions;

/// Submaps whose anchors are farther apart have little in common, metres.
const REACH_M: f64 = 6.0;
/// Submaps of the host compared with one of the guest.
const MAX_HOSTS: usize = 4;

/// What one anchor of the guest and the host around it say of each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalOpinions {
    /// Distance to the nearest anchor of the host, metres.
    pub nearest_m: f64,
    pub opinions: Opinions,
}

/// Compares every guest anchor that lies on the host with the host anchors nearest to it, each where it is said to be.
pub(crate) fn overlap(
    workshop: Workshop<'_>,
    guests: &[(AnchorIdx, Pose2)],
    hosts: &[(AnchorIdx, Pose2)],
) -> Vec<LocalOpinions> {
    let mut found = Vec::new();
    for (guest, guest_pose) in guests {
        let mut near: Vec<(f64, AnchorIdx, &Pose2)> = hosts
            .iter()
            .map(|(host, pose)| (pose.distance(guest_pose), *host, pose))
            .filter(|(distance_m, ..)| *distance_m < REACH_M)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut opinions = Opinions::default();
        for (_, host, host_pose) in near.iter().take(MAX_HOSTS) {
            let host_from_guest = host_pose.between(guest_pose);
            opinions += workshop.memo.opinions(workshop.site, (*host, *guest), &host_from_guest);
        }
        if let Some((nearest_m, ..)) = near.first() {
            found.push(LocalOpinions { nearest_m: *nearest_m, opinions });
        }
    }
    found
}
