//! Posts recordings to a server, each at its own pace, with a progress bar.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use locution_client::{Client, Encoding, NewRun, Scan};
use locution_engine::formats::CarmenLog;

use crate::wire::{wire_geometry, wire_scan};

/// How recordings are posted.
#[derive(Clone, Copy, Debug)]
pub struct UploadOptions {
    /// How scans travel.
    pub encoding: Encoding,
    /// Scans per batch.
    pub num_scans_per_batch: usize,
    /// Times the recorded speed; `None` is as fast as the server takes them.
    pub rate: Option<f64>,
    /// Whether the run is finished when all scans are posted.
    pub is_finishing: bool,
}

impl Default for UploadOptions {
    fn default() -> Self {
        Self { encoding: Encoding::Json, num_scans_per_batch: 100, rate: None, is_finishing: true }
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

/// A bar for one run, among others.
pub fn progress_bar(bars: &MultiProgress, run: &str, num_scans: usize) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{prefix:<16} {bar:32.cyan/white} {pos:>6}/{len} scans  {per_sec:>14}  {msg}",
    )
    .unwrap_or_else(|_| ProgressStyle::default_bar())
    .progress_chars("━╸─");
    let bar = bars.add(ProgressBar::new(num_scans as u64));
    bar.set_style(style);
    bar.set_prefix(run.to_owned());
    bar
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
        match job.state.as_str() {
            "done" => break,
            "failed" => bail!("the map could not be built: {}", job.error.or(job.detail).unwrap_or_default()),
            _ => {}
        }
        bar.set_position((1000.0 * job.progress) as u64);
        bar.set_message(job.detail.clone().unwrap_or_default());
        tokio::time::sleep(Duration::from_millis(200)).await;
        job = client.job(site, &job).await?;
    }
    bar.finish_with_message(job.detail.unwrap_or_default());
    Ok(())
}

/// Posts what the server does not have yet of a recording.
///
/// # Errors
/// The server refused something or did not answer.
pub async fn upload_recording(
    client: &Client,
    (site, run, robot): (&str, &str, &str),
    log: &CarmenLog,
    options: &UploadOptions,
    bar: &ProgressBar,
) -> Result<Uploaded> {
    let began = Instant::now();
    let new_run = NewRun { robot: robot.to_owned(), geometry: wire_geometry(&log.geometry) };
    let mut upload = client
        .start_upload(site, run, &new_run, options.encoding)
        .await
        .with_context(|| format!("run {run} cannot be opened"))?;
    let mut uploaded = Uploaded::default();
    let first = usize::try_from(upload.next_sequence())?.min(log.scans.len());
    bar.set_position(first as u64);
    bar.reset_eta();
    if upload.is_finished() {
        let status = client.run(site, run).await?;
        bar.finish_with_message("already finished");
        let (num_observations, num_words) = (status.num_observations, status.num_words);
        return Ok(Uploaded { num_observations, num_words, ..uploaded });
    }
    let mut pace = Pace::new(options.rate);
    for batch in log.scans[first..].chunks(options.num_scans_per_batch.max(1)) {
        pace.wait_for(batch[batch.len() - 1].timestamp_ns).await;
        let scans: Vec<Scan> = batch.iter().map(|scan| wire_scan(&log.geometry, scan)).collect();
        let first_sequence = upload.next_sequence();
        let answer = upload
            .post(&scans)
            .await
            .with_context(|| format!("run {run}, scans from sequence number {first_sequence}"))?;
        uploaded.num_scans += scans.len() as u64;
        uploaded.num_observations = answer.num_observations;
        uploaded.num_words = answer.num_words;
        bar.inc(scans.len() as u64);
        bar.set_message(format!("{} observations, {} words", answer.num_observations, answer.num_words));
    }
    if options.is_finishing {
        client.finish_run(site, run).await.with_context(|| format!("run {run} cannot be finished"))?;
        let status = client.run(site, run).await?;
        uploaded.num_observations = status.num_observations;
        uploaded.num_words = status.num_words;
    }
    uploaded.duration_s = began.elapsed().as_secs_f64();
    bar.finish_with_message(format!(
        "{} observations, {} words",
        uploaded.num_observations, uploaded.num_words
    ));
    Ok(uploaded)
}

/// Waits until a recorded moment has come, at some multiple of the recorded speed.
struct Pace {
    rate: Option<f64>,
    began: Instant,
    first_ns: Option<i64>,
}

impl Pace {
    fn new(rate: Option<f64>) -> Self {
        Self { rate, began: Instant::now(), first_ns: None }
    }

    async fn wait_for(&mut self, timestamp_ns: i64) {
        let Some(rate) = self.rate else { return };
        let first_ns = *self.first_ns.get_or_insert(timestamp_ns);
        let recorded_s = timestamp_ns.saturating_sub(first_ns) as f64 * 1e-9;
        let due = Duration::try_from_secs_f64(recorded_s / rate).unwrap_or(Duration::ZERO);
        tokio::time::sleep(due.saturating_sub(self.began.elapsed())).await;
    }
}
