//! Scans between memory and storage: packed into chunks of a batch, the last of which carries the batch's receipt.

use locution_engine::geometry::Pose2;
use locution_engine::scan::{Scan, ScanGeometry};

use super::codec;
use super::keys::{Key, RunIdx};
use super::packed_ranges::{pack_ranges, unpack_ranges};
use super::series::{self, NUM_ITEMS_PER_CHUNK_MAX};
use super::stored::{Receipt, ScanChunk};
use crate::storage::{Batch, Reader, StorageError};

/// A chunk is closed when its readings take more bytes than this, well under the storage's value limit.
const CHUNK_BYTES_MAX: usize = 256 << 10;

/// Writes a batch of scans into a storage batch; the last chunk carries the receipt.
pub fn append_scans(batch: &mut Batch, run: RunIdx, first_sequence: u64, scans: &[Scan], receipt: Receipt) {
    let mut chunk = ScanChunk { stamps: Vec::new(), packed_ranges: Vec::new(), receipt: None };
    let mut chunk_first = first_sequence;
    for scan in scans {
        if chunk.stamps.len() == NUM_ITEMS_PER_CHUNK_MAX || chunk.packed_ranges.len() > CHUNK_BYTES_MAX {
            batch.put(Key::Scans(run, chunk_first).encode(), codec::encode(&chunk));
            chunk_first += chunk.stamps.len() as u64;
            chunk.stamps.clear();
            chunk.packed_ranges.clear();
        }
        chunk.stamps.push((scan.timestamp_ns, scan.odom_from_robot));
        pack_ranges(&scan.ranges_m, &mut chunk.packed_ranges);
    }
    chunk.receipt = Some((first_sequence, receipt));
    batch.put(Key::Scans(run, chunk_first).encode(), codec::encode(&chunk));
}

/// Reads the scans of a range of sequence numbers.
///
/// # Errors
/// Those of the storage; [`StorageError::Corrupt`] when a scan is missing or cannot be unpacked.
pub async fn read_scans(
    reader: &dyn Reader,
    run: RunIdx,
    geometry: &ScanGeometry,
    range: std::ops::Range<u64>,
) -> Result<Vec<Scan>, StorageError> {
    let mut scans = Vec::new();
    visit_chunks(reader, run, range.clone(), |first, chunk| {
        let unpacked = unpack(chunk, geometry.num_ranges)?;
        let wanted = (first..).zip(unpacked).filter(|(sequence, _)| range.contains(sequence));
        scans.extend(wanted.map(|(_, scan)| scan));
        Ok(())
    })
    .await?;
    Ok(scans)
}

/// The timestamps and odometry of a range of sequence numbers, without unpacking the readings.
///
/// # Errors
/// Those of the storage.
pub async fn read_stamps(
    reader: &dyn Reader,
    run: RunIdx,
    range: std::ops::Range<u64>,
) -> Result<Vec<(i64, Pose2)>, StorageError> {
    let mut stamps = Vec::new();
    visit_chunks(reader, run, range.clone(), |first, chunk| {
        let wanted = (first..).zip(chunk.stamps).filter(|(sequence, _)| range.contains(sequence));
        stamps.extend(wanted.map(|(_, stamp)| stamp));
        Ok(())
    })
    .await?;
    Ok(stamps)
}

/// What the batch that began and ended with these numbers was answered, when there was such a batch.
///
/// # Errors
/// Those of the storage.
pub async fn find_receipt(
    reader: &dyn Reader,
    run: RunIdx,
    range: std::ops::Range<u64>,
) -> Result<Option<Receipt>, StorageError> {
    let mut found = None;
    visit_chunks(reader, run, range.end - 1..range.end, |first, chunk| {
        let end = first + chunk.stamps.len() as u64;
        if let Some((batch_first, receipt)) = chunk.receipt
            && batch_first == range.start
            && end == range.end
        {
            found = Some(receipt);
        }
        Ok(())
    })
    .await?;
    Ok(found)
}

async fn visit_chunks(
    reader: &dyn Reader,
    run: RunIdx,
    range: std::ops::Range<u64>,
    mut visit: impl FnMut(u64, ScanChunk) -> Result<(), StorageError>,
) -> Result<(), StorageError> {
    let key = |first| Key::Scans(run, first);
    series::for_each_chunk(reader, &Key::all_scans(run), key, range, |first, bytes| {
        let chunk: ScanChunk = codec::decode(bytes, "a chunk of scans")?;
        let num_scans = chunk.stamps.len() as u64;
        visit(first, chunk)?;
        Ok(num_scans)
    })
    .await
}

fn unpack(chunk: ScanChunk, num_ranges: usize) -> Result<Vec<Scan>, StorageError> {
    let mut packed = chunk.packed_ranges.as_slice();
    let corrupt = || StorageError::Corrupt { what: "the readings of a scan".into() };
    let unpack_one = |(timestamp_ns, odom_from_robot)| {
        let ranges_m = unpack_ranges(&mut packed, num_ranges).ok_or_else(corrupt)?;
        Ok(Scan { timestamp_ns, odom_from_robot, ranges_m })
    };
    chunk.stamps.into_iter().map(unpack_one).collect()
}

/// Whether two scans are the same recording; readings without a return are equal to one another.
pub fn is_same_scan(a: &Scan, b: &Scan) -> bool {
    a.timestamp_ns == b.timestamp_ns
        && a.odom_from_robot == b.odom_from_robot
        && a.ranges_m.len() == b.ranges_m.len()
        && a.ranges_m.iter().zip(&b.ranges_m).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}
