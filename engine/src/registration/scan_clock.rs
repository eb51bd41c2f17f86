//! The time between two scans, as far as a robot's clock can be believed.

use serde::{Deserialize, Serialize};

/// Time between scans of a robot without a clock, seconds.
const UNTOLD_INTERVAL_S: f64 = 0.3;
/// A longer time than so many usual ones is a gap.
const GAP_INTERVALS: f64 = 3.0;

/// What time usually passes from scan to scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScanClock {
    /// Seconds; 0 while unknown.
    usual_s: f64,
}

impl ScanClock {
    /// Seconds since the scan before, as far as the clock can be believed; learns what is usual.
    pub fn gap_s(&mut self, timestamp_ns: i64, before_ns: i64) -> f64 {
        let gap_s = timestamp_ns.saturating_sub(before_ns) as f64 * 1e-9;
        let usual_s = &mut self.usual_s;
        if *usual_s <= 0.0 {
            *usual_s = gap_s.clamp(0.0, 1.0);
        } else {
            *usual_s += 0.05 * (gap_s.clamp(0.0, GAP_INTERVALS * *usual_s) - *usual_s);
        }
        // Clocks jitter: only a gap well beyond what is usual counts as one.
        match *usual_s {
            usual_s if usual_s <= 0.0 => UNTOLD_INTERVAL_S,
            usual_s if gap_s > GAP_INTERVALS * usual_s => gap_s,
            usual_s => usual_s,
        }
    }

    /// Usual time from scan to scan, seconds; 0 without a clock.
    pub const fn usual_s(&self) -> f64 {
        self.usual_s
    }
}
