//! A run's translator with what it has produced: the engine's state machine behind the words of this layer.

use std::sync::Arc;

use locution_engine::config::EngineConfig;
use locution_engine::mapping::Keyframe;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Word};

use super::AppError;

/// What translating some scans brought.
#[derive(Debug, Default)]
pub struct Translated {
    /// New observations, in order.
    pub observations: Vec<Observation>,
    /// New words; within a level in order.
    pub words: Vec<Word>,
    /// New keyframes, in order.
    pub keyframes: Vec<Keyframe>,
}

/// The translator of one run.
pub struct RunTranslator {}

impl RunTranslator {
    /// The translator of a run that begins.
    pub fn new(_config: &Arc<EngineConfig>, _geometry: &ScanGeometry) -> Result<Self, AppError> {
        Ok(Self {})
    }

    /// The translator as it was stored.
    pub fn restore(
        _config: &Arc<EngineConfig>,
        _geometry: &ScanGeometry,
        _bytes: &[u8],
    ) -> Result<Self, AppError> {
        Ok(Self {})
    }

    /// The state to store.
    pub fn store(&self) -> Result<Vec<u8>, AppError> {
        Ok(Vec::new())
    }

    /// Feeds scans in order.
    pub fn translate(&mut self, _scans: &[Scan], _out: &mut Translated) -> Result<(), AppError> {
        Ok(())
    }

    /// Brings out what was held back: delayed observations and pending words.
    pub fn finish(&mut self, _out: &mut Translated) -> Result<(), AppError> {
        Ok(())
    }
}
