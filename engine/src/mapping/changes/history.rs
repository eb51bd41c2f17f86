//! Since when something is as it is: what each run by itself saw of a changed area.

use super::{ChangeKind, ChangesConfig, Found, PlacedRun, draw, hit_share, num_scans};
use crate::config_error::ConfigError;
use crate::occupancy::TiledOccupancy;

/// A run must have judged this share of an area's cells to say anything of it.
const SEEN_SHARE_MIN: f64 = 0.5;
/// Where the mean share of scans with a return is larger, a run saw something there, else nothing.
const STANDS_SHARE_MIN: f64 = 0.2;

/// What a run says of an area.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    Standing,
    Gone,
    Unseen,
}

/// Says of every change between which two of the runs, those before first, it happened.
pub(super) fn date(
    found: &mut [Found],
    before: &[PlacedRun<'_>],
    after: &[PlacedRun<'_>],
    config: &ChangesConfig,
) -> Result<(), ConfigError> {
    for (idx, run) in before.iter().chain(after).enumerate() {
        let grid = draw(std::slice::from_ref(run), config)?;
        for Found { change, cells } in found.iter_mut() {
            let is_as_before = match (seen(&grid, cells), change.kind) {
                (Seen::Unseen, _) => continue,
                (Seen::Standing, ChangeKind::Disappeared) | (Seen::Gone, ChangeKind::Appeared) => true,
                (Seen::Standing, ChangeKind::Appeared) | (Seen::Gone, ChangeKind::Disappeared) => false,
            };
            if is_as_before {
                change.last_as_before = Some(idx);
                change.first_as_after = None;
            } else if change.first_as_after.is_none() {
                change.first_as_after = Some(idx);
            }
        }
    }
    Ok(())
}

fn seen(grid: &TiledOccupancy, cells: &[(i32, i32)]) -> Seen {
    let num_seen = cells.iter().filter(|cell| num_scans(grid.counts(**cell)) > 0).count();
    if (num_seen as f64) < SEEN_SHARE_MIN * cells.len() as f64 {
        Seen::Unseen
    } else if hit_share(grid, cells) >= STANDS_SHARE_MIN {
        Seen::Standing
    } else {
        Seen::Gone
    }
}
