//! How a job tells where it is, from any thread, and hears that it has to end.
//!
//! The share that is done is one of time: stages weigh what they took when the site's map was last built, or what they
//! take of builds in general. So the time that is left follows from the time that has passed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio_util::sync::CancellationToken;

use crate::app::AppError;

/// The parts of a build, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildStage {
    /// Texts are written anew when the site has outgrown its partition.
    Texts,
    /// Runs are read.
    Reading,
    /// Runs are settled on their own.
    Settling,
    /// Runs are laid over each other.
    Joining,
    /// What the texts say of every match; labels.
    Weighing,
    /// The version is written.
    Writing,
    /// Questions by example are prepared.
    Preparing,
}

/// Number of stages.
const NUM_STAGES: usize = 7;
/// What each stage takes of a build before any was timed.
const USUAL_SHARES: [f64; NUM_STAGES] = [0.01, 0.05, 0.4, 0.4, 0.07, 0.02, 0.05];
/// No stage weighs less than this share of the whole: the next build may find more to do in it.
const MIN_SHARE: f64 = 0.002;
/// Nothing is said of the time that is left before this share is done …
const TELLING_SHARE: f64 = 0.03;
/// … and this much time has passed.
const TELLING_TIME: Duration = Duration::from_millis(300);

impl BuildStage {
    /// Whether what was done of it is there when the job goes on after a pause.
    fn is_remembered(self) -> bool {
        matches!(self, Self::Settling | Self::Joining)
    }

    /// What is being done.
    fn detail(self) -> &'static str {
        match self {
            Self::Texts => "looking at the densities and the texts",
            Self::Reading => "reading the runs",
            Self::Settling => "matching the places of each run and optimising its graph",
            Self::Joining => "laying runs over each other",
            Self::Weighing => "weighing texts and labelling places",
            Self::Writing => "writing the map",
            Self::Preparing => "preparing questions by example",
        }
    }
}

/// What stages took in the last build of a site, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTimes([f64; NUM_STAGES]);

impl Default for StageTimes {
    fn default() -> Self {
        Self(USUAL_SHARES)
    }
}

impl StageTimes {
    /// Shares of the whole that sum up to 1.
    fn shares(&self) -> [f64; NUM_STAGES] {
        let total: f64 = self.0.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let raised = self.0.map(|took| (took / total).max(MIN_SHARE));
        let total: f64 = raised.iter().sum();
        raised.map(|share| share / total)
    }
}

/// Why a job has to end before it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Somebody cancelled it.
    Cancelled,
    /// The site is deleted or the server stops.
    Stopping,
    /// Others wait for its place.
    GivesWay,
}

/// Where a job is, and whether it may go on.
#[derive(Debug)]
pub struct Progress {
    shares: [f64; NUM_STAGES],
    now: Mutex<Now>,
    /// Set when somebody cancels the job.
    cancelled: CancellationToken,
    /// Set when the site is deleted or the server stops.
    stopping: CancellationToken,
    gives_way: AtomicBool,
}

#[derive(Debug, Default)]
struct Now {
    stage: Option<BuildStage>,
    share: f64,
    took_s: [f64; NUM_STAGES],
    /// Since when it works without a pause, and when it was last heard of.
    working_since: Option<Instant>,
    heard_at: Option<Instant>,
    /// Time that it worked before the last pause.
    worked: Duration,
}

impl Progress {
    /// A job that nobody ends.
    #[cfg(test)]
    pub fn unwatched() -> Self {
        Self::new(StageTimes::default(), CancellationToken::new())
    }

    /// A job that has not begun; `times` are those of the build before.
    pub fn new(times: StageTimes, stopping: CancellationToken) -> Self {
        Self {
            shares: times.shares(),
            now: Mutex::default(),
            cancelled: CancellationToken::new(),
            stopping,
            gives_way: AtomicBool::new(false),
        }
    }

    /// Begins to work, or goes on after a pause.
    pub fn go_on(&self) {
        self.gives_way.store(false, Ordering::Relaxed);
        let mut now = self.now();
        now.working_since = Some(Instant::now());
        now.heard_at = None;
        now.stage = None;
    }

    /// Pauses: the time that passes from now on does not count.
    pub fn pause(&self) {
        let mut now = self.now();
        let worked = now.working_since.take().map_or(Duration::ZERO, |since| since.elapsed());
        now.worked += worked;
    }

    /// Says what is being done, and how much of it is done, from 0 to 1.
    ///
    /// # Errors
    /// [`AppError::Stopping`] when the job has to end.
    pub fn at(&self, stage: BuildStage, share: f64) -> Result<(), AppError> {
        self.tell(stage, share);
        if stage.is_remembered() && self.ending() == Some(Ending::GivesWay) {
            return Err(AppError::Stopping);
        }
        self.check()
    }

