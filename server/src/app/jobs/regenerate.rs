//! New text generations: when a site has grown into another partition of densities, every text is written anew.
//!
//! ```text
//! generation g serves ─────────────────────────────────────────┐
//! histogram ─► partition differs? ─► all scans again into g+1 ─┤ writers wait: catch up, flip the record ─► g+1 serves
//! ```
//!
//! The flip is one write of the site's record. Whatever stops the work before it leaves generation g untouched; what
//! was written under g+1 is thrown away when the work begins anew. The generation before stays until the next flip,
//! for readers that are still in it.

use std::sync::Arc;

use locution_engine::text::{DensityHistogram, Quantizer, QuantizerConfig};

use crate::app::site::{BuildStage, Progress, RunWriter, Site, TextConfig, WriterState};
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{Generation, Key, RunIdx, delete_prefixes};
use crate::storage::Batch;

/// Scans translated and committed at once.
const NUM_SCANS_PER_STEP: u64 = 2_000;
/// Observations read at once.
const NUM_OBSERVATIONS_PER_STEP: usize = 10_000;

impl App {
    /// Writes all texts anew when the site's densities fall into materially different classes than its texts have.
    pub(in crate::app) async fn renew_texts(
        &self,
        site: &Arc<Site>,
        progress: &Progress,
    ) -> Result<(), AppError> {
        progress.at(BuildStage::Texts, 0.0)?;
        let Some(quantizer) = outdated_partition(site).await? else { return Ok(()) };
        let state = site.state();
        let old = state.record.generation;
        let new = old + 1;
        delete_prefixes(site.store(), &Key::all_of_generation(new)).await?;
        let text_config =
            TextConfig { engine: Arc::clone(&state.config), quantizer: Some(quantizer.clone()) };
        for run in 0..state.record.num_runs {
            progress.at(BuildStage::Texts, f64::from(run) / f64::from(state.record.num_runs))?;
            write_anew(site, run, new, &text_config, progress).await?;
        }
        let _no_writers = site.serving.write().await;
        // Scans that came meanwhile, and runs that were made.
        for run in 0..site.state().record.num_runs {
            write_anew(site, run, new, &text_config, progress).await?;
        }
        site.serve_generation(new, &quantizer).await?;
        tracing::info!(site = %site.name(), generation = new, classes = quantizer.num_classes(), "new texts serve");
        if let Some(stale) = old.checked_sub(1) {
            delete_prefixes(site.store(), &Key::all_of_generation(stale)).await?;
        }
        Ok(())
    }
}

/// The partition that the texts should have, when it is materially another than theirs.
async fn outdated_partition(site: &Site) -> Result<Option<Quantizer>, AppError> {
    let state = site.state();
    let config = &state.config.translator;
    let QuantizerConfig::MeanShift { bandwidth, min_share, max_moved_share, .. } = config.quantizer else {
        return Ok(None);
    };
    let mut histogram = DensityHistogram::default();
    let reader = site.reader();
    for run in 0..state.record.num_runs {
        let stored = reader.run(run).await?;
        let mut next = 0;
        while next < stored.text.num_observations {
            let page = stored.observations(next, NUM_OBSERVATIONS_PER_STEP).await?;
            next += page.len() as u64;
            page.iter()
                .filter_map(|observation| observation.densities.first())
                .for_each(|density| histogram.add(*density));
        }
    }
    let current = state.text_config()?.quantizer.unwrap_or_else(|| config.quantizer.initial());
    on_blocking_thread(move || {
        let found = Quantizer::mean_shift(&histogram, bandwidth, min_share);
        (histogram.total() > 0 && found.moved_share(&current, &histogram) > max_moved_share).then_some(found)
    })
    .await
}

/// Brings a run's text in a generation up to the scans that are stored.
async fn write_anew(
    site: &Site,
    run: RunIdx,
    generation: Generation,
    text_config: &TextConfig,
    progress: &Progress,
) -> Result<(), AppError> {
    let stored = site.reader().run(run).await?;
    if stored.record.is_deleted() {
        return Ok(());
    }
    let writer = RunWriter::new(run, Arc::clone(&stored.record), 1);
    let mut state = writer.load(site.store(), generation, text_config).await?;
    while state.num_scans_translated() < stored.head.next_sequence {
        progress.check()?;
        let next = state.num_scans_translated();
        let end = stored.head.next_sequence.min(next + NUM_SCANS_PER_STEP);
        let scans = stored.scans(next..end).await?;
        let mut translator = state.take_translator()?;
        let (translator, translated) = on_blocking_thread(move || {
            let translated = translator.translate(&scans);
            (translator, translated)
        })
        .await?;
        state.put_translator(translator);
        let mut batch = Batch::default();
        state.append_text(run, &translated, &mut batch);
        state.text.value.num_scans = end;
        // The next step reads this text from storage again only after a restart, but then it starts from here.
        state.append_checkpoint(run, NUM_SCANS_PER_STEP, &mut batch)?;
        commit_text(site, run, &mut state, batch).await?;
    }
    if stored.head.is_finished && !state.text.value.is_finished {
        let translator = state.take_translator()?;
        let translated = on_blocking_thread(move || translator.finish()).await?;
        let mut batch = Batch::default();
        state.append_text(run, &translated, &mut batch);
        state.text.value.is_finished = true;
        state.drop_checkpoint(run, &mut batch);
        commit_text(site, run, &mut state, batch).await?;
    }
    Ok(())
}

async fn commit_text(
    site: &Site,
    run: RunIdx,
    state: &mut WriterState,
    mut batch: Batch,
) -> Result<(), AppError> {
    let preconditions = state.append_text_head(run, &mut batch);
    Ok(site.store().commit(batch, preconditions).await?)
}
