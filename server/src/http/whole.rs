//! Whole numbers as JSON has them: `12.0` is one, and many programs write it so.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};

/// Every whole number of this size has a float of its own.
const EXACT_MAX: f64 = 9_007_199_254_740_992.0;

/// Reads a whole number that is not negative.
pub(crate) fn deserialize<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: TryFrom<u64>,
{
    deserializer.deserialize_u64(WholeVisitor(PhantomData))
}

/// Reads a whole number or none; for members that may be left out.
pub(crate) fn optional<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: TryFrom<u64>,
{
    Ok(Option::<Whole<T>>::deserialize(deserializer)?.map(|whole| whole.0))
}

struct Whole<T>(T);

impl<'de, T: TryFrom<u64>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize(deserializer).map(Self)
    }
}

struct WholeVisitor<T>(PhantomData<T>);

impl<T: TryFrom<u64>> Visitor<'_> for WholeVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a whole number that is not negative")
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<T, E> {
        T::try_from(value).map_err(|_| E::custom(format!("the number {value} is too large")))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        let value = u64::try_from(value).map_err(|_| E::invalid_value(Unexpected::Signed(value), &self))?;
        self.visit_u64(value)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<T, E> {
        if value.fract() == 0.0 && (0.0..=EXACT_MAX).contains(&value) {
            return self.visit_u64(value as u64);
        }
        Err(E::invalid_value(Unexpected::Float(value), &self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct Numbers {
        #[serde(deserialize_with = "deserialize")]
        must: u64,
        #[serde(default, deserialize_with = "optional")]
        may: Option<u8>,
    }

    fn read(json: &str) -> Result<(u64, Option<u8>), String> {
        let read: Result<Numbers, _> = serde_json::from_str(json);
        read.map(|numbers| (numbers.must, numbers.may)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_float_without_fraction_is_whole() {
        assert_eq!(read(r#"{"must": 12.0, "may": 3.0}"#), Ok((12, Some(3))));
        assert_eq!(read(r#"{"must": 18446744073709551615}"#), Ok((u64::MAX, None)));
        assert_eq!(read(r#"{"must": 1e3, "may": null}"#), Ok((1_000, None)));
    }

    #[test]
    fn everything_else_is_told() {
        for wrong in [
            r#"{"must": 12.5}"#,
            r#"{"must": -1}"#,
            r#"{"must": -1.0}"#,
            r#"{"must": 1e300}"#,
            r#"{"must": "1"}"#,
        ] {
            assert!(read(wrong).unwrap_err().contains("a whole number that is not negative"), "{wrong}");
        }
        assert!(read(r#"{"must": 1, "may": 256}"#).unwrap_err().contains("256 is too large"));
    }
}
