//! Posts recordings to a server, each at its own pace, with a progress bar.

use std::future::Future;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use locution_client::{Client, Encoding, JobState, NewRun, RunUpload, Scan};
use locution_engine::formats::CarmenLog;

use crate::wire::{wire_geometry, wire_scan};

/// How recordings are posted.
#[derive(Clone, Debug)]
pub struct UploadOptions {
    /// How scans travel.
    pub encoding: Encoding,
    /// Scans per batch.
    pub num_scans_per_batch: usize,
    /// Times the recorded speed; `None` is as fast as the server takes them.
    pub rate: Option<f64>,
    /// Whether the run is finished when all scans are posted.
    pub is_finishing: bool,
    /// Where the runs belong, when somebody said.
    pub area: Option<String>,
}

impl Default for UploadOptions {
    fn default() -> Self {
        Self {
            encoding: Encoding::Json,
            num_scans_per_batch: 100,
            rate: None,
            is_finishing: true,
            area: None,
        }
    }
}

/// What became of an upload.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uploaded {
    /// Scans posted now, not those that the server already had.
    pub num_scans: u64,
    /// Observations of the run.
    pub num_observations: u64,
    /// Words of the run.
    pub num_words: u64,
    /// Time from the first request to the last answer, seconds.
    pub duration_s: f64,
}

/// How long a server that does not answer is waited for before the first request.
const SERVER_PATIENCE: Duration = Duration::from_secs(5);
/// A request that takes longer is shown as waited for.
const WAITING_SHOWN_AFTER: Duration = Duration::from_secs(2);
/// Longest wait for the time between two scans, in recorded seconds: clocks are set while runs are recorded.
const GAP_MAX_S: f64 = 5.0;

/// Waits until a server is ready, and says so on standard error while it is not.
///
/// # Errors
/// None was within a few seconds.
pub async fn reach_server(client: &Client) -> Result<()> {
    let began = Instant::now();
    let mut is_told = false;
    loop {
        let left = SERVER_PATIENCE.saturating_sub(began.elapsed());
        if tokio::time::timeout(left, client.is_ready()).await.unwrap_or(false) {
            return Ok(());
        }
        if left.is_zero() {
            bail!(
                "no server is ready at {}; `locution serve` starts one, --url says where it is",
                client.base_url()
            );
        }
        if !is_told {
            eprintln!("waiting for the server at {}", client.base_url());
            is_told = true;
        }
        tokio::time::sleep(Duration::from_millis(200).min(left)).await;
    }
}

/// One bar for all scans of an upload, with their rate and the time left.
pub fn progress_bar(name: &str, num_scans: usize) -> ProgressBar {
    let rate = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
        // Writing to the bar's line cannot fail.
        let _ = write!(text, "{:.0} scans/s", state.per_sec());
    };
    let style =
        ProgressStyle::with_template("{prefix} {bar:32.cyan/white} {pos}/{len}  {rate}, {eta} left  {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key("rate", rate)
            .progress_chars("━╸─");
    ProgressBar::new(num_scans as u64).with_style(style).with_prefix(name.to_owned())
}

/// The answer to a request; the bar says when it is long in coming.
async fn shown<T>(bar: &ProgressBar, request: impl Future<Output = T>) -> T {
    tokio::pin!(request);
    match tokio::time::timeout(WAITING_SHOWN_AFTER, &mut request).await {
        Ok(answer) => answer,
        Err(_) => {
            bar.set_message("waiting for the server");
            let answer = request.await;
            bar.set_message("");
            answer
        }
    }
}

/// Builds the map of a site and shows how far it is.
///
/// The job is asked about rather than waited for in one request, which would end at the server's time limit.
///
/// # Errors
/// The build failed, or the server refused it.
pub async fn build_with_progress(client: &Client, site: &str) -> Result<()> {
    let style = ProgressStyle::with_template("{prefix:<16} {bar:32.cyan/white} {percent:>6} %  {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━╸─");
    let bar = ProgressBar::new(1000).with_style(style).with_prefix("building the map");
    let mut job = client.start_build(site).await.context("the map cannot be built")?;
    loop {
        match job.state {
            JobState::Done => break,
            JobState::Failed | JobState::Cancelled => {
                bail!("the map could not be built: {}", job.error.unwrap_or(job.detail))
            }
            JobState::Queued | JobState::Running => {}
        }
        bar.set_position((1000.0 * job.progress) as u64);
        bar.set_message(job.detail.clone());
        tokio::time::sleep(Duration::from_millis(200)).await;
        job = client.job(site, &job.id).await?;
    }
    bar.finish_with_message(job.detail);
    Ok(())
}

/// Makes a run, or finds it as it stands. Runs of a site are in the order in which they are made.
///
/// # Errors
/// The server refused it or did not answer.
pub async fn open_run(
    client: &Client,
    (site, run, robot): (&str, &str, &str),
    log: &CarmenLog,
    options: &UploadOptions,
) -> Result<RunUpload> {
    let geometry = wire_geometry(&log.geometry);
    let new_run = NewRun { robot: Some(robot.to_owned()), geometry, area: options.area.clone() };
    let upload = client.start_upload(site, run, &new_run, options.encoding).await;
    upload.with_context(|| format!("run {run} cannot be opened"))
}

