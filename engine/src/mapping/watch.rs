//! How the making of a map is followed and ended from outside: a function that is told how far it has come and answers
//! whether to go on. The engine has no clock; whoever calls it may have one.

use std::ops::ControlFlow;

use thiserror::Error;

use crate::pose_graph::PoseGraphError;

/// Why there is no map.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MappingError {
    /// The pose graph cannot be solved.
    #[error(transparent)]
    Graph(#[from] PoseGraphError),
    /// Whoever watched it ended it.
    #[error("the making of the map was ended")]
    Stopped,
}

/// What is being done for a map, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MapStage {
    /// Runs are settled on their own: places that they pass again are found.
    Settling,
    /// Runs are laid over each other.
    Joining,
}

impl MapStage {
    /// All of them, in their order.
    pub const ALL: [Self; 2] = [Self::Settling, Self::Joining];
}

/// How far the making of a map has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapStep {
    /// What is being done.
    pub stage: MapStage,
    /// Share of the stage that is done, from 0 to 1. It may jump ahead, since a stage ends when nothing new is found.
    pub share: f64,
}

/// Who watches: told of every step, from any thread. Once it answers `Break` it has to do so ever after.
#[derive(Clone, Copy)]
pub struct Watch<'a>(&'a (dyn Fn(MapStep) -> ControlFlow<()> + Sync));

impl<'a> Watch<'a> {
    /// A function that watches.
    pub const fn new(told: &'a (dyn Fn(MapStep) -> ControlFlow<()> + Sync)) -> Self {
        Self(told)
    }

    /// Nobody watches.
    pub const fn nobody() -> Self {
        Self(&|_| ControlFlow::Continue(()))
    }

    /// A stage that begins.
    pub(crate) const fn stage(self, stage: MapStage) -> Span<'a> {
        Span { watch: self, stage, from: 0.0, to: 1.0 }
    }
}

/// A part of a stage.
#[derive(Clone, Copy)]
pub(crate) struct Span<'a> {
    watch: Watch<'a>,
    stage: MapStage,
    from: f64,
    to: f64,
}

impl Span<'_> {
    /// One of equal parts.
    pub fn part(self, idx: usize, num_parts: usize) -> Self {
        let at = |idx: usize| self.from + (self.to - self.from) * idx as f64 / num_parts.max(1) as f64;
        Self { from: at(idx), to: at(idx + 1), ..self }
    }

    /// Tells how much of the part is done.
    ///
    /// # Errors
    /// [`MappingError::Stopped`].
    pub fn done(self, num_done: usize, num: usize) -> Result<(), MappingError> {
        let share = self.part(num_done.min(num), num).from;
        match (self.watch.0)(MapStep { stage: self.stage, share }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(MappingError::Stopped),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn parts_of_parts_are_told_as_shares_of_the_stage() {
        let shares = Mutex::new(Vec::new());
        let told = |step: MapStep| {
            shares.lock().unwrap().push(step.share);
            ControlFlow::Continue(())
        };
        let stage = Watch::new(&told).stage(MapStage::Joining);
        stage.done(0, 4).unwrap();
        stage.part(1, 2).done(1, 2).unwrap();
        stage.part(1, 2).part(1, 2).done(9, 2).unwrap();
        assert_eq!(*shares.lock().unwrap(), [0.0, 0.75, 1.0]);
        let stopping = |_| ControlFlow::Break(());
        assert_eq!(Watch::new(&stopping).stage(MapStage::Settling).done(0, 1), Err(MappingError::Stopped));
    }
}
