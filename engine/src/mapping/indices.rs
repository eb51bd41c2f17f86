//! Names of things by their place in a list: an anchor cannot be taken for a run.

/// A run, by its place in the site's own order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct RunIdx(u32);

/// A part of the foundation that moves as a whole, by its place among those of the foundation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct BodyIdx(u32);

/// A keyframe of a run, by its place along the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct KeyframeIdx(u32);

/// An anchor, by its place among those of all runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct AnchorIdx(u32);

impl RunIdx {
    /// The run at this place.
    pub const fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in a list of all runs.
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}

impl BodyIdx {
    /// The body at this place.
    pub const fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in a list of all bodies.
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}

impl KeyframeIdx {
    /// The keyframe at this place.
    pub const fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in the run's list.
    pub const fn at(self) -> usize {
        self.0 as usize
    }

    /// As it is served.
    pub const fn number(self) -> u32 {
        self.0
    }
}

impl AnchorIdx {
    /// The anchor at this place.
    pub const fn new(place: usize) -> Self {
        Self(place as u32)
    }

    /// Its place in a list of all anchors.
    pub const fn at(self) -> usize {
        self.0 as usize
    }
}
