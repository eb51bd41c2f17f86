//! A site as one stream of bytes: consistent, checked, and independent of the back end that it comes from or goes to.
//!
//! ```text
//! "LOCUTION BACKUP 1\n"   then blocks, every one closed by a checksum:
//! kind u8 │ number of bytes u32 │ bytes │ crc32 of all of it u32          numbers are little endian
//!   'H'  JSON with the site's name and the version that wrote it
//!   'D'  pairs in the order of their keys: key bytes u32 │ value bytes u32 │ key │ value
//!   'E'  number of pairs u64 │ sum of their checksums u64
//! ```
//!
//! Keys and values stand as they are stored; every value names its layout, so whatever version can read a site can
//! restore a backup of it. A stream without its last block is not a backup.

use std::sync::Arc;

use bytes::{Buf, Bytes, BytesMut};
use futures::Stream;
use futures::stream;

use super::content::Content;
use super::{Batch, Entry, Precondition, Reader, SiteStore, StorageError};

const MAGIC: &[u8] = b"LOCUTION BACKUP 1\n";
const HEADER: u8 = b'H';
const DATA: u8 = b'D';
const END: u8 = b'E';
const FRAME_BYTES: usize = 1 + 4 + 4;
/// No block is larger, so that whoever reads one knows what to make room for.
const BLOCK_BYTES_MAX: usize = 8 << 20;
const BLOCK_BYTES: usize = 1 << 20;
const NUM_PAIRS_PER_READ: usize = 64;
const COMMIT_BYTES: usize = 4 << 20;

/// The backup of what a snapshot holds.
pub fn export(
    snapshot: Arc<dyn Reader>,
    site: &str,
) -> impl Stream<Item = Result<Bytes, StorageError>> + Send + use<> {
    let header = serde_json::json!({"site": site, "version": env!("CARGO_PKG_VERSION")}).to_string();
    let begin =
        Export { snapshot, from: Some(Vec::new()), header: Some(header), content: Content::default() };
    stream::try_unfold(Some(begin), async |export| match export {
        Some(export) => export.next().await.map(Some),
        None => Ok(None),
    })
}

struct Export {
    snapshot: Arc<dyn Reader>,
    // None once everything was read.
    from: Option<Vec<u8>>,
    header: Option<String>,
    content: Content,
}

impl Export {
    /// The next bytes, and what is left to do after them.
    async fn next(mut self) -> Result<(Bytes, Option<Self>), StorageError> {
        let mut bytes = BytesMut::new();
        if let Some(header) = self.header.take() {
            bytes.extend_from_slice(MAGIC);
            append_block(&mut bytes, HEADER, header.as_bytes());
        }
        let Some(from) = self.from.take() else {
            let totals = [self.content.num_pairs.to_le_bytes(), self.content.sum.to_le_bytes()].concat();
            append_block(&mut bytes, END, &totals);
            return Ok((bytes.freeze(), None));
        };
        let entries = self.snapshot.scan(b"", &from, NUM_PAIRS_PER_READ).await?;
        self.from = entries.last().map(|(key, _)| [&key[..], &[0]].concat());
        let mut block = Vec::new();
        for (key, value) in &entries {
            self.content.add(key, value);
            block.extend((key.len() as u32).to_le_bytes());
            block.extend((value.len() as u32).to_le_bytes());
            block.extend_from_slice(key);
            block.extend_from_slice(value);
            if block.len() > BLOCK_BYTES {
                append_block(&mut bytes, DATA, &std::mem::take(&mut block));
            }
        }
        if !block.is_empty() {
            append_block(&mut bytes, DATA, &block);
        }
        Ok((bytes.freeze(), Some(self)))
    }
}

fn append_block(bytes: &mut BytesMut, kind: u8, block: &[u8]) {
    let start = bytes.len();
    bytes.extend_from_slice(&[kind]);
    bytes.extend_from_slice(&(block.len() as u32).to_le_bytes());
    bytes.extend_from_slice(block);
    let crc = crc32fast::hash(&bytes[start..]);
    bytes.extend_from_slice(&crc.to_le_bytes());
}

