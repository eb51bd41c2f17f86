//! Remembers registrations, so that a rebuild only computes what is new.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::indices::AnchorIdx;
use super::site_anchors::SiteAnchors;
use super::watch::{MappingError, Span};
use crate::geometry::Pose2;
use crate::registration::{Opinions, SearchWindow, SubmapConfig, SubmapFit, register};

/// A registration that is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Request {
    /// Anchor of the earlier submap.
    pub earlier: AnchorIdx,
    /// Anchor of the later submap.
    pub later: AnchorIdx,
    /// Where to search.
    pub window: SearchWindow,
}

type Key = (u64, u64, [i32; 5]);

/// Two submaps and the bits of how the one lies in the other.
type LaidKey = (u64, u64, [u64; 3]);

/// More opinions than these are not kept from one build to the next.
const NUM_OPINIONS_MAX: usize = 500_000;

/// Answers of registrations by the content of what was registered: whatever it holds, results are the same.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct RegistrationMemo {
    fits: Mutex<HashMap<Key, Option<SubmapFit>>>,
    /// Those that were asked for before the last map was finished, and not since.
    older: HashMap<Key, Option<SubmapFit>>,
    /// What submaps said of each other; cheaper than the submaps, which need not be made again.
    #[serde(skip)]
    opinions: Mutex<HashMap<LaidKey, Opinions>>,
    #[serde(skip)]
    older_opinions: HashMap<LaidKey, Opinions>,
    config: Option<SubmapConfig>,
}

impl RegistrationMemo {
    /// Number of remembered registrations.
    pub fn len(&self) -> usize {
        self.fits.lock().unwrap_or_else(PoisonError::into_inner).len() + self.older.len()
    }

    /// True when nothing is remembered.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets everything when the settings are others than before.
    pub(crate) fn prepare(&mut self, config: &SubmapConfig) {
        let is_other = self.config.as_ref() != Some(config);
        let opinions = self.opinions.get_mut().unwrap_or_else(PoisonError::into_inner);
        if is_other || opinions.len() > NUM_OPINIONS_MAX {
            opinions.clear();
        }
        if is_other {
            self.fits.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
            self.older.clear();
            self.older_opinions.clear();
            self.config = Some(config.clone());
        }
    }

    /// Forgets what was not asked for since the last turn, once a map is finished: what is settled asks no more.
    pub(crate) fn turn(&mut self) {
        self.older = std::mem::take(self.fits.get_mut().unwrap_or_else(PoisonError::into_inner));
        self.older_opinions = std::mem::take(self.opinions.get_mut().unwrap_or_else(PoisonError::into_inner));
    }

    /// What two submaps that lie like this say of each other.
    pub(crate) fn opinions(
        &self,
        site: &SiteAnchors<'_>,
        (earlier, later): (AnchorIdx, AnchorIdx),
        earlier_from_later: &Pose2,
    ) -> Opinions {
        let Pose2 { x, y, theta } = earlier_from_later;
        let name = |anchor| site.anchor(anchor).fingerprint;
        let key = (name(earlier), name(later), [x, y, theta].map(|value| value.to_bits()));
        let known = |opinions: &HashMap<LaidKey, Opinions>| opinions.get(&key).copied();
        if let Some(known) = known(&self.opinions.lock().unwrap_or_else(PoisonError::into_inner)) {
            return known;
        }
        if let Some(known) = known(&self.older_opinions) {
            self.opinions.lock().unwrap_or_else(PoisonError::into_inner).insert(key, known);
            return known;
        }
        let opinions = Opinions::of(site.submap(earlier), site.submap(later), earlier_from_later);
        self.opinions.lock().unwrap_or_else(PoisonError::into_inner).insert(key, opinions);
        opinions
    }

    /// Answers in the order of the requests; what is not remembered is computed in parallel.
    ///
    /// Windows are rounded first, so that a map that moved a little asks the same question again.
    ///
    /// # Errors
    /// [`MappingError::Stopped`]; what was computed before is remembered.
    pub(crate) fn answers(
        &self,
        requests: &[Request],
        site: &SiteAnchors<'_>,
        span: Span<'_>,
    ) -> Result<Vec<Option<SubmapFit>>, MappingError> {
        let keyed: Vec<(Key, Request)> = requests.iter().map(|request| key_of(request, site)).collect();
        let mut missing: Vec<(Key, Request)> = {
            let mut fits = self.fits.lock().unwrap_or_else(PoisonError::into_inner);
            for (key, _) in &keyed {
                if let Some(fit) = self.older.get(key) {
                    fits.entry(*key).or_insert(*fit);
                }
            }
            keyed.iter().filter(|(key, _)| !fits.contains_key(key)).copied().collect()
        };
        missing.sort_by_key(|(key, _)| *key);
        missing.dedup_by_key(|(key, _)| *key);
        let num_done = AtomicUsize::new(0);
        let computed: Vec<(Key, Option<SubmapFit>)> = missing
            .par_iter()
            .filter_map(|(key, request)| {
                span.done(num_done.fetch_add(1, Ordering::Relaxed), missing.len()).ok()?;
                let (earlier, later) = (site.submap(request.earlier), site.submap(request.later));
                Some((*key, register(earlier, later, &request.window, &site.config.submap)))
            })
            .collect();
        let mut fits = self.fits.lock().unwrap_or_else(PoisonError::into_inner);
        fits.extend(computed);
        span.done(1, 1)?;
        Ok(keyed.iter().map(|(key, _)| fits.get(key).copied().flatten()).collect())
    }
}

/// Grain of the rounded windows: metres and radians.
const GRAIN_M: f64 = 0.25;
const GRAIN_RAD: f64 = 0.05;

fn key_of(request: &Request, site: &SiteAnchors<'_>) -> (Key, Request) {
    let window = &request.window;
    let grains = [
        (window.center.x / GRAIN_M).round() as i32,
        (window.center.y / GRAIN_M).round() as i32,
        (window.center.theta / GRAIN_RAD).round() as i32,
        (window.half_m / GRAIN_M).ceil() as i32,
        (window.half_turn_rad / GRAIN_RAD).ceil() as i32,
    ];
    let center = Pose2::new(
        f64::from(grains[0]) * GRAIN_M,
        f64::from(grains[1]) * GRAIN_M,
        f64::from(grains[2]) * GRAIN_RAD,
    );
    let window = SearchWindow {
        center,
        half_m: f64::from(grains[3]) * GRAIN_M,
        half_turn_rad: f64::from(grains[4]) * GRAIN_RAD,
    };
    let name = |anchor| site.anchor(anchor).fingerprint;
    let key = (name(request.earlier), name(request.later), grains);
    (key, Request { window, ..*request })
}
