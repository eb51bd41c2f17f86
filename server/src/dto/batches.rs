//! Scans on the wire, both ways.

use std::fmt;

use locution_engine::scan::Scan;
use serde::de::{SeqAccess, Unexpected, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::ToSchema;

use super::common::PoseDto;
use crate::app::runs::NewBatch;
use crate::error::ApiError;
use crate::records::Receipt;

/// Readings in metres; one without a return is null in JSON, null, NaN or ∞ in CBOR, and NaN here.
///
/// CBOR may also carry them as one byte string of 32-bit floats, little endian, which is the quickest to read.
#[derive(Clone, Debug, Default, PartialEq, ToSchema)]
#[schema(value_type = Vec<Option<f32>>, example = json!([2.31, 2.29, null]))]
pub struct RangesDto(pub Vec<f32>);

impl Serialize for RangesDto {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut sequence = serializer.serialize_seq(Some(self.0.len()))?;
        for range_m in &self.0 {
            sequence.serialize_element(&range_m.is_finite().then_some(range_m))?;
        }
        sequence.end()
    }
}

impl<'de> Deserialize<'de> for RangesDto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RangesVisitor)
    }
}

struct RangesVisitor;

impl<'de> Visitor<'de> for RangesVisitor {
    type Value = RangesDto;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of metres or null")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<RangesDto, A::Error> {
        // The hint comes from the client, so it is not trusted with memory.
        let mut ranges_m = Vec::with_capacity(sequence.size_hint().unwrap_or(0).clamp(192, 2_048));
        while let Some(RangeDto(range_m)) = sequence.next_element()? {
            ranges_m.push(range_m);
        }
        Ok(RangesDto(ranges_m))
    }

    fn visit_bytes<E: serde::de::Error>(self, bytes: &[u8]) -> Result<RangesDto, E> {
        floats_of(bytes)
    }
}

/// Floats out of a byte string.
fn floats_of<E: serde::de::Error>(bytes: &[u8]) -> Result<RangesDto, E> {
    let (floats, rest) = bytes.as_chunks();
    if !rest.is_empty() {
        return Err(E::invalid_length(bytes.len(), &"four bytes for each reading"));
    }
    Ok(RangesDto(floats.iter().map(|four| f32::from_le_bytes(*four)).collect()))
}

/// One reading, in whatever way the format spells numbers.
struct RangeDto(f32);

impl<'de> Deserialize<'de> for RangeDto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RangeVisitor)
    }
}

struct RangeVisitor;

impl<'de> Visitor<'de> for RangeVisitor {
    type Value = RangeDto;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("metres or null")
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<RangeDto, E> {
        Ok(RangeDto(value as f32))
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<RangeDto, E> {
        Ok(RangeDto(value as f32))
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<RangeDto, E> {
        Ok(RangeDto(value as f32))
    }

    fn visit_unit<E: serde::de::Error>(self) -> Result<RangeDto, E> {
        Ok(RangeDto(f32::NAN))
    }

    fn visit_none<E: serde::de::Error>(self) -> Result<RangeDto, E> {
        Ok(RangeDto(f32::NAN))
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<RangeDto, D::Error> {
        RangeDto::deserialize(deserializer)
    }

    fn visit_str<E: serde::de::Error>(self, value: &str) -> Result<RangeDto, E> {
        Err(E::invalid_type(Unexpected::Str(value), &self))
    }
}

/// One sweep with the odometry at its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanDto {
    /// As the robot's clock said, nanoseconds; stored and served, never used to sort.
    #[schema(example = 1763800000000000000i64)]
    pub timestamp_ns: i64,
    /// Raw odometry of the robot.
    pub odom_from_robot: PoseDto,
    /// Readings in metres, in the order of the geometry's beams.
    pub ranges_m: RangesDto,
}

impl ScanDto {
    /// The engine's scan.
    ///
    /// # Errors
    /// 422 naming the scan, the field and the reading.
    pub fn check(self, scan_idx: usize) -> Result<Scan, ApiError> {
        let odom_from_robot = self.odom_from_robot.check().map_err(|(name, problem)| {
            let detail = format!("the odometry of scan {scan_idx} cannot be: {problem}");
            ApiError::invalid_scan(format!("scans[{scan_idx}].odom_from_robot.{name}"), detail)
        })?;
        let negative = self.ranges_m.0.iter().position(|range_m| *range_m < 0.0);
        if let Some(range_idx) = negative {
            let range_m = self.ranges_m.0[range_idx];
            let detail =
                format!("range {range_idx} of scan {scan_idx} is {range_m} m; ranges are not negative");
            return Err(ApiError::invalid_scan(format!("scans[{scan_idx}].ranges_m[{range_idx}]"), detail));
        }
        Ok(Scan { timestamp_ns: self.timestamp_ns, odom_from_robot, ranges_m: self.ranges_m.0 })
    }
}

/// Scans to append to a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BatchDto {
    /// Sequence number of the first scan; the first scan of a run has 0.
    #[schema(example = 0)]
    pub first_sequence: u64,
    /// In order.
    pub scans: Vec<ScanDto>,
}

impl TryFrom<BatchDto> for NewBatch {
    type Error = ApiError;

    fn try_from(batch: BatchDto) -> Result<Self, ApiError> {
        let scans = batch.scans.into_iter().enumerate().map(|(idx, scan)| scan.check(idx));
        Ok(Self { first_sequence: batch.first_sequence, scans: scans.collect::<Result<_, _>>()? })
    }
}

/// The answer to an accepted batch, also when it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReceiptDto {
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Observations of the run after this batch.
    pub num_observations: u64,
    /// Words of all levels of the run after this batch.
    pub num_words: u64,
}

impl From<Receipt> for ReceiptDto {
    fn from(receipt: Receipt) -> Self {
        Self {
            next_sequence: receipt.next_sequence,
            num_observations: receipt.num_observations,
            num_words: receipt.num_words,
        }
    }
}

/// A stored scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StoredScanDto {
    /// Sequence number.
    pub scan_seq: u64,
    /// As sent.
    pub timestamp_ns: i64,
    /// As sent.
    pub odom_from_robot: PoseDto,
    /// As sent; readings without a return are null.
    pub ranges_m: RangesDto,
}

impl StoredScanDto {
    /// A scan with its number.
    pub fn new(scan_seq: u64, scan: Scan) -> Self {
        Self {
            scan_seq,
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot.into(),
            ranges_m: RangesDto(scan.ranges_m),
        }
    }
}
