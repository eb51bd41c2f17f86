//! Reading sled's files without sled and without changing a byte of them, to say what sled would make of them.
//!
//! ```text
//! db     segment │ segment │ …      each: header (lsn, stable lsn), messages with checksums, a cap
//! blobs/ LSN                        values too large for a segment
//! snap.LSN                          where every page stood at that lsn; only what follows is read again at opening
//! ```
//!
//! At opening sled puts the segments in the order of their lsn, reads on from the snapshot while they join up, and
//! takes the first message that is not whole for the torn end of the log. Whether it is, only the ledger can tell: the
//! record of the last acknowledged commit must stand before that end. The layout is that of sled 0.34, which is pinned.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::content::Content;

const SEGMENT_HEADER_BYTES: usize = 20;
/// No message begins in the last bytes of a segment.
const MESSAGE_HEADER_BYTES_MAX: usize = 32;
const LSN_MASK: u64 = 0x7fff_ffff_ffff_ffff;

const KIND_CORRUPTED: u8 = 0;
const KIND_CANCELED: u8 = 1;
const KIND_CAP: u8 = 2;
const KIND_BATCH_MANIFEST: u8 = 3;
const KINDS_OF_BLOBS: [u8; 3] = [7, 9, 11];
const KIND_MAX: u8 = 11;

/// What sled would make of a database.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It holds every acknowledged commit, as far as can be told without opening it.
    Sound,
    /// Something in it is not whole that need not be: open a copy first.
    Suspicious,
}

/// Says whether sled would keep all acknowledged commits of a site; their number is none when there is no ledger.
///
/// # Errors
/// What is damaged, in words.
pub(super) fn inspect(site: &Path, num_acknowledged: Option<u64>) -> Result<Verdict, String> {
    remove_half_made_snapshots(site).map_err(|error| error.to_string())?;
    let log = Log::open(site)?;
    let walk = log.walk()?;
    let found = match walk.num_commits {
        Some(newest) if Some(newest) >= num_acknowledged => Some(newest),
        newest => newest.max(log.commits_elsewhere(num_acknowledged)?),
    };
    match num_acknowledged {
        None if found.is_some() => return Err("its ledger is missing".into()),
        // A site of format 1 whose ledger was just made has no record yet.
        Some(wanted) if wanted > 0 && found < num_acknowledged => {
            let end = walk.end;
            return Err(format!(
                "its database ends at {end}, before commit {wanted}, which was acknowledged; nothing was written"
            ));
        }
        _ => {}
    }
    Ok(if walk.is_suspicious { Verdict::Suspicious } else { Verdict::Sound })
}

