//! What speaks for and against every place that a session judged, as JSON lines: the data that weights are fitted to.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use locution_engine::locate::{
    LocalizationState, NUM_CHAIN_FEATURES, SessionConfig, SiteSession, chain_features,
};
use locution_engine::recall::{Example, NUM_FEATURES, PlaceIndex, worst_sd_m};
use locution_engine::scan::{Scan, ScanGeometry};
use serde::Serialize;

use super::prepared::Whereabouts;

/// Writes lines, or nothing.
pub struct FeatureLog {
    file: Option<BufWriter<File>>,
    map: String,
    robots: String,
    /// Number of the robot in its pair.
    pub trial: usize,
}

#[derive(Serialize)]
struct Line<'a> {
    map: &'a str,
    robots: &'a str,
    trial: usize,
    travel_m: f64,
    state: LocalizationState,
    /// Where nobody can say whether the robot is on the map.
    is_unclear: bool,
    is_on_map: bool,
    places: Vec<PlaceLine>,
}

#[derive(Serialize)]
struct PlaceLine {
    is_right: bool,
    probability: f64,
    features: [f64; NUM_CHAIN_FEATURES],
    /// Of each piece what map and piece contradict of each other, coverage, and opinions, newest first.
    pieces: Vec<(f64, f64, f64, u32)>,
    sd_m: f64,
    /// Agreement and coverage of what was seen last.
    recent: Option<(f64, f64)>,
}

#[derive(Serialize)]
struct ExampleLine<'a> {
    map: &'a str,
    robots: &'a str,
    trial: usize,
    /// Metres that were asked about.
    example_m: f64,
    is_unclear: bool,
    is_on_map: bool,
    places: Vec<ExamplePlaceLine>,
}

#[derive(Serialize)]
struct ExamplePlaceLine {
    is_right: bool,
    features: [f64; NUM_FEATURES],
    /// Score of the best window's profile, and the sum of all that propose the place.
    profile: (f64, f64),
    sd_m: f64,
}

impl FeatureLog {
    /// Opens the file, if there is to be one.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: Option<&PathBuf>) -> Result<Self> {
        let open = |path: &PathBuf| File::create(path).with_context(|| path.display().to_string());
        let file = path.map(open).transpose()?.map(BufWriter::new);
        Ok(Self { file, map: String::new(), robots: String::new(), trial: 0 })
    }

    /// What follows is of another pair.
    pub fn begin(&mut self, map: &str, robots: &str) {
        (self.map, self.robots) = (map.to_owned(), robots.to_owned());
    }

    /// Writes what places a question by example weighs for a drive from power-on.
    ///
    /// # Errors
    /// A drive that cannot be read; a file that cannot be written.
    pub fn write_example(
        &mut self,
        (geometry, scans): (&ScanGeometry, &[Scan]),
        index: &PlaceIndex,
        config: &SessionConfig,
        truth: &Whereabouts,
    ) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let example = Example::read(&config.translator, geometry, scans, &config.recall)?;
        let Some(example) = example else { return Ok(()) };
        let places = index.find(&example, &config.recall).into_iter().map(|found| ExamplePlaceLine {
            is_right: truth.is_right(&found.map_from_robot),
            features: found.evidence.features(),
            profile: (found.evidence.profile_score, found.evidence.profile_support),
            sd_m: worst_sd_m(&found.covariance),
        });
        let line = ExampleLine {
            map: &self.map,
            robots: &self.robots,
            trial: self.trial,
            example_m: example.travel_m(),
            is_unclear: truth.is_on_map.is_none(),
            is_on_map: truth.is_on_map == Some(true),
            places: places.collect(),
        };
        serde_json::to_writer(&mut *file, &line)?;
        Ok(writeln!(file)?)
    }

    /// Writes what a session judged last.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&mut self, session: &SiteSession, truth: &Whereabouts) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let since = session.since_judged();
        let places = session.judged().iter().map(|place| PlaceLine {
            is_right: truth.is_right(&place.map_from_robot.compose(&since)),
            probability: place.probability,
            features: chain_features(&place.chain, place.lag),
            pieces: place
                .chain
                .pieces
                .iter()
                .map(|(_, fit)| (fit.contradicted, fit.contradicts, fit.coverage, fit.num_opinions))
                .collect(),
            sd_m: place.chain.sd_m,
            recent: place.recent_fit.as_ref().map(|fit| (fit.agreement(), fit.coverage)),
        });
        let line = Line {
            map: &self.map,
            robots: &self.robots,
            trial: self.trial,
            travel_m: session.travel_m(),
            state: session.state(),
            is_unclear: truth.is_on_map.is_none(),
            is_on_map: truth.is_on_map == Some(true),
            places: places.collect(),
        };
        serde_json::to_writer(&mut *file, &line)?;
        Ok(writeln!(file)?)
    }
}
