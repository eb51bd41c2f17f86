//! A batch of scans: checked, translated, stored in one commit, answered when durable.
//!
//! ```text
//! batch ─► in sequence? ─► every scan possible? ─► translator (blocking thread) ─► scans, text, heads: one commit ─► receipt
//! ```
//!
//! Batches are idempotent by sequence number. A batch whose scans are stored already is answered as it was then. One
//! that overlaps what is stored must repeat it exactly; what goes beyond is appended. A gap or a difference is
//! refused with the number that the run expects.

use std::sync::Arc;
use std::time::Instant;

use locution_engine::geometry::Pose2;
use locution_engine::scan::{Scan, ScanGeometry};

use crate::app::site::{RunChange, RunWriter, Site, SiteEvent, Translated, WriterState};
use crate::app::{App, AppError, Name, on_blocking_thread};
use crate::records::{
    ReadingRules, Receipt, Run, RunHead, append_scans, find_receipt, is_same_scan, read_scans, read_stamps,
};
use crate::storage::Batch;

/// Scans to append to a run.
#[derive(Clone, Debug)]
pub struct NewBatch {
    /// Sequence number of the first scan.
    pub first_sequence: u64,
    /// In order; readings without a return are NaN or infinite.
    pub scans: Vec<Scan>,
    /// False when no scan tells where the robot is by its odometry.
    pub has_odometry: bool,
}

impl NewBatch {
    /// The scans after the first `num_known`, checked like those of a run whose last scan was taken at `before`.
    pub fn checked(
        mut self,
        (geometry, readings): (&ScanGeometry, &ReadingRules),
        num_known: usize,
        before: Option<(i64, Pose2)>,
        step_max_m: f64,
    ) -> Result<Vec<Scan>, AppError> {
        check_readings(&mut self.scans, geometry, readings)?;
        let num_known = num_known.min(self.scans.len());
        check_odometry(&self.scans, num_known, before, step_max_m)?;
        Ok(self.scans.split_off(num_known))
    }
}

impl App {
    /// Appends a batch to a run; the answer means that it would survive a power cut.
    ///
    /// # Errors
    /// [`AppError::Sequence`] for a gap or a differing overlap, [`AppError::Finished`], [`AppError::Invalid`] naming
    /// the scan and the field, [`AppError::Busy`]. Nothing of the batch is stored then.
    pub async fn append_batch(
        self: &Arc<Self>,
        site: Arc<Site>,
        run: &Name,
        batch: NewBatch,
    ) -> Result<Receipt, AppError> {
        let writer = site.writer(run, self.config().limits.num_batches_per_run_max).await?;
        let app = Arc::clone(self);
        // A task of its own: a client that hangs up must not stop a commit half way.
        let work = async move {
            let _place = writer.queue()?;
            let _generation = site.serving.read().await;
            let mut slot = writer.state.lock().await;
            app.open_runs.used(&writer);
            let mut state = app.wake(&site, &writer, slot.take()).await?;
            let outcome = app.append_to(&site, &writer, &mut state, batch).await;
            if leaves_state_whole(&outcome) {
                *slot = Some(state);
            }
            outcome
        };
        tokio::spawn(work).await.map_err(AppError::internal)?
    }

    /// Ends a run: what the translator held back is brought out and stored.
    pub async fn finish_run(self: &Arc<Self>, site: Arc<Site>, run: &Name) -> Result<Run, AppError> {
        let writer = site.writer(run, self.config().limits.num_batches_per_run_max).await?;
        let app = Arc::clone(self);
        let for_task = Arc::clone(&site);
        let work = async move {
            let _place = writer.queue()?;
            let _generation = for_task.serving.read().await;
            let mut slot = writer.state.lock().await;
            let mut state = app.wake(&for_task, &writer, slot.take()).await?;
            if !state.head.value.is_finished {
                finish(&for_task, &writer, &mut state).await?;
                let run = writer.record.name.clone();
                for_task.events().tell(SiteEvent::Run { run, change: RunChange::Finished });
                app.build_soon(&for_task);
            }
            Ok::<_, AppError>(())
        };
        tokio::spawn(work).await.map_err(AppError::internal)??;
        site.run(run).await
    }

    /// The state in memory when it still is of the serving generation, else what is stored.
    async fn wake(
        &self,
        site: &Site,
        writer: &RunWriter,
        state: Option<WriterState>,
    ) -> Result<WriterState, AppError> {
        match state {
            Some(state) if state.generation == site.generation() => Ok(state),
            _ => {
                let state = site.state();
                writer.load(site.store(), state.record.generation, &state.text_config()?).await
            }
        }
    }

