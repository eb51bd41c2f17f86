//! From the surroundings of a place to its label: five rules, the first that holds decides.

use super::config::SemanticsConfig;
use super::label::PlaceLabel;
use super::signature::PlaceSignature;

/// The label of a place by its surroundings.
///
/// 1. Only one driven way leaves the place, and no passage runs straight through it: a dead end.
/// 2. An open disc as large as a hall holds it: a hall.
/// 3. Three or more passages leave it and go on: a bifurcation.
/// 4. The two most opposite passages are not opposite, the driven way turns, and nothing opens beside them, as it does
///    where rooms are entered, or they bend sharply: a corner.
/// 5. Otherwise it is a corridor.
pub fn label_of(config: &SemanticsConfig, place: &PlaceSignature) -> PlaceLabel {
    let is_straighter = |limit: f64| place.straightness.is_some_and(|straightness| straightness >= limit);
    let is_bent = place.straightness.is_some() && !is_straighter(config.corner_straightness);
    let is_alone = place.num_openings <= 2 || !is_straighter(config.sharp_straightness);
    if place.num_driven <= 1 && !is_straighter(config.dead_end_straightness) {
        PlaceLabel::DeadEnd
    } else if place.hall_radius_m > 0.0 {
        PlaceLabel::Hall
    } else if place.num_passages >= 3 {
        PlaceLabel::Bifurcation
    } else if is_bent && is_alone && place.turn_rad >= config.corner_turn_rad {
        PlaceLabel::Corner
    } else {
        PlaceLabel::Corridor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mild_bend_is_a_corner_where_nothing_opens_beside_it() {
        let config = SemanticsConfig::default();
        let label = |straightness: f64, num_openings: u32, turn_deg: f64| {
            label_of(
                &config,
                &PlaceSignature {
                    num_passages: 2,
                    num_openings,
                    num_driven: 2,
                    straightness: Some(straightness),
                    turn_rad: turn_deg.to_radians(),
                    ..PlaceSignature::default()
                },
            )
        };
        assert_eq!(label(0.85, 2, 45.0), PlaceLabel::Corner);
        assert_eq!(label(0.85, 3, 45.0), PlaceLabel::Corridor, "a turn into a room");
        assert_eq!(label(0.71, 3, 90.0), PlaceLabel::Corner, "a right angle beside a door");
        assert_eq!(label(0.71, 2, 10.0), PlaceLabel::Corridor, "nobody turns there");
        assert_eq!(label(0.95, 2, 45.0), PlaceLabel::Corridor, "a robot that weaves");
    }
}
