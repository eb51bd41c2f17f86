//! Places that a person labelled: polygons in the frame of a recording's truth.

use serde::{Deserialize, Serialize};

use crate::geometry::Point2;

/// All labelled regions of one recording.
///
/// Regions may overlap: the first of the list that holds a position gives its label, so special places stand before
/// the corridors that run through under them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabeledPlaces {
    /// Name of the frame of the coordinates.
    #[serde(default)]
    pub frame: String,
    /// What the annotator wants to be known.
    #[serde(default)]
    pub notes: String,
    /// Regions in order of precedence.
    pub regions: Vec<LabeledRegion>,
}

/// One region of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabeledRegion {
    /// `corridor`, `corner`, `bifurcation`, `dead-end` or `hall`.
    pub label: String,
    /// Corners in metres, `[x, y]`, closed implicitly.
    pub polygon: Vec<[f64; 2]>,
}

impl LabeledRegion {
    /// Whether the polygon holds the point, by the even-odd rule.
    pub fn contains(&self, point: &Point2) -> bool {
        let mut is_inside = false;
        let mut previous = self.polygon.last().copied().unwrap_or_default();
        for &corner in &self.polygon {
            let ([x1, y1], [x2, y2]) = (previous, corner);
            if (y1 > point.y) != (y2 > point.y) && point.x < (x2 - x1) * (point.y - y1) / (y2 - y1) + x1 {
                is_inside = !is_inside;
            }
            previous = corner;
        }
        is_inside
    }
}

impl LabeledPlaces {
    /// The label of a position: that of the first region that holds it.
    pub fn label_at(&self, point: &Point2) -> Option<&str> {
        self.regions.iter().find(|region| region.contains(point)).map(|region| region.label.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_region_wins() {
        let text = r#"{"frame":"laser/NAME.truth","notes":"","regions":[
            {"label":"corner","polygon":[[0,0],[2,0],[2,2],[0,2]]},
            {"label":"corridor","polygon":[[-10,0],[10,0],[10,2],[-10,2]]}]}"#;
        let places: LabeledPlaces = serde_json::from_str(text).unwrap();
        assert_eq!(places.label_at(&Point2::new(1.0, 1.0)), Some("corner"));
        assert_eq!(places.label_at(&Point2::new(5.0, 1.0)), Some("corridor"));
        assert_eq!(places.label_at(&Point2::new(5.0, 3.0)), None);
    }

    #[test]
    fn a_dent_is_outside() {
        let polygon = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let region = LabeledRegion { label: "hall".into(), polygon };
        assert!(region.contains(&Point2::new(2.0, 0.5)));
        assert!(!region.contains(&Point2::new(2.0, 2.0)));
        assert!(!LabeledRegion { label: String::new(), polygon: vec![] }.contains(&Point2::default()));
    }
}
