//! Readings of a scan on the wire: lists in JSON, lists or arrays of bytes in CBOR.

use std::fmt;

use serde::de::{EnumAccess, IgnoredAny, SeqAccess, Unexpected, VariantAccess, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::ToSchema;

/// Readings in metres; one without a return is null in JSON, null, NaN or ∞ in CBOR, and NaN here.
///
/// CBOR may also carry them as a typed array of RFC 8746 (tags 81, 82, 85, 86), or as one byte string of 32-bit floats,
/// little endian, which is the quickest to read.
#[derive(Clone, Debug, Default, PartialEq, ToSchema)]
#[schema(value_type = Vec<Option<f32>>, example = json!([2.31, 2.29, null]), minimum = 0, max_items = 8_192)]
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
        floats_of(FLOAT32_LITTLE_ENDIAN, bytes)
    }

    /// A tagged value of CBOR.
    fn visit_enum<A: EnumAccess<'de>>(self, tagged: A) -> Result<RangesDto, A::Error> {
        let (IgnoredAny, content) = tagged.variant()?;
        content.tuple_variant(2, TypedArrayVisitor)
    }
}

/// Tags of RFC 8746 for arrays of floats; a byte string without a tag is the first of them.
const FLOAT32_LITTLE_ENDIAN: u64 = 85;
const FLOAT64_LITTLE_ENDIAN: u64 = 86;
const FLOAT32_BIG_ENDIAN: u64 = 81;
const FLOAT64_BIG_ENDIAN: u64 = 82;

/// Floats out of a byte string, written as an RFC 8746 tag says.
fn floats_of<E: serde::de::Error>(tag: u64, bytes: &[u8]) -> Result<RangesDto, E> {
    let ranges_m = match tag {
        FLOAT32_LITTLE_ENDIAN => floats(bytes, f32::from_le_bytes),
        FLOAT32_BIG_ENDIAN => floats(bytes, f32::from_be_bytes),
        FLOAT64_LITTLE_ENDIAN => floats(bytes, |eight| f64::from_le_bytes(eight) as f32),
        FLOAT64_BIG_ENDIAN => floats(bytes, |eight| f64::from_be_bytes(eight) as f32),
        other => {
            let problem =
                format!("CBOR tag {other} is not understood here; 81, 82, 85 and 86 are arrays of floats");
            return Err(E::custom(problem));
        }
    };
    let whole = || E::custom(format!("{} bytes are no whole number of readings", bytes.len()));
    ranges_m.map(RangesDto).ok_or_else(whole)
}

/// Nothing when the bytes are no whole number of floats.
fn floats<const SIZE: usize>(bytes: &[u8], float: impl Fn([u8; SIZE]) -> f32) -> Option<Vec<f32>> {
    let (floats, rest) = bytes.as_chunks();
    rest.is_empty().then(|| floats.iter().map(|bytes| float(*bytes)).collect())
}

/// The tag and the byte string of a typed array.
struct TypedArrayVisitor;

impl<'de> Visitor<'de> for TypedArrayVisitor {
    type Value = RangesDto;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a typed array of floats")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<RangesDto, A::Error> {
        let missing = || serde::de::Error::custom("a typed array is a tag and a byte string");
        let tag = parts.next_element()?.ok_or_else(missing)?;
        let ByteString(bytes) = parts.next_element()?.ok_or_else(missing)?;
        floats_of(tag, &bytes)
    }
}

/// Bytes of CBOR.
struct ByteString(Vec<u8>);

impl<'de> Deserialize<'de> for ByteString {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_byte_buf(ByteStringVisitor)
    }
}

struct ByteStringVisitor;

impl Visitor<'_> for ByteStringVisitor {
    type Value = ByteString;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a byte string")
    }

    fn visit_bytes<E: serde::de::Error>(self, bytes: &[u8]) -> Result<ByteString, E> {
        Ok(ByteString(bytes.to_vec()))
    }

    fn visit_byte_buf<E: serde::de::Error>(self, bytes: Vec<u8>) -> Result<ByteString, E> {
        Ok(ByteString(bytes))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Vec<f32>, String> {
        let ranges: Result<RangesDto, _> = ciborium::from_reader(bytes);
        ranges.map(|ranges| ranges.0).map_err(|error| error.to_string())
    }

    fn typed(tag: u8, bytes: &[u8]) -> Vec<u8> {
        [&[0xd8, tag, 0x58, bytes.len() as u8], bytes].concat()
    }

    #[test]
    fn cbor_carries_ranges_as_lists_byte_strings_and_typed_arrays() {
        let expected = vec![1.5f32, 2.25];
        let bytes =
            |of: fn(f32) -> Vec<u8>| expected.iter().flat_map(|range_m| of(*range_m)).collect::<Vec<_>>();
        let f32_le = bytes(|value| value.to_le_bytes().to_vec());
        for body in [
            vec![0x82, 0xfa, 0x3f, 0xc0, 0, 0, 0xfa, 0x40, 0x10, 0, 0],
            [&[0x48u8], &*f32_le].concat(),
            typed(85, &f32_le),
            typed(81, &bytes(|value| value.to_be_bytes().to_vec())),
            typed(86, &bytes(|value| f64::from(value).to_le_bytes().to_vec())),
            typed(82, &bytes(|value| f64::from(value).to_be_bytes().to_vec())),
        ] {
            assert_eq!(read(&body), Ok(expected.clone()), "{body:x?}");
        }
        assert!(read(&typed(85, &f32_le[..7])).unwrap_err().contains("7 bytes"));
        assert!(read(&typed(64, &f32_le)).unwrap_err().contains("tag 64"));
    }
}
