//! When and where: which part of what was driven a list is about.

use locution_engine::geometry::Point2;

/// An upright rectangle, borders included; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub low: Point2,
    pub high: Point2,
}

/// A time and an area; what is not said is not asked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    pub area: Option<Area>,
}

impl Window {
    /// Whether it asks for anything at all.
    pub fn is_everything(&self) -> bool {
        *self == Self::default()
    }

    /// Whether something of a stretch of time, both ends included, lies in it.
    pub fn holds_time(&self, (first_ns, last_ns): (i64, i64)) -> bool {
        self.from_ns.is_none_or(|from_ns| last_ns >= from_ns)
            && self.to_ns.is_none_or(|to_ns| first_ns < to_ns)
    }

    /// Whether a position lies in it.
    pub fn holds_place(&self, at: &Point2) -> bool {
        self.area.is_none_or(|Area { low, high }| {
            (low.x..=high.x).contains(&at.x) && (low.y..=high.y).contains(&at.y)
        })
    }

    /// Whether a moment at a position lies in it.
    pub fn holds(&self, timestamp_ns: i64, at: &Point2) -> bool {
        self.holds_time((timestamp_ns, timestamp_ns)) && self.holds_place(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_holds_what_begins_before_its_end_and_lies_in_its_area() {
        let area = Area { low: Point2::new(0.0, 0.0), high: Point2::new(2.0, 1.0) };
        let window = Window { from_ns: Some(10), to_ns: Some(20), area: Some(area) };
        for (stretch, is_held) in [((0, 9), false), ((0, 10), true), ((19, 30), true), ((20, 30), false)] {
            assert_eq!(window.holds_time(stretch), is_held, "{stretch:?}");
        }
        assert!(window.holds(10, &Point2::new(2.0, 0.0)));
        assert!(!window.holds(10, &Point2::new(2.1, 0.0)) && !window.holds(9, &Point2::new(1.0, 0.5)));
        assert!(Window::default().holds(i64::MIN, &Point2::new(1e9, 0.0)));
    }
}