/// Why a stream could not be restored.
#[derive(Debug, thiserror::Error)]
pub enum RestoreError {
    /// The bytes are not a whole backup.
    #[error("not a whole backup: {0}")]
    Malformed(String),
    /// The storage refused.
    #[error(transparent)]
    Storage(#[from] StorageError),
}

/// Writes a backup into an empty site, piece by piece.
///
/// The pair with the lowest key is written last: until everything before was checked the site has no record of itself.
pub struct Restore {
    store: Arc<dyn SiteStore>,
    pending: BytesMut,
    has_magic: bool,
    has_header: bool,
    first: Option<Entry>,
    batch: Batch,
    content: Content,
    is_complete: bool,
}

impl Restore {
    /// Begins in a site that holds nothing.
    pub fn into_site(store: Arc<dyn SiteStore>) -> Self {
        Self {
            store,
            pending: BytesMut::new(),
            has_magic: false,
            has_header: false,
            first: None,
            batch: Batch::default(),
            content: Content::default(),
            is_complete: false,
        }
    }

    /// Takes the next bytes of the stream.
    ///
    /// # Errors
    /// [`RestoreError::Malformed`] for bytes that no backup has there.
    pub async fn push(&mut self, bytes: &[u8]) -> Result<(), RestoreError> {
        self.pending.extend_from_slice(bytes);
        if !self.has_magic {
            if self.pending.len() < MAGIC.len() {
                return Ok(());
            }
            if !self.pending.starts_with(MAGIC) {
                return Err(malformed("it does not begin as one"));
            }
            self.pending.advance(MAGIC.len());
            self.has_magic = true;
        }
        while let Some((kind, block)) = self.next_block()? {
            self.take_block(kind, &block).await?;
        }
        Ok(())
    }

    /// Checks that everything came and writes the last pair, as `adopt` changes its value.
    ///
    /// # Errors
    /// [`RestoreError::Malformed`] when the stream ended early, and those of `adopt`.
    pub async fn finish(
        mut self,
        adopt: impl FnOnce(&[u8]) -> Result<Bytes, StorageError>,
    ) -> Result<(), RestoreError> {
        if !self.is_complete || !self.pending.is_empty() {
            return Err(malformed("it ends early"));
        }
        let (key, value) = self.first.take().ok_or_else(|| malformed("it holds nothing"))?;
        let absent = Precondition { key: key.to_vec(), expected: None };
        self.batch.put(key.to_vec(), adopt(&value)?);
        Ok(self.store.commit(self.batch, vec![absent]).await?)
    }

    fn next_block(&mut self) -> Result<Option<(u8, Bytes)>, RestoreError> {
        let Some((head, _)) = self.pending.split_first_chunk::<5>() else { return Ok(None) };
        let num_bytes = u32::from_le_bytes([head[1], head[2], head[3], head[4]]) as usize;
        let kind = head[0];
        if num_bytes > BLOCK_BYTES_MAX || (!self.has_header && kind != HEADER) || self.is_complete {
            return Err(malformed("a block that does not belong there"));
        }
        if self.pending.len() < FRAME_BYTES + num_bytes {
            return Ok(None);
        }
        let frame = self.pending.split_to(FRAME_BYTES + num_bytes).freeze();
        let (body, crc) = frame.split_at(frame.len() - 4);
        if crc32fast::hash(body).to_le_bytes() != crc {
            return Err(malformed("a checksum does not match"));
        }
        Ok(Some((kind, frame.slice(5..5 + num_bytes))))
    }

    async fn take_block(&mut self, kind: u8, block: &Bytes) -> Result<(), RestoreError> {
        match kind {
            HEADER => self.has_header = true,
            DATA => self.take_pairs(block.clone()).await?,
            END => {
                let totals = [self.content.num_pairs.to_le_bytes(), self.content.sum.to_le_bytes()].concat();
                if block[..] != totals[..] {
                    return Err(malformed("its pairs do not add up"));
                }
                self.is_complete = true;
            }
            _ => return Err(malformed("a block of an unknown kind")),
        }
        Ok(())
    }

