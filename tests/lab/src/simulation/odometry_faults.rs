//! Faults put into the odometry of a recording; what the laser sees stays as it was (SPEC section 9).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use locution_engine::geometry::{Pose2, wrap_angle};
use locution_engine::scan::Scan;

/// What odometry does wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OdometryFault {
    /// Nothing: the recording as it is.
    Clean,
    /// For five seconds the motion has the wrong sign.
    Reversed,
    /// For five seconds of driving nothing moves.
    Stuck,
    /// Two metres are counted while the robot stands.
    Spinning,
    /// The heading turns by 45° from one scan to the next.
    Turned45,
    /// The heading turns by 90° from one scan to the next.
    Turned90,
    /// The position steps aside by two metres from one scan to the next.
    Step,
    /// The pose begins at the origin again.
    Reset,
    /// Distances are a fifth too long all the way.
    LongScale,
    /// Distances are a fifth too short all the way.
    ShortScale,
    /// Every pose is the one of 0.3 s ago.
    Late,
    /// The pose never changes.
    Absent,
}

impl OdometryFault {
    /// All of them, the clean recording first.
    pub const ALL: [Self; 12] = [
        Self::Clean,
        Self::Reversed,
        Self::Stuck,
        Self::Spinning,
        Self::Turned45,
        Self::Turned90,
        Self::Step,
        Self::Reset,
        Self::LongScale,
        Self::ShortScale,
        Self::Late,
        Self::Absent,
    ];

    /// As tables call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Reversed => "reversed for 5 s",
            Self::Stuck => "stuck for 5 s",
            Self::Spinning => "spinning for 2 m",
            Self::Turned45 => "turned by 45°",
            Self::Turned90 => "turned by 90°",
            Self::Step => "step of 2 m",
            Self::Reset => "reset to zero",
            Self::LongScale => "20 % too long",
            Self::ShortScale => "20 % too short",
            Self::Late => "0.3 s late",
            Self::Absent => "none",
        }
    }

    /// True for faults that happen at some moments, not all the way.
    const fn is_momentary(self) -> bool {
        !matches!(self, Self::Clean | Self::LongScale | Self::ShortScale | Self::Late | Self::Absent)
    }
}

const DURATION_S: f64 = 5.0;
const LATE_S: f64 = 0.3;
const SPIN_M: f64 = 2.0;
/// Travel and turning of a stretch of [`DURATION_S`] that counts as driving, metres; below the second it stands.
const DRIVING_M: f64 = 0.8;
const STANDING_M: f64 = 0.02;