/// A snapshot that a crash left half made would be taken for a damaged one.
fn remove_half_made_snapshots(site: &Path) -> io::Result<()> {
    for entry in fs::read_dir(site)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with("snap.") && name.ends_with(".generating") {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Every damaged place of a site's files, in words; those of free parts left out where they can be told.
pub(super) fn damages(site: &Path) -> Vec<String> {
    let log = match Log::open(site) {
        Ok(log) => log,
        Err(problem) => return vec![problem],
    };
    log.damages().unwrap_or_else(|problem| vec![problem])
}

/// Whether sled would stumble over a snapshot that it can do without.
pub(super) fn is_snapshot_damaged(site: &Path) -> bool {
    newest_snapshot(site).is_err()
}

/// Whether the file of parameters cannot be read.
pub(super) fn is_conf_damaged(site: &Path) -> bool {
    segment_bytes(site).is_err()
}

/// The files of a closed database.
struct Log {
    site: PathBuf,
    segment_bytes: usize,
    num_bytes: u64,
    /// From where on sled reads again.
    snapshot_lsn: i64,
    /// Header of every segment of the file, in its order.
    headers: Vec<Header>,
}

#[derive(Clone, Copy, Debug)]
struct Header {
    lsn: i64,
    stable_lsn: i64,
    is_whole: bool,
    is_blank: bool,
}

/// What reading on from the snapshot brought.
struct Walk {
    num_commits: Option<u64>,
    is_suspicious: bool,
    end: String,
}

/// One whole message of a segment.
struct Message<'a> {
    kind: u8,
    body: &'a [u8],
    /// Where the next begins in the segment.
    next: usize,
}

impl Log {
    fn open(site: &Path) -> Result<Self, String> {
        let segment_bytes = segment_bytes(site)?;
        let mut file = File::open(site.join("db")).map_err(|error| format!("the file db: {error}"))?;
        let num_bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let mut headers = Vec::new();
        let mut at = 0;
        while at + SEGMENT_HEADER_BYTES as u64 <= num_bytes {
            headers.push(
                Header::read(&mut file, at).map_err(|error| format!("the file db at byte {at}: {error}"))?,
            );
            at += segment_bytes as u64;
        }
        let snapshot_lsn = newest_snapshot(site)?;
        Ok(Self { site: site.to_owned(), segment_bytes, num_bytes, snapshot_lsn, headers })
    }

    fn segment(&self, idx: usize) -> Result<Vec<u8>, String> {
        let at = (idx * self.segment_bytes) as u64;
        let num_bytes = (self.num_bytes - at).min(self.segment_bytes as u64);
        let mut bytes = Vec::new();
        let read = File::open(self.site.join("db")).and_then(|mut file| {
            file.seek(SeekFrom::Start(at))?;
            file.take(num_bytes).read_to_end(&mut bytes)
        });
        read.map_err(|error| format!("the file db at byte {at}: {error}"))?;
        Ok(bytes)
    }

    /// Reads on from the snapshot as sled does.
    fn walk(&self) -> Result<Walk, String> {
        let size = self.segment_bytes as i64;
        let first = self.snapshot_lsn / size * size;
        let mut order = BTreeMap::new();
        let mut stable_lsn = first;
        let mut is_suspicious = false;
        for (idx, header) in self.headers.iter().enumerate() {
            is_suspicious |= !header.is_whole && !header.is_blank;
            if !header.is_whole || header.lsn < first {
                continue;
            }
            stable_lsn = stable_lsn.max(header.stable_lsn);
            if order.insert(header.lsn, idx).is_some() {
                return Err(format!("two segments of the file db claim lsn {}", header.lsn));
            }
        }
        let end = self.end_of_tail(&order, stable_lsn / size * size)?;
        let mut walk = Walk { num_commits: None, is_suspicious, end: format!("lsn {end}") };
        for (lsn, idx) in order {
            if lsn > end {
                break;
            }
            let bytes = self.segment(idx)?;
            let mut at = SEGMENT_HEADER_BYTES;
            let mut is_closed = false;
            while let Some(message) = self.message(&bytes, at, lsn) {
                if lsn + at as i64 > end {
                    break;
                }
                if message.kind == KIND_CAP {
                    is_closed = true;
                    break;
                }
                if message.kind == KIND_BATCH_MANIFEST && last_of_batch(&message) > end {
                    return Ok(walk);
                }
                walk.num_commits = walk.num_commits.max(self.commits_in(&message));
                walk.is_suspicious |= self.is_blob_missing(&message);
                at = message.next;
            }
            let is_full = at + MESSAGE_HEADER_BYTES_MAX >= self.segment_bytes;
            walk.is_suspicious |= !is_closed && !is_full && lsn + size <= end;
        }
        Ok(walk)
    }

    /// The last byte of the last message that joins up, in the log's own count.
    fn end_of_tail(&self, order: &BTreeMap<i64, usize>, lowest: i64) -> Result<i64, String> {
        let mut end = -1;
        let mut expected = lowest.max(0);
        for (lsn, idx) in order.range(lowest..) {
            if *lsn != expected {
                break;
            }
            expected += self.segment_bytes as i64;
            let bytes = self.segment(*idx)?;
            let mut at = SEGMENT_HEADER_BYTES;
            let mut is_closed = false;
            while let Some(message) = self.message(&bytes, at, *lsn) {
                if message.kind == KIND_CAP {
                    is_closed = true;
                    break;
                }
                // sled stumbles over a blob that is there and not whole; one that is gone it passes over.
                if self.is_blob_missing(&message)
                    && self.blob_path(&message).is_some_and(|path| path.exists())
                {
                    break;
                }
                at = message.next;
            }
            end = lsn + at as i64 - 1;
            if !is_closed && at + MESSAGE_HEADER_BYTES_MAX < self.segment_bytes {
                break;
            }
        }
        Ok(end)
    }

    /// The whole message at a place of a segment; `None` at the end or where it is damaged.
    fn message<'a>(&self, segment: &'a [u8], at: usize, lsn: i64) -> Option<Message<'a>> {
        if at + MESSAGE_HEADER_BYTES_MAX > self.segment_bytes {
            return None;
        }
        let mut cursor = segment.get(at..)?;
        let crc = u32::from_le_bytes(*take(&mut cursor, 4)?.first_chunk()?);
        let kind = take(&mut cursor, 1)?[0];
        let num_body_bytes = usize::try_from(take_varint(&mut cursor)?).ok()?;
        let segment_number = take_varint(&mut cursor)?;
        let _page = take_varint(&mut cursor)?;
        let header_end = segment.len() - cursor.len();
        let body = take(&mut cursor, num_body_bytes)?;
        let next = header_end + num_body_bytes;
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(body);
        hasher.update(&segment[at + 4..header_end]);
        let is_whole = hasher.finalize() ^ u32::MAX == crc
            && kind != KIND_CORRUPTED
            && kind <= KIND_MAX
            && next <= self.segment_bytes
            && segment_number == lsn as u64 / self.segment_bytes as u64;
        is_whole.then_some(Message { kind, body, next })
    }

    /// The highest number of a commit that is recorded in a message or in the blob that it names.
    fn commits_in(&self, message: &Message<'_>) -> Option<u64> {
        if message.kind == KIND_CANCELED {
            return None;
        }
        let newest = |bytes: &[u8]| Content::find_all(bytes).map(|content| content.num_commits).max();
        if KINDS_OF_BLOBS.contains(&message.kind) {
            return newest(&read_blob(&self.blob_path(message)?)?);
        }
        newest(message.body)
    }

    /// Whether a message names a blob that is not there whole; it may since have been replaced.
    fn is_blob_missing(&self, message: &Message<'_>) -> bool {
        KINDS_OF_BLOBS.contains(&message.kind)
            && self.blob_path(message).and_then(|path| read_blob(&path)).is_none()
    }

    /// The file that a message about a blob names.
    fn blob_path(&self, message: &Message<'_>) -> Option<PathBuf> {
        let id = i64::from_le_bytes(*message.body.first_chunk()?);
        Some(self.site.join("blobs").join(id.to_string()))
    }

    /// The highest number of a commit before the snapshot, the newest segments first, no further than needed.
    fn commits_elsewhere(&self, wanted: Option<u64>) -> Result<Option<u64>, String> {
        let mut order: Vec<_> =
            self.headers.iter().enumerate().filter(|(_, header)| header.is_whole).collect();
        order.sort_by_key(|(_, header)| std::cmp::Reverse(header.lsn));
        let mut highest = None;
        for (idx, header) in order {
            let bytes = self.segment(idx)?;
            let mut at = SEGMENT_HEADER_BYTES;
            while let Some(message) = self.message(&bytes, at, header.lsn) {
                if header.lsn + at as i64 >= self.snapshot_lsn {
                    break;
                }
                highest = highest.max(self.commits_in(&message));
                at = message.next;
            }
            if highest.is_some() && highest >= wanted {
                break;
            }
        }
        Ok(highest)
    }

    /// Every segment that ends before its end, every blob that is not whole.
    fn damages(&self) -> Result<Vec<String>, String> {
        let mut found = Vec::new();
        let last = self.headers.iter().filter(|header| header.is_whole).map(|header| header.lsn).max();
        for (idx, header) in self.headers.iter().enumerate() {
            let offset = idx * self.segment_bytes;
            if !header.is_whole {
                if !header.is_blank {
                    found.push(format!("db at byte {offset}: the header of a segment is damaged"));
                }
                continue;
            }
            let bytes = self.segment(idx)?;
            let mut at = SEGMENT_HEADER_BYTES;
            let mut is_closed = false;
            while let Some(message) = self.message(&bytes, at, header.lsn) {
                is_closed = message.kind == KIND_CAP;
                if is_closed {
                    break;
                }
                at = message.next;
            }
            let is_full = at + MESSAGE_HEADER_BYTES_MAX >= self.segment_bytes;
            let is_blank_from_here = bytes[at.min(bytes.len())..].iter().all(|byte| *byte == 0);
            let is_tip = Some(header.lsn) == last && is_blank_from_here;
            if !is_closed && !is_full && !is_tip {
                found.push(format!("db at byte {}: a message is damaged", offset + at));
            }
        }
        for entry in fs::read_dir(self.site.join("blobs")).map_err(|error| error.to_string())? {
            let path = entry.map_err(|error| error.to_string())?.path();
            if read_blob(&path).is_none() {
                found.push(format!(
                    "blobs/{}: damaged",
                    path.file_name().unwrap_or_default().to_string_lossy()
                ));
            }
        }
        Ok(found)
    }
}

