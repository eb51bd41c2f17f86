//! Rooms and doors found in a map, against those that a person drew.

use std::collections::BTreeMap;

use locution_engine::geometry::Point2;
use serde::{Deserialize, Serialize};

use super::summary::share;

/// A door is found when one is said to be this near, metres.
const DOOR_TOLERANCE_M: f64 = 1.0;

/// How well the rooms of a map are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RoomScore {
    /// Matthews correlation over all pairs of cells: of one room or not.
    pub matthews: f64,
    /// Mean over the true rooms of the best intersection over union with a found one.
    pub mean_iou: f64,
    /// Rooms that are.
    pub rooms: usize,
    /// Rooms that were found.
    pub rooms_found: usize,
}

/// How well doors were found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DoorScore {
    /// Found doors that are.
    pub precision: f64,
    /// Doors that were found.
    pub recall: f64,
    /// Doors that are.
    pub doors: usize,
    /// Doors that were found, right or wrong.
    pub doors_found: usize,
}

/// Judges cells, each with the number of its true room and that of the room it was found in. A cell in no found room is in
/// one room with no other.
pub fn judge_rooms(cells: &[(u32, Option<u32>)]) -> RoomScore {
    let (mut both, mut actual, mut found) =
        (BTreeMap::<(u32, u32), f64>::new(), BTreeMap::<u32, f64>::new(), BTreeMap::<u32, f64>::new());
    for &(room, predicted) in cells {
        *actual.entry(room).or_default() += 1.0;
        if let Some(predicted) = predicted {
            *found.entry(predicted).or_default() += 1.0;
            *both.entry((room, predicted)).or_default() += 1.0;
        }
    }
    let pairs = |num: f64| num * (num - 1.0) / 2.0;
    let together: f64 = both.values().copied().map(pairs).sum();
    let wrongly_together = found.values().copied().map(pairs).sum::<f64>() - together;
    let wrongly_apart = actual.values().copied().map(pairs).sum::<f64>() - together;
    let apart = pairs(cells.len() as f64) - together - wrongly_together - wrongly_apart;
    // Roots are taken first: the product of four numbers of pairs is too large to be exact.
    let spread = [
        together + wrongly_together,
        together + wrongly_apart,
        apart + wrongly_together,
        apart + wrongly_apart,
    ]
    .map(f64::sqrt)
    .into_iter()
    .product::<f64>();
    let agreement = together * apart - wrongly_together * wrongly_apart;
    let best_iou = |room: u32, size: f64| {
        let ious = both.range((room, 0)..=(room, u32::MAX));
        ious.map(|(&(_, other), &common)| common / (size + found[&other] - common)).fold(0.0, f64::max)
    };
    let sum_iou: f64 = actual.iter().map(|(&room, &size)| best_iou(room, size)).sum();
    RoomScore {
        matthews: if spread > 0.0 { agreement / spread } else { 0.0 },
        mean_iou: sum_iou / actual.len().max(1) as f64,
        rooms: actual.len(),
        rooms_found: found.len(),
    }
}

/// Judges positions of doors. Each counts once; the nearest pairs are matched first.
pub fn judge_doors(actual: &[Point2], found: &[Point2]) -> DoorScore {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (idx, door) in actual.iter().enumerate() {
        for (found_idx, other) in found.iter().enumerate() {
            let distance_m = door.distance(other);
            if distance_m <= DOOR_TOLERANCE_M {
                pairs.push((distance_m, idx, found_idx));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut is_matched, mut is_right) = (vec![false; actual.len()], vec![false; found.len()]);
    let mut num_right = 0;
    for (_, idx, found_idx) in pairs {
        if !is_matched[idx] && !is_right[found_idx] {
            (is_matched[idx], is_right[found_idx]) = (true, true);
            num_right += 1;
        }
    }
    DoorScore {
        precision: share(num_right, found.len()),
        recall: share(num_right, actual.len()),
        doors: actual.len(),
        doors_found: found.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_as_drawn_are_perfect_whatever_their_numbers() {
        let cells: Vec<(u32, Option<u32>)> = (0..100).map(|cell| (cell / 25, Some(9 - cell / 25))).collect();
        let score = judge_rooms(&cells);
        assert_eq!((score.rooms, score.rooms_found), (4, 4));
        assert!((score.matthews - 1.0).abs() < 1e-12 && (score.mean_iou - 1.0).abs() < 1e-12);
    }

    #[test]
    fn pairs_are_counted_as_by_hand() {
        // Rooms {a, b}, {c, d}; found {a, b, c}, d in none. Of six pairs one is rightly together, two wrongly, one wrongly
        // apart, two rightly apart.
        let score = judge_rooms(&[(1, Some(7)), (1, Some(7)), (2, Some(7)), (2, None)]);
        assert!((score.matthews - (2.0 - 2.0) / (3.0f64 * 2.0 * 4.0 * 3.0).sqrt()).abs() < 1e-12);
        assert!((score.mean_iou - (2.0 / 3.0 + 1.0 / 4.0) / 2.0).abs() < 1e-12);
        assert_eq!(judge_rooms(&[]), RoomScore::default());
    }

    #[test]
    fn a_door_counts_once() {
        let at = |x: f64| Point2::new(x, 0.0);
        let score = judge_doors(&[at(0.0), at(10.0)], &[at(0.4), at(0.2), at(20.0)]);
        assert_eq!(score, DoorScore { precision: 1.0 / 3.0, recall: 0.5, doors: 2, doors_found: 3 });
    }
}
