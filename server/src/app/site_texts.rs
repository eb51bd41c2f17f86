//! All texts of a site in memory, indexed, to answer questions by words from.
//!
//! The texts of finished runs stand in segments, each an immutable index of some runs. A newly finished run is a
//! segment of its own; a segment that is not much larger than the next one is merged with it, so that there are few of
//! them and a word is indexed anew only when the text around it has doubled. The text of a run that still grows is a
//! small segment which is made again when a question comes and the text is longer than it was.
//!
//! A finished text is also stored packed, under keys in the order of runs: one scan brings all texts back at start-up.
//! It can be told from the words, so whatever is missing is written when it is first missed.

use std::collections::BTreeMap;
use std::sync::Arc;

use locution_engine::index::{Lattice, OccurrenceIndex, store_words};
use tokio::sync::Mutex;

use super::reading::read_words;
use super::records::TextHead;
use super::runs::read_run;
use super::site::Site;
use super::{AppError, on_blocking_thread};
use crate::storage::keys::{Generation, Key, RunIdx};
use crate::storage::{Batch, Precondition, StorageError, codec};

/// Packed texts are cut into parts of this size.
const PART_BYTES: usize = 512 << 10;
/// Segments are merged when the earlier one is at most so many times as large.
const MERGE_RATIO: usize = 2;

/// Some runs' texts with their index.
pub struct Segment {
    /// The runs, in the order of the index.
    pub runs: Vec<RunIdx>,
    /// Their texts.
    pub index: OccurrenceIndex,
}

/// The texts of a site as far as they have been looked at.
#[derive(Default)]
pub(super) struct SiteTexts(Mutex<Texts>);

#[derive(Default)]
struct Texts {
    generation: Option<Generation>,
    finished: Vec<Arc<Segment>>,
    growing: BTreeMap<RunIdx, GrowingText>,
    /// Runs from this one on have not been looked at.
    next_run: RunIdx,
}

/// The text of a run that may still grow.
#[derive(Default)]
struct GrowingText {
    lattice: Lattice,
    num_words: Vec<u64>,
    segment: Option<Arc<Segment>>,
}

impl Site {
    /// All texts as they stand, indexed.
    ///
    /// # Errors
    /// Those of the storage.
    pub(super) async fn text_segments(&self) -> Result<Vec<Arc<Segment>>, AppError> {
        let mut texts = self.texts.0.lock().await;
        let record = self.state().record.clone();
        if texts.generation != Some(record.generation) {
            *texts = self.load_texts(record.generation).await?;
        }
        let indexed: Vec<RunIdx> = texts.finished.iter().flat_map(|segment| segment.runs.clone()).collect();
        for run in texts.next_run..record.num_runs {
            if !indexed.contains(&run) {
                texts.growing.insert(run, GrowingText::default());
            }
        }
        texts.next_run = record.num_runs;
        self.catch_up(&mut texts, record.generation).await?;
        let growing = texts.growing.values().filter_map(|text| text.segment.clone());
        Ok(texts.finished.iter().cloned().chain(growing).collect())
    }

    /// The packed texts of a generation as one segment.
    async fn load_texts(&self, generation: Generation) -> Result<Texts, AppError> {
        let entries = self.store().scan(&Key::all_packed_texts(generation), &[], usize::MAX).await?;
        let mut packed: BTreeMap<RunIdx, Vec<u8>> = BTreeMap::new();
        for (key, bytes) in entries {
            let run = Key::run_of_packed_text(&key)
                .ok_or_else(|| StorageError::Corrupt { what: "the key of a packed text".into() })?;
            packed.entry(run).or_default().extend(codec::decode::<Vec<u8>>(&bytes, "a packed text")?);
        }
        let segment = on_blocking_thread(move || segment_of(packed)).await??;
        let finished = if segment.runs.is_empty() { Vec::new() } else { vec![Arc::new(segment)] };
        Ok(Texts { generation: Some(generation), finished, ..Texts::default() })
    }

