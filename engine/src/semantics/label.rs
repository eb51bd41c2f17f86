//! The five kinds of places (thesis section 6.2.1).

use std::fmt;

use serde::{Deserialize, Serialize};

/// What kind of place a position is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlaceLabel {
    /// Three or more passages meet.
    Bifurcation,
    /// The passage turns and nothing else goes on.
    Corner,
    /// A passage between two parallel walls; doors and alcoves beside it do not matter.
    Corridor,
    /// A room or a blind end: one way in.
    DeadEnd,
    /// A large open room.
    Hall,
}

impl PlaceLabel {
    /// All labels, in the order of the thesis' tables.
    pub const ALL: [PlaceLabel; 5] =
        [Self::Bifurcation, Self::Corner, Self::Corridor, Self::DeadEnd, Self::Hall];

    /// Its name in files and answers.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bifurcation => "bifurcation",
            Self::Corner => "corner",
            Self::Corridor => "corridor",
            Self::DeadEnd => "dead-end",
            Self::Hall => "hall",
        }
    }

    /// The label of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|label| label.name() == name)
    }

    /// Position in [`PlaceLabel::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for PlaceLabel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_wire() {
        for (index, label) in PlaceLabel::ALL.into_iter().enumerate() {
            assert_eq!(label.index(), index);
            assert_eq!(PlaceLabel::from_name(label.name()), Some(label));
            assert_eq!(serde_json::to_string(&label).unwrap(), format!("\"{label}\""));
        }
        assert_eq!(PlaceLabel::from_name("room"), None);
    }
}
