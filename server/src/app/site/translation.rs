//! A run's translator with what it produces: the engine's state machine in the words of this layer.

use locution_engine::config::EngineConfig;
use locution_engine::sampling::KeyframePose;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::text::{Observation, Quantizer, Word};
use locution_engine::translator::{Cut, Translation, Translator};

use crate::app::AppError;
use crate::storage::StorageError;

/// First byte of a stored translator. Before there was one the first byte said how odometry is treated, 0 or 1.
const TRANSLATOR_LAYOUT: u8 = 3;

/// What translating some scans brought.
#[derive(Debug, Default)]
pub struct Translated {
    /// New observations, in order.
    pub observations: Vec<Observation>,
    /// New words; within a level in order.
    pub words: Vec<Word>,
    /// New keyframes, in order.
    pub keyframes: Vec<KeyframePose>,
    /// Where the run falls in two, in order.
    pub cuts: Vec<Cut>,
}

impl Translated {
    fn add(&mut self, translation: Translation) {
        self.observations.extend(translation.observations);
        self.words.extend(translation.words);
        self.keyframes.extend(translation.keyframe);
        self.cuts.extend(translation.cut);
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

    /// The translator as it was stored; none when an earlier version of the server stored it, whose text this one
    /// would not go on with as it was begun.
    ///
    /// # Errors
    /// [`StorageError::Corrupt`] when the bytes are not a translator.
    pub fn restore(bytes: &[u8]) -> Result<Option<Self>, AppError> {
        let corrupt =
            |problem: String| StorageError::Corrupt { what: format!("a stored translator: {problem}") };
        let (&layout, bytes) = bytes.split_first().ok_or_else(|| corrupt("it is empty".into()))?;
        if layout < TRANSLATOR_LAYOUT {
            return Ok(None);
        }
        if layout > TRANSLATOR_LAYOUT {
            return Err(corrupt(format!("layout {layout} is of a later version of the server")).into());
        }
        let translator = postcard::from_bytes(bytes).map_err(|error| corrupt(error.to_string()))?;
        Ok(Some(Self(translator)))
    }

    /// The state to store.
    ///
    /// # Errors
    /// [`AppError::Internal`] when it cannot be written.
    pub fn store(&self) -> Result<Vec<u8>, AppError> {
        postcard::to_extend(&self.0, vec![TRANSLATOR_LAYOUT]).map_err(AppError::internal)
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

#[cfg(test)]
mod tests {
    use locution_engine::geometry::Pose2;

    use super::*;

    #[test]
    fn a_translator_of_an_earlier_version_is_told_from_a_damaged_one() {
        let geometry = ScanGeometry {
            num_ranges: 3,
            angle_min_rad: -1.0,
            angle_increment_rad: 1.0,
            range_max_m: 10.0,
            robot_from_laser: Pose2::identity(),
        };
        let translator = RunTranslator::new(&EngineConfig::default(), &geometry, None).unwrap();
        let stored = translator.store().unwrap();
        assert!(RunTranslator::restore(&stored).unwrap().is_some());
        assert!(RunTranslator::restore(&stored[1..]).unwrap().is_none());
        assert!(RunTranslator::restore(&stored[..stored.len() / 2]).is_err());
        assert!(RunTranslator::restore(&[]).is_err());
    }
}