    async fn take_pairs(&mut self, mut block: Bytes) -> Result<(), RestoreError> {
        while !block.is_empty() {
            let cut = || malformed("a pair that is cut off");
            let key_bytes = block.try_get_u32_le().map_err(|_| cut())? as usize;
            let value_bytes = block.try_get_u32_le().map_err(|_| cut())? as usize;
            if block.len() < key_bytes.saturating_add(value_bytes) {
                return Err(cut());
            }
            let (key, value) = (block.split_to(key_bytes), block.split_to(value_bytes));
            self.content.add(&key, &value);
            if self.first.is_none() {
                self.first = Some((key, value));
                continue;
            }
            self.batch.put(key.to_vec(), value);
            if self.batch.num_value_bytes() > COMMIT_BYTES {
                self.store.commit(std::mem::take(&mut self.batch), vec![]).await?;
            }
        }
        Ok(())
    }
}

fn malformed(problem: &str) -> RestoreError {
    RestoreError::Malformed(problem.to_owned())
}

#[cfg(test)]
mod tests {
    use futures::TryStreamExt;

    use super::super::{MemoryStorage, Storage};
    use super::*;

    async fn filled() -> Arc<dyn SiteStore> {
        let site = MemoryStorage::default().open("a").await.unwrap();
        for number in 0..300u32 {
            let mut batch = Batch::default();
            batch.put(number.to_be_bytes().to_vec(), vec![number as u8; number as usize * 90]);
            site.commit(batch, vec![]).await.unwrap();
        }
        site
    }

    async fn bytes_of(site: &Arc<dyn SiteStore>) -> Vec<u8> {
        let pieces: Vec<Bytes> = export(site.snapshot().await.unwrap(), "a").try_collect().await.unwrap();
        pieces.concat()
    }

    async fn restored(bytes: &[u8], piece: usize) -> Result<Arc<dyn SiteStore>, RestoreError> {
        let site = MemoryStorage::default().open("b").await?;
        let mut restore = Restore::into_site(Arc::clone(&site));
        for piece in bytes.chunks(piece) {
            restore.push(piece).await?;
        }
        restore.finish(|value| Ok(Bytes::copy_from_slice(value))).await?;
        Ok(site)
    }

    #[tokio::test]
    async fn what_was_backed_up_comes_back_however_it_is_cut() {
        let site = filled().await;
        let bytes = bytes_of(&site).await;
        for piece in [1_000, 65_536, bytes.len()] {
            let again = restored(&bytes, piece).await.unwrap();
            let all = site.scan(b"", b"", usize::MAX).await.unwrap();
            assert_eq!(again.scan(b"", b"", usize::MAX).await.unwrap(), all);
        }
    }

    #[tokio::test]
    async fn a_backup_is_of_one_moment() {
        let site = filled().await;
        let snapshot = site.snapshot().await.unwrap();
        let mut batch = Batch::default();
        batch.put(vec![0xff], vec![1]);
        site.commit(batch, vec![]).await.unwrap();
        let pieces: Vec<Bytes> = export(snapshot, "a").try_collect().await.unwrap();
        let again = restored(&pieces.concat(), 9_999).await.unwrap();
        assert_eq!(again.get(&[0xff]).await.unwrap(), None);
    }

    #[tokio::test]
    async fn cut_or_damaged_backups_are_refused_and_leave_no_site_record() {
        let site = filled().await;
        let bytes = bytes_of(&site).await;
        for end in [0, 10, 30, bytes.len() / 2, bytes.len() - 1] {
            assert!(matches!(restored(&bytes[..end], 4_096).await, Err(RestoreError::Malformed(_))), "{end}");
        }
        for at in (0..bytes.len()).step_by(bytes.len() / 40) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(matches!(restored(&damaged, 4_096).await, Err(RestoreError::Malformed(_))), "{at}");
        }
    }
}
