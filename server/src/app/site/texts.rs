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
use std::sync::atomic::AtomicU64;

use locution_engine::index::{Lattice, OccurrenceIndex, store_words};
use tokio::sync::Mutex;

use crate::app::{AppError, on_blocking_thread};
use crate::records::{Generation, Key, RunIdx, SiteReader, SiteRecord, TextHead, codec, join_pieces, pieces};
use crate::storage::{Batch, Precondition, SiteStore, StorageError};

/// Segments are merged when the earlier one is at most so many times as large.
const MERGE_RATIO: usize = 2;

/// Some runs' texts with their index.
pub struct Segment {
    /// The runs, in the order of the index.
    pub runs: Vec<RunIdx>,
    pub index: OccurrenceIndex,
}

/// The texts of a site as far as they have been looked at.
#[derive(Default)]
pub struct SiteTexts {
    texts: Mutex<Texts>,
    /// When they were last asked for, on the clock of `TextBudget`.
    pub(super) last_use: AtomicU64,
}

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

impl SiteTexts {
    /// Bytes of the indexes in memory; nothing while they are being worked on.
    pub fn num_index_bytes(&self) -> usize {
        self.texts.try_lock().map_or(0, |texts| texts.num_index_bytes())
    }

    /// Lets go of what was read unless somebody works on it; the bytes that are free then.
    pub(super) fn let_go(&self) -> usize {
        let Ok(mut texts) = self.texts.try_lock() else { return 0 };
        std::mem::take(&mut *texts).num_index_bytes()
    }

    /// Forgets what was read, since a text has gone.
    pub async fn forget(&self) {
        *self.texts.lock().await = Texts::default();
    }

    /// All texts of the serving generation as they stand, indexed.
    pub async fn segments(
        &self,
        store: &Arc<dyn SiteStore>,
        record: &SiteRecord,
    ) -> Result<Vec<Arc<Segment>>, AppError> {
        let mut texts = self.texts.lock().await;
        if texts.generation != Some(record.generation) {
            *texts = Texts::load(&**store, record.generation).await?;
        }
        let indexed: Vec<RunIdx> = texts.finished.iter().flat_map(|segment| segment.runs.clone()).collect();
        for run in texts.next_run..record.num_runs {
            if !indexed.contains(&run) {
                texts.growing.insert(run, GrowingText::default());
            }
        }
        texts.next_run = record.num_runs;
        texts.catch_up(store, record.generation).await?;
        let growing = texts.growing.values().filter_map(|text| text.segment.clone());
        Ok(texts.finished.iter().cloned().chain(growing).collect())
    }
}

impl Texts {
    fn num_index_bytes(&self) -> usize {
        let growing = self.growing.values().filter_map(|text| text.segment.as_ref());
        self.finished.iter().chain(growing).map(|segment| segment.index.num_bytes()).sum()
    }

    /// The packed texts of a generation as one segment.
    async fn load(store: &dyn SiteStore, generation: Generation) -> Result<Self, AppError> {
        let entries = store.scan(&Key::all_packed_texts(generation), &[], usize::MAX).await?;
        let mut packed: BTreeMap<RunIdx, Vec<u8>> = BTreeMap::new();
        for (key, bytes) in &entries {
            let run = Key::run_of_packed_text(key)
                .ok_or_else(|| StorageError::Corrupt { what: "the key of a packed text".into() })?;
            packed.entry(run).or_default().extend(join_pieces([bytes], "a packed text")?);
        }
        let segment = on_blocking_thread(move || segment_of(packed)).await??;
        let finished = if segment.runs.is_empty() { Vec::new() } else { vec![Arc::new(segment)] };
        Ok(Self { generation: Some(generation), finished, ..Self::default() })
    }

    /// Brings growing texts up to what is stored, and moves finished ones to their place.
    async fn catch_up(&mut self, store: &Arc<dyn SiteStore>, generation: Generation) -> Result<(), AppError> {
        let reader = SiteReader::new(store.clone(), generation);
        let runs: Vec<RunIdx> = self.growing.keys().copied().collect();
        let keys: Vec<Vec<u8>> = runs.iter().map(|&run| Key::TextHead(generation, run).encode()).collect();
        let heads = store.multi_get(&keys).await?;
        for ((run, key), bytes) in runs.into_iter().zip(keys).zip(heads) {
            let Some(bytes) = bytes else { continue };
            let head: TextHead = codec::decode(&bytes, "the head of a text")?;
            let Some(text) = self.growing.get_mut(&run) else { continue };
            if text.num_words != head.num_words {
                text.grow(&reader, run, &head).await?;
            }
            if !head.is_finished {
                continue;
            }
            let packed = store_words(&text.lattice);
            let is_there = Precondition { key, expected: Some(bytes) };
            store_packed(&**store, &packed, (generation, run), is_there).await?;
            let segment = text.segment.take();
            self.growing.remove(&run);
            self.finished.extend(segment);
            merge_segments(&mut self.finished).await?;
        }
        Ok(())
    }
}

impl GrowingText {
    /// Reads the words that the text has gained and indexes it again.
    async fn grow(&mut self, reader: &SiteReader, run: RunIdx, head: &TextHead) -> Result<(), AppError> {
        // Words that came after the head was read are left for the next time, on all levels alike.
        let stored = reader.run(run).await?.at(head.clone());
        let words = stored.words_after(&self.num_words).await?;
        self.lattice.extend(&words).map_err(|error| StorageError::Corrupt { what: error.to_string() })?;
        self.num_words.clone_from(&head.num_words);
        let packed = store_words(&self.lattice);
        let segment = on_blocking_thread(move || segment_of(BTreeMap::from([(run, packed)]))).await??;
        self.segment = Some(Arc::new(segment));
        Ok(())
    }
}

/// Stores a finished text packed, unless its generation has gone meanwhile.
async fn store_packed(
    store: &dyn SiteStore,
    packed: &[u8],
    (generation, run): (Generation, RunIdx),
    is_there: Precondition,
) -> Result<(), AppError> {
    let mut batch = Batch::default();
    for (part, piece) in (0..).zip(pieces(packed)) {
        batch.put(Key::PackedText(generation, run, part).encode(), piece);
    }
    match store.commit(batch, vec![is_there]).await {
        Ok(()) | Err(StorageError::Conflict) => Ok(()),
        Err(error) => Err(error.into()),
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