impl Header {
    fn read(file: &mut File, at: u64) -> io::Result<Self> {
        let mut bytes = [0; SEGMENT_HEADER_BYTES];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut bytes)?;
        let number = |range: std::ops::Range<usize>| {
            let bytes = bytes[range].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
            (bytes ^ LSN_MASK) as i64
        };
        let crc = bytes.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        Ok(Self {
            lsn: number(4..12),
            stable_lsn: number(12..20),
            is_whole: crc32fast::hash(&bytes[4..]) == crc ^ u32::MAX,
            is_blank: bytes.iter().all(|byte| *byte == 0),
        })
    }
}

/// The size of a segment, from the file that holds sled's parameters and a checksum of them.
fn segment_bytes(site: &Path) -> Result<usize, String> {
    let conf = fs::read(site.join("conf")).map_err(|error| format!("the file conf: {error}"))?;
    let (text, crc) = conf.split_last_chunk::<4>().ok_or("the file conf is too short")?;
    if crc32fast::hash(text) != u32::from_le_bytes(*crc) {
        return Err("the file conf is damaged".into());
    }
    String::from_utf8_lossy(text)
        .lines()
        .find_map(|line| line.strip_prefix("segment_size: ")?.parse().ok())
        .filter(|bytes: &usize| bytes.is_power_of_two() && *bytes >= 256 && *bytes <= 1 << 24)
        .ok_or_else(|| "the file conf names no segment size".into())
}

