//! What speaks for and against every place that a session judged, as JSON lines: the data that weights are fitted to.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use locution_engine::geometry::Pose2;
use locution_engine::locate::{LocalizationState, SiteSession};
use locution_engine::recall::{fit_features, worst_sd_m};
use serde::Serialize;

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
    lag: f64,
    features: [f64; locution_engine::recall::NUM_FIT_FEATURES],
    sd_m: f64,
    /// Agreement and coverage of what was seen last.
    recent: Option<(f64, f64)>,
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

    /// Writes what a session judged last.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &mut self,
        session: &SiteSession,
        expected: Option<Option<Pose2>>,
        is_right: impl Fn(&Pose2) -> bool,
    ) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let since = session.since_judged();
        let places = session.judged().iter().map(|place| PlaceLine {
            is_right: is_right(&place.map_from_robot.compose(&since)),
            probability: place.probability,
            lag: place.lag,
            features: fit_features(&place.fit),
            sd_m: worst_sd_m(&place.fit.covariance),
            recent: place.recent_fit.as_ref().map(|fit| (fit.agreement(), fit.coverage)),
        });
        let line = Line {
            map: &self.map,
            robots: &self.robots,
            trial: self.trial,
            travel_m: session.travel_m(),
            state: session.state(),
            is_unclear: expected.is_none(),
            is_on_map: expected.flatten().is_some(),
            places: places.collect(),
        };
        serde_json::to_writer(&mut *file, &line)?;
        Ok(writeln!(file)?)
    }
}