    async fn append_to(
        &self,
        site: &Site,
        writer: &RunWriter,
        state: &mut WriterState,
        mut batch: NewBatch,
    ) -> Result<Receipt, AppError> {
        let num_scans_max = self.config().limits.num_scans_per_batch_max;
        if batch.scans.len() > num_scans_max {
            let problem =
                format!("{} scans are more than the {num_scans_max} allowed in a batch", batch.scans.len());
            return Err(AppError::invalid("scans", problem));
        }
        check_readings(&mut batch.scans, &writer.record.geometry, &writer.record.readings)?;
        let num_repeated = repeated_scans(site, writer, &state.head.value, &batch).await?;
        if num_repeated == batch.scans.len() {
            return receipt_again(site, writer, state, &batch).await;
        }
        if state.head.value.is_finished {
            let expected_sequence = state.head.value.next_sequence;
            return Err(AppError::Finished { run: writer.record.name.clone(), expected_sequence });
        }
        check_has_odometry(&batch, state.head.value.last_odom_from_robot)?;
        let before = last_stamp(site, writer, &state.head.value).await?;
        check_odometry(&batch.scans, num_repeated, before, self.config().limits.odometry_step_max_m)?;
        let fresh = batch.scans.split_off(num_repeated);
        let interval = self.config().storage.num_scans_per_checkpoint;
        let receipt = append_fresh(site, writer, state, fresh, interval).await?;
        site.events().tell(SiteEvent::Words { run: writer.record.name.clone(), receipt });
        Ok(receipt)
    }
}

/// Refusals that came before anything was changed leave the translator as it was.
fn leaves_state_whole(outcome: &Result<Receipt, AppError>) -> bool {
    matches!(
        outcome,
        Ok(_)
            | Err(AppError::Sequence { .. }
                | AppError::Finished { .. }
                | AppError::Invalid { .. }
                | AppError::NotReady { .. })
    )
}

/// Checks the readings, and writes them in the one way that is stored: NaN for "no return", zero for what says nothing,
/// which is too near or missing at the end.
fn check_readings(scans: &mut [Scan], geometry: &ScanGeometry, rules: &ReadingRules) -> Result<(), AppError> {
    let (num_min, num_max) = (rules.num_ranges_min, geometry.num_ranges);
    for (scan_idx, scan) in scans.iter_mut().enumerate() {
        let refuse =
            |problem: String| Err(AppError::invalid_scan(format!("scans[{scan_idx}].ranges_m"), problem));
        let num_ranges = scan.ranges_m.len();
        if num_ranges < num_min || num_ranges > num_max {
            let stated =
                if num_min == num_max { num_max.to_string() } else { format!("{num_min} to {num_max}") };
            return refuse(format!(
                "scan {scan_idx} has {num_ranges} ranges, the run's geometry has {stated}"
            ));
        }
        if are_millimeters(&scan.ranges_m) {
            let problem = format!("most ranges of scan {scan_idx} are beyond {PLAUSIBLE_RANGE_M} m");
            return refuse(format!("{problem}: they must be metres, not millimetres"));
        }
        for range_m in &mut scan.ranges_m {
            let told = f64::from(*range_m);
            if told < rules.range_min_m {
                *range_m = 0.0;
            } else if !told.is_finite() || told >= geometry.range_max_m {
                *range_m = f32::NAN;
            }
        }
        scan.ranges_m.resize(num_max, 0.0);
    }
    Ok(())
}

/// Hardly any laser sees farther, metres.
const PLAUSIBLE_RANGE_M: f32 = 200.0;

/// True when most readings are too far for metres and differ from one another, as codes for "no return" do not.
fn are_millimeters(ranges_m: &[f32]) -> bool {
    let num_finite = ranges_m.iter().filter(|range_m| range_m.is_finite() && **range_m > 0.0).count();
    let is_far = |range_m: f32| range_m.is_finite() && range_m > PLAUSIBLE_RANGE_M;
    let num_differing = ranges_m.windows(2).filter(|pair| is_far(pair[1]) && pair[0] != pair[1]).count();
    num_finite >= 8 && 2 * num_differing > num_finite
}

/// A run has odometry from its first scan on or never.
fn check_has_odometry(batch: &NewBatch, before: Option<Pose2>) -> Result<(), AppError> {
    if !batch.has_odometry && before.is_some_and(|before| before != Pose2::identity()) {
        let problem = "the scans of this run had odometry so far; all scans of a run have it or none";
        return Err(AppError::invalid_scan("scans[0].odom_from_robot", problem));
    }
    Ok(())
}

/// No robot is faster, metres per second.
const SPEED_MAX_M_PER_S: f64 = 3.0;
/// Odometry that is reset begins this close to zero, metres.
const RESET_MAX_M: f64 = 0.5;

/// Odometry may jump, and the engine says whether the scans bear it out. But no robot is a building farther from one scan to
/// the next: that is another recording, or damage. Odometry that begins at zero again is neither.
fn check_odometry(
    scans: &[Scan],
    first_fresh: usize,
    before: Option<(i64, Pose2)>,
    step_max_m: f64,
) -> Result<(), AppError> {
    let mut before = before;
    for (scan_idx, scan) in scans.iter().enumerate().skip(first_fresh) {
        let here = scan.odom_from_robot;
        let (step_m, gap_s) = before.map_or((0.0, 0.0), |(before_ns, before)| {
            (before.distance(&here), scan.timestamp_ns.saturating_sub(before_ns) as f64 * 1e-9)
        });
        let step_max_m = step_max_m.max(SPEED_MAX_M_PER_S * gap_s);
        if step_m > step_max_m && here.x.hypot(here.y) > RESET_MAX_M {
            let problem = format!(
                "scan {scan_idx} lies {step_m:.1} m from the scan before it, more than the {step_max_m:.0} m a robot \
                 moves meanwhile; start a new run after a jump of the odometry"
            );
            return Err(AppError::invalid_scan(format!("scans[{scan_idx}].odom_from_robot"), problem));
        }
        before = Some((scan.timestamp_ns, here));
    }
    Ok(())
}