/// Posts what the server does not have yet of a recording; the bar moves by every scan of it.
///
/// # Errors
/// The server refused something or did not answer.
pub async fn upload_recording(
    client: &Client,
    (site, run): (&str, &str),
    mut upload: RunUpload,
    log: &CarmenLog,
    options: &UploadOptions,
    bar: &ProgressBar,
) -> Result<Uploaded> {
    let began = Instant::now();
    let mut uploaded = Uploaded::default();
    let first = usize::try_from(upload.next_sequence())?.min(log.scans.len());
    bar.inc(first as u64);
    bar.reset_eta();
    if upload.is_finished() {
        bar.println(format!("{run}: already finished"));
        bar.inc((log.scans.len() - first) as u64);
        let status = client.run(site, run).await?;
        let (num_observations, num_words) = (status.num_observations, status.num_words);
        return Ok(Uploaded { num_observations, num_words, ..uploaded });
    }
    let mut pace = Pace::new(options.rate);
    for batch in log.scans[first..].chunks(options.num_scans_per_batch.max(1)) {
        for gap_s in pace.wait_for(batch.iter().map(|scan| scan.timestamp_ns)).await {
            bar.println(format!(
                "{run}: the clock steps by {gap_s:.0} s between two scans; it is not waited for"
            ));
        }
        let scans: Vec<Scan> = batch.iter().map(|scan| wire_scan(&log.geometry, scan)).collect();
        let first_sequence = upload.next_sequence();
        let answer = shown(bar, upload.post(&scans))
            .await
            .with_context(|| format!("run {run}, scans from sequence number {first_sequence}"))?;
        uploaded.num_scans += scans.len() as u64;
        uploaded.num_observations = answer.num_observations;
        uploaded.num_words = answer.num_words;
        bar.inc(scans.len() as u64);
    }
    if options.is_finishing {
        let finished = client.finish_run(site, run).await;
        let status = finished.with_context(|| format!("run {run} cannot be finished"))?;
        uploaded.num_observations = status.num_observations;
        uploaded.num_words = status.num_words;
    }
    uploaded.duration_s = began.elapsed().as_secs_f64();
    Ok(uploaded)
}

/// Waits until a recorded moment has come, at some multiple of the recorded speed. Time that steps back, or ahead by
/// more than [`GAP_MAX_S`], was not lived through and is not waited for.
struct Pace {
    rate: Option<f64>,
    began: Instant,
    last_ns: Option<i64>,
    recorded_s: f64,
}

impl Pace {
    fn new(rate: Option<f64>) -> Self {
        Self { rate, began: Instant::now(), last_ns: None, recorded_s: 0.0 }
    }

    /// Waits for the last of the scans; answers the steps of the clock that it did not wait for, seconds.
    async fn wait_for(&mut self, timestamps_ns: impl Iterator<Item = i64>) -> Vec<f64> {
        let Some(rate) = self.rate else { return Vec::new() };
        let steps = self.advance(timestamps_ns);
        let due = Duration::try_from_secs_f64(self.recorded_s / rate).unwrap_or(Duration::MAX);
        tokio::time::sleep(due.saturating_sub(self.began.elapsed())).await;
        steps
    }

    fn advance(&mut self, timestamps_ns: impl Iterator<Item = i64>) -> Vec<f64> {
        let mut steps = Vec::new();
        for timestamp_ns in timestamps_ns {
            let last_ns = self.last_ns.replace(timestamp_ns).unwrap_or(timestamp_ns);
            let gap_s = timestamp_ns.saturating_sub(last_ns) as f64 * 1e-9;
            if gap_s > GAP_MAX_S {
                steps.push(gap_s);
            }
            self.recorded_s += gap_s.clamp(0.0, GAP_MAX_S);
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_while_recording_is_waited_for_up_to_a_bound() {
        let second = 1_000_000_000;
        let mut pace = Pace::new(Some(1.0));
        assert!(pace.advance([0, second, 2 * second].into_iter()).is_empty());
        assert_eq!(pace.recorded_s, 2.0);
        let set = 1_700_000_000 * second;
        let steps = pace.advance([set, set + second, 5 * second, 6 * second].into_iter());
        assert_eq!(steps, [1_699_999_998.0]);
        assert_eq!(pace.recorded_s, 2.0 + GAP_MAX_S + 1.0 + 1.0);
    }

    #[tokio::test]
    async fn a_server_that_is_not_there_is_told_within_seconds() {
        // Nothing listens on the port of a listener that is gone.
        let address = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
        let client = Client::new(&format!("http://{address}")).unwrap();
        let error =
            tokio::time::timeout(2 * SERVER_PATIENCE, reach_server(&client)).await.unwrap().unwrap_err();
        assert!(error.to_string().contains(&address.to_string()), "{error}");
    }
}