/// Puts a fault into the odometry `num` times, at places drawn from `rng`; returns the scans where it happens, first
/// to last. Fewer when the recording has no more room for it.
pub fn inject(
    scans: &mut [Scan],
    fault: OdometryFault,
    num: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<std::ops::Range<usize>> {
    let times_s = elapsed_s(scans);
    let clean: Vec<Pose2> = scans.iter().map(|scan| scan.odom_from_robot).collect();
    let mut motions: Vec<Pose2> = clean.windows(2).map(|pair| pair[0].between(&pair[1])).collect();
    let stretches = if fault.is_momentary() {
        stretches(&times_s, &motions, fault == OdometryFault::Spinning, num, rng)
    } else {
        Vec::new()
    };
    let mut resets = Vec::new();
    for stretch in &stretches {
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let at = &mut motions[stretch.start];
        match fault {
            OdometryFault::Reversed => {
                for motion in &mut motions[stretch.clone()] {
                    *motion = Pose2::new(-motion.x, -motion.y, motion.theta);
                }
            }
            OdometryFault::Stuck => motions[stretch.clone()].fill(Pose2::identity()),
            OdometryFault::Spinning => {
                let step = Pose2::new(SPIN_M / stretch.len() as f64, 0.0, 0.0);
                motions[stretch.clone()].iter_mut().for_each(|motion| *motion = motion.compose(&step));
            }
            OdometryFault::Turned45 => at.theta = wrap_angle(at.theta + sign * 45f64.to_radians()),
            OdometryFault::Turned90 => at.theta = wrap_angle(at.theta + sign * 90f64.to_radians()),
            OdometryFault::Step => {
                let (sin, cos) = (rng.random_range(0.0..360.0f64)).to_radians().sin_cos();
                (at.x, at.y) = (at.x + 2.0 * cos, at.y + 2.0 * sin);
            }
            _ => resets.push(stretch.start + 1),
        }
    }
    match fault {
        OdometryFault::LongScale => scale(&mut motions, 1.2),
        OdometryFault::ShortScale => scale(&mut motions, 0.8),
        _ => {}
    }
    let mut pose = clean.first().copied().unwrap_or_default();
    for (scan_idx, scan) in scans.iter_mut().enumerate() {
        if scan_idx > 0 {
            pose = pose.compose(&motions[scan_idx - 1]);
        }
        if resets.contains(&scan_idx) {
            pose = Pose2::identity();
        }
        scan.odom_from_robot = match fault {
            OdometryFault::Clean => clean[scan_idx],
            OdometryFault::Late => at_time(&times_s, &clean, times_s[scan_idx] - LATE_S),
            OdometryFault::Absent => Pose2::identity(),
            _ => pose,
        };
    }
    stretches
}

/// Seconds since the first scan, never going back: clocks of recordings jitter.
fn elapsed_s(scans: &[Scan]) -> Vec<f64> {
    let mut latest_ns = i64::MIN;
    let first_ns = scans.first().map_or(0, |scan| scan.timestamp_ns);
    scans
        .iter()
        .map(|scan| {
            latest_ns = latest_ns.max(scan.timestamp_ns);
            (latest_ns - first_ns) as f64 * 1e-9
        })
        .collect()
}

/// Motions that a fault replaces, well apart from each other.
fn stretches(
    times_s: &[f64],
    motions: &[Pose2],
    is_standing: bool,
    num: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<std::ops::Range<usize>> {
    let stretch_from = |start: usize| {
        let end = times_s.partition_point(|&time_s| time_s < times_s[start] + DURATION_S);
        start..end.min(motions.len())
    };
    let fits = |stretch: &std::ops::Range<usize>| {
        let driven_m: f64 = motions[stretch.clone()].iter().map(|motion| motion.x.hypot(motion.y)).sum();
        let turned: f64 = motions[stretch.clone()].iter().map(|motion| motion.theta.abs()).sum();
        stretch.len() >= 5
            && if is_standing { driven_m < STANDING_M && turned < STANDING_M } else { driven_m > DRIVING_M }
    };
    let mut candidates: Vec<_> = (0..motions.len()).map(stretch_from).filter(fits).collect();
    let mut chosen: Vec<std::ops::Range<usize>> = Vec::new();
    while chosen.len() < num && !candidates.is_empty() {
        let stretch = candidates.swap_remove(rng.random_range(0..candidates.len()));
        candidates.retain(|other| (times_s[other.start] - times_s[stretch.start]).abs() > 4.0 * DURATION_S);
        chosen.push(stretch);
    }
    chosen.sort_by_key(|stretch| stretch.start);
    chosen
}

fn scale(motions: &mut [Pose2], factor: f64) {
    for motion in motions {
        (motion.x, motion.y) = (motion.x * factor, motion.y * factor);
    }
}

/// The pose at a time between two scans.
fn at_time(times_s: &[f64], poses: &[Pose2], time_s: f64) -> Pose2 {
    let after = times_s.partition_point(|&other_s| other_s < time_s).min(poses.len() - 1);
    let before = after.saturating_sub(1);
    let gap_s = times_s[after] - times_s[before];
    let share = if gap_s > 0.0 { ((time_s - times_s[before]) / gap_s).clamp(0.0, 1.0) } else { 1.0 };
    let motion = poses[before].between(&poses[after]);
    poses[before].compose(&Pose2::new(share * motion.x, share * motion.y, share * motion.theta))
}