/// How many scans of the batch are stored already, being the same.
async fn repeated_scans(
    site: &Site,
    writer: &RunWriter,
    head: &RunHead,
    batch: &NewBatch,
) -> Result<usize, AppError> {
    let expected_sequence = head.next_sequence;
    let refuse = |detail: String| Err(AppError::Sequence { expected_sequence, detail });
    if batch.first_sequence > expected_sequence {
        return refuse(format!("scans {expected_sequence} to {} are missing", batch.first_sequence - 1));
    }
    let end = batch.first_sequence.saturating_add(batch.scans.len() as u64).min(expected_sequence);
    let stored =
        read_scans(site.store(), writer.idx, &writer.record.geometry, batch.first_sequence..end).await?;
    match stored.iter().zip(&batch.scans).position(|(stored, sent)| !is_same_scan(stored, sent)) {
        Some(idx) => {
            let sequence = batch.first_sequence + idx as u64;
            refuse(format!("scans[{idx}] differs from the stored scan of sequence number {sequence}"))
        }
        None => Ok(stored.len()),
    }
}

/// Time and odometry of the last scan that is stored.
async fn last_stamp(
    site: &Site,
    writer: &RunWriter,
    head: &RunHead,
) -> Result<Option<(i64, Pose2)>, AppError> {
    let Some(last) = head.next_sequence.checked_sub(1) else { return Ok(None) };
    Ok(read_stamps(site.store(), writer.idx, last..head.next_sequence).await?.pop())
}

/// The answer to a batch that is stored: the one it got then, or where the run stands when it was cut differently.
async fn receipt_again(
    site: &Site,
    writer: &RunWriter,
    state: &WriterState,
    batch: &NewBatch,
) -> Result<Receipt, AppError> {
    let now = Receipt {
        next_sequence: state.head.value.next_sequence,
        num_observations: state.text.value.num_observations,
        num_words: state.text.value.num_words_all_levels(),
    };
    if batch.scans.is_empty() {
        return Ok(now);
    }
    let range = batch.first_sequence..batch.first_sequence + batch.scans.len() as u64;
    Ok(find_receipt(site.store(), writer.idx, range).await?.unwrap_or(now))
}

/// Translates and stores scans that continue the run.
async fn append_fresh(
    site: &Site,
    writer: &RunWriter,
    state: &mut WriterState,
    scans: Vec<Scan>,
    checkpoint_interval: u64,
) -> Result<Receipt, AppError> {
    let started = Instant::now();
    let num_scans = scans.len() as u64;
    let first_sequence = state.head.value.next_sequence;
    let run = writer.idx;
    let mut translator = state.take_translator()?;
    let (translator, scans, translated) = on_blocking_thread(move || {
        let translated = translator.translate(&scans);
        (translator, scans, translated)
    })
    .await?;
    state.put_translator(translator);
    let translated_s = started.elapsed().as_secs_f64();
    let mut batch = Batch::default();
    state.append_text(run, &translated, &mut batch);
    state.head.value.next_sequence += num_scans;
    state.head.value.last_odom_from_robot = scans.last().map(|scan| scan.odom_from_robot);
    state.text.value.num_scans += num_scans;
    let receipt = Receipt {
        next_sequence: state.head.value.next_sequence,
        num_observations: state.text.value.num_observations,
        num_words: state.text.value.num_words_all_levels(),
    };
    append_scans(&mut batch, run, first_sequence, &scans, receipt);
    state.append_checkpoint(run, checkpoint_interval, &mut batch)?;
    let preconditions = state.append_heads(run, &mut batch);
    site.store().commit(batch, preconditions).await?;
    metrics::counter!("locution_scans_total").increment(num_scans);
    metrics::counter!("locution_batches_total").increment(1);
    metrics::histogram!("locution_translate_seconds").record(translated_s);
    metrics::histogram!("locution_batch_seconds").record(started.elapsed().as_secs_f64());
    Ok(receipt)
}

/// Stores the tail of a text. A finished run needs no translator again, so the stored one goes. A run that an earlier
/// version of the server left open ends where its text does.
async fn finish(site: &Site, writer: &RunWriter, state: &mut WriterState) -> Result<(), AppError> {
    let translated = match state.translator.take() {
        Some(translator) => on_blocking_thread(move || translator.finish()).await?,
        None => Translated::default(),
    };
    let mut batch = Batch::default();
    state.append_text(writer.idx, &translated, &mut batch);
    state.head.value.is_finished = true;
    state.text.value.is_finished = true;
    state.drop_checkpoint(writer.idx, &mut batch);
    let preconditions = state.append_heads(writer.idx, &mut batch);
    Ok(site.store().commit(batch, preconditions).await?)
}