/// The lsn of the snapshot that sled would take, 0 without one.
fn newest_snapshot(site: &Path) -> Result<i64, String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(site).map_err(|error| error.to_string())? {
        let name = entry.map_err(|error| error.to_string())?.file_name().to_string_lossy().into_owned();
        if name.starts_with("snap.") && !name.ends_with(".in___motion") {
            names.push(name);
        }
    }
    let Some(name) = names.into_iter().max() else { return Ok(0) };
    let damaged = || format!("the file {name} is damaged");
    let bytes = fs::read(site.join(&name)).map_err(|error| format!("the file {name}: {error}"))?;
    let (body, crc) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
    let body = body.len().checked_sub(8).map(|len| &body[..len]).ok_or_else(damaged)?;
    if crc32fast::hash(body) != u32::from_le_bytes(*crc) {
        return Err(damaged());
    }
    i64::from_str_radix(&name["snap.".len()..], 16).map_err(|_| damaged())
}

/// The value in a blob file when it is whole.
fn read_blob(path: &Path) -> Option<Vec<u8>> {
    let bytes = fs::read(path).ok()?;
    let (crc, body) = bytes.split_first_chunk::<4>()?;
    (crc32fast::hash(body) == u32::from_le_bytes(*crc)).then(|| body.to_vec())
}

fn last_of_batch(message: &Message<'_>) -> i64 {
    message.body.first_chunk().map_or(i64::MAX, |bytes| i64::from_le_bytes(*bytes))
}

fn take<'a>(cursor: &mut &'a [u8], num_bytes: usize) -> Option<&'a [u8]> {
    let (taken, rest) = cursor.split_at_checked(num_bytes)?;
    *cursor = rest;
    Some(taken)
}

/// sled's numbers of one to nine bytes.
fn take_varint(cursor: &mut &[u8]) -> Option<u64> {
    let first = take(cursor, 1)?[0];
    Some(match first {
        0..=240 => u64::from(first),
        241..=248 => 240 + 256 * (u64::from(first) - 241) + u64::from(take(cursor, 1)?[0]),
        249 => {
            let bytes = take(cursor, 2)?;
            2288 + 256 * u64::from(bytes[0]) + u64::from(bytes[1])
        }
        _ => {
            let mut bytes = [0; 8];
            let num_bytes = usize::from(first) - 247;
            bytes[..num_bytes].copy_from_slice(take(cursor, num_bytes)?);
            u64::from_le_bytes(bytes)
        }
    })
}
