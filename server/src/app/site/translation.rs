//! A run's translator with what it produces: the engine's state machine in the words of this layer.

use locution_engine::config::EngineConfig;
use locution_engine::sampling::KeyframePose;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Quantizer, Word};
use locution_engine::translator::{Translation, Translator};

use crate::app::AppError;
use crate::storage::StorageError;

/// What translating some scans brought.
#[derive(Debug, Default)]
pub struct Translated {
    /// New observations, in order.
    pub observations: Vec<Observation>,
    /// New words; within a level in order.
    pub words: Vec<Word>,
    /// New keyframes, in order.
    pub keyframes: Vec<KeyframePose>,
}

impl Translated {
    fn add(&mut self, translation: Translation) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        self.keyframes.extend(translation.keyframe);
    }
}

/// The translator of one run.
pub struct RunTranslator(Translator);

impl RunTranslator {
    /// The translator of a run that begins; `quantizer` is the site's partition when it has one of its own.
    ///
    /// # Errors
    /// [`AppError::Invalid`] for a laser that cannot be translated.
    pub fn new(
        config: &EngineConfig,
        geometry: &ScanGeometry,
        quantizer: Option<Quantizer>,
    ) -> Result<Self, AppError> {
        let quantizer = quantizer.unwrap_or_else(|| config.translator.quantizer.initial());
        Translator::with_quantizer(&config.translator, geometry.clone(), quantizer)
            .map(Self)
            .map_err(|error| AppError::invalid(error.field, error.problem))
    }

    /// The translator as it was stored.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when the bytes are not a translator.
    pub fn restore(bytes: &[u8]) -> Result<Self, AppError> {
        postcard::from_bytes(bytes)
            .map(Self)
            .map_err(|error| StorageError::Corrupt { what: format!("a stored translator: {error}") }.into())
    }

    /// The state to store.
    ///
    /// # Errors
    /// [`AppError::Internal`] when it cannot be written.
    pub fn store(&self) -> Result<Vec<u8>, AppError> {
        postcard::to_allocvec(&self.0).map_err(AppError::internal)
    }

    /// Feeds scans in order.
    pub fn translate(&mut self, scans: &[Scan]) -> Translated {
        let mut translated = Translated::default();
        for scan in scans {
            translated.add(self.0.push(scan));
        }
        translated
    }

    /// Brings out what was held back: delayed observations and pending words.
    pub fn finish(mut self) -> Translated {
        let mut translated = Translated::default();
        translated.add(self.0.finish());
        translated
    }
}