    /// The same where the job can no longer end without being done.
    pub fn tell(&self, stage: BuildStage, share: f64) {
        let mut now = self.now();
        let heard_at = Instant::now();
        if let (Some(known), Some(before)) = (now.stage, now.heard_at) {
            now.took_s[known as usize] += (heard_at - before).as_secs_f64();
        }
        now.stage = Some(stage);
        now.heard_at = Some(heard_at);
        let before: f64 = self.shares[..stage as usize].iter().sum();
        let share = before + self.shares[stage as usize] * share.clamp(0.0, 1.0);
        // After a pause it begins anew and soon is where it was.
        now.share = now.share.max(share.min(1.0));
    }

    /// Whether the job may go on.
    ///
    /// # Errors
    /// [`AppError::Stopping`] when it was cancelled or has to stop.
    pub fn check(&self) -> Result<(), AppError> {
        match self.ending() {
            None | Some(Ending::GivesWay) => Ok(()),
            Some(Ending::Cancelled | Ending::Stopping) => Err(AppError::Stopping),
        }
    }

    /// Ends the job at its next step.
    pub fn cancel(&self) {
        self.cancelled.cancel();
    }

    /// Lets another job have the place at the next step.
    pub fn give_way(&self) {
        self.gives_way.store(true, Ordering::Relaxed);
    }

    /// Returns when the job was cancelled or has to stop.
    pub async fn ended(&self) {
        tokio::select! {
            () = self.cancelled.cancelled() => {}
            () = self.stopping.cancelled() => {}
        }
    }

    /// Why the job has to end, when it has to.
    pub fn ending(&self) -> Option<Ending> {
        if self.stopping.is_cancelled() {
            Some(Ending::Stopping)
        } else if self.cancelled.is_cancelled() {
            Some(Ending::Cancelled)
        } else {
            self.gives_way.load(Ordering::Relaxed).then_some(Ending::GivesWay)
        }
    }

    /// Share of the whole that is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        self.now().share
    }

    /// What is being done.
    pub fn detail(&self) -> &'static str {
        let now = self.now();
        match (now.stage, now.working_since) {
            (Some(_), None) if self.gives_way.load(Ordering::Relaxed) => "letting builds of other sites pass",
            (stage, _) => stage.map_or("beginning", BuildStage::detail),
        }
    }

    /// Time that is left, as far as the time passed tells.
    pub fn left(&self) -> Option<Duration> {
        let now = self.now();
        let worked = now.worked + now.working_since.map_or(Duration::ZERO, |since| since.elapsed());
        let is_telling = now.share >= TELLING_SHARE && worked >= TELLING_TIME;
        is_telling.then(|| worked.mul_f64((1.0 - now.share) / now.share))
    }

    /// What the stages took, once the job is done.
    pub fn times(&self) -> StageTimes {
        StageTimes(self.now().took_s)
    }

    fn now(&self) -> std::sync::MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(times: StageTimes) -> Progress {
        Progress::new(times, CancellationToken::new())
    }

    #[test]
    fn the_share_grows_with_the_weight_of_stages_and_never_shrinks() {
        let progress = progress(StageTimes([0.0, 1.0, 2.0, 1.0, 0.0, 0.0, 0.0]));
        progress.go_on();
        progress.at(BuildStage::Settling, 0.5).unwrap();
        assert!((progress.share() - 0.5).abs() < 0.02, "{}", progress.share());
        progress.go_on();
        progress.at(BuildStage::Reading, 0.0).unwrap();
        assert!((progress.share() - 0.5).abs() < 0.02, "{}", progress.share());
        progress.at(BuildStage::Preparing, 1.0).unwrap();
        assert!((progress.share() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn whoever_works_hears_why_it_has_to_end() {
        let stopping = CancellationToken::new();
        let progress = Progress::new(StageTimes::default(), stopping.child_token());
        assert!(progress.at(BuildStage::Reading, 0.1).is_ok());
        progress.give_way();
        assert!(progress.at(BuildStage::Reading, 0.2).is_ok(), "it would have to read again");
        assert!(progress.at(BuildStage::Settling, 0.2).is_err());
        assert_eq!(progress.ending(), Some(Ending::GivesWay));
        progress.go_on();
        assert_eq!(progress.ending(), None);
        progress.cancel();
        progress.go_on();
        assert_eq!(progress.ending(), Some(Ending::Cancelled));
        stopping.cancel();
        assert_eq!(progress.ending(), Some(Ending::Stopping));
    }

    #[test]
    fn times_of_a_build_are_shares_of_the_next() {
        let shares = StageTimes([0.0, 1.0, 8.0, 1.0, 0.0, 0.0, 0.0]).shares();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        assert!(shares[2] > 0.78 && shares[0] > 0.0);
    }
}