    /// Brings growing texts up to what is stored, and moves finished ones to their place.
    async fn catch_up(&self, texts: &mut Texts, generation: Generation) -> Result<(), AppError> {
        let runs: Vec<RunIdx> = texts.growing.keys().copied().collect();
        let keys: Vec<Vec<u8>> = runs.iter().map(|&run| Key::TextHead(generation, run).encode()).collect();
        let heads = self.store().multi_get(&keys).await?;
        for ((run, key), bytes) in runs.into_iter().zip(keys).zip(heads) {
            let Some(bytes) = bytes else { continue };
            let head: TextHead = codec::decode(&bytes, "the head of a text")?;
            let Some(text) = texts.growing.get_mut(&run) else { continue };
            if text.num_words != head.num_words {
                self.grow(text, run, &head, generation).await?;
            }
            if !head.is_finished {
                continue;
            }
            let packed = store_words(&text.lattice);
            self.store_packed(&packed, (generation, run), Precondition { key, expected: Some(bytes) })
                .await?;
            let segment = text.segment.take();
            texts.growing.remove(&run);
            texts.finished.extend(segment);
            merge_segments(&mut texts.finished).await?;
        }
        Ok(())
    }

    /// Reads the words that a text has gained and indexes it again.
    async fn grow(
        &self,
        text: &mut GrowingText,
        run: RunIdx,
        head: &TextHead,
        generation: Generation,
    ) -> Result<(), AppError> {
        let mut info = read_run(&**self.store(), generation, run).await?;
        // Words that came after the head was read are left for the next time, on all levels alike.
        info.text = head.clone();
        let mut words = Vec::new();
        for level in 0..head.num_words.len() {
            let known = text.num_words.get(level).copied().unwrap_or(0);
            words.extend(
                read_words(&**self.store(), generation, &info, level as u8, known, usize::MAX).await?,
            );
        }
        text.lattice.extend(&words).map_err(|error| StorageError::Corrupt { what: error.to_string() })?;
        text.num_words.clone_from(&head.num_words);
        let packed = store_words(&text.lattice);
        let segment = on_blocking_thread(move || segment_of(BTreeMap::from([(run, packed)]))).await??;
        text.segment = Some(Arc::new(segment));
        Ok(())
    }

    /// Stores a finished text packed, unless its generation has gone meanwhile.
    async fn store_packed(
        &self,
        packed: &[u8],
        (generation, run): (Generation, RunIdx),
        is_there: Precondition,
    ) -> Result<(), AppError> {
        let mut batch = Batch::default();
        for (part, bytes) in (0..).zip(packed.chunks(PART_BYTES)) {
            batch.put(Key::PackedText(generation, run, part).encode(), codec::encode(&bytes.to_vec()));
        }
        match self.store().commit(batch, vec![is_there]).await {
            Ok(()) | Err(StorageError::Conflict) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

fn segment_of(packed: BTreeMap<RunIdx, Vec<u8>>) -> Result<Segment, StorageError> {
    let index = OccurrenceIndex::from_stored(packed.values().map(Vec::as_slice));
    let index = index.ok_or_else(|| StorageError::Corrupt { what: "a packed text is no text".into() })?;
    Ok(Segment { runs: packed.into_keys().collect(), index })
}

/// Merges from the end on, as long as a segment is not much larger than the next one.
async fn merge_segments(segments: &mut Vec<Arc<Segment>>) -> Result<(), AppError> {
    while let [.., earlier, later] = &segments[..] {
        if earlier.index.num_words() > MERGE_RATIO * later.index.num_words() {
            break;
        }
        let both = [Arc::clone(earlier), Arc::clone(later)];
        let merged = on_blocking_thread(move || {
            let texts = both.iter().flat_map(|segment| {
                let texts = segment.runs.iter().enumerate();
                texts.map(|(idx, &run)| (run, segment.index.stored_run(idx)))
            });
            segment_of(texts.collect())
        })
        .await??;
        segments.truncate(segments.len() - 2);
        segments.push(Arc::new(merged));
    }
    Ok(())
}
