//! Bodies read as the API's document means them, whatever format they come in.
//!
//! What serde derives takes a list for an object, and tells whole numbers from floats as the format does. The document knows
//! objects that are objects, and numbers: `12.0` is a whole one and `3` a float, in JSON and in CBOR. Nothing is larger
//! than 2^63 − 1, which every language can hold.

use std::fmt;

use serde::Deserialize;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Unexpected, VariantAccess,
    Visitor,
};

/// Every whole number of this size has a float of its own.
const EXACT_MAX: f64 = 9_007_199_254_740_992.0;
/// The highest bit is not used.
const WHOLE_MAX: u64 = i64::MAX as u64;

/// A value that is read so, with all that is in it.
pub(crate) struct AsDocumented<T>(pub T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for AsDocumented<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        T::deserialize(Reader(deserializer)).map(Self)
    }
}

/// A deserializer, or one of its parts, whose values are read so.
struct Reader<R>(R);

/// What the document says of the next value.
#[derive(Clone, Copy)]
enum Expected {
    Anything,
    Object,
    Whole { max: u64 },
}

struct Reading<V> {
    visitor: V,
    expected: Expected,
}

fn anything<V>(visitor: V) -> Reading<V> {
    Reading { visitor, expected: Expected::Anything }
}

fn object<V>(visitor: V) -> Reading<V> {
    Reading { visitor, expected: Expected::Object }
}

/// Methods of a deserializer that only pass on what they read.
macro_rules! pass_on {
    ($($method:ident)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, R::Error> {
            self.0.$method(anything(visitor))
        }
    )*};
}

/// Methods for whole numbers. Formats are asked what they hold, since they refuse a float unseen.
macro_rules! whole {
    ($($method:ident: $max:expr,)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, R::Error> {
            self.0.deserialize_any(Reading { visitor, expected: Expected::Whole { max: $max } })
        }
    )*};
}

/// Methods for floats, which a whole number is as well.
macro_rules! float {
    ($($method:ident)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, R::Error> {
            self.0.deserialize_any(anything(visitor))
        }
    )*};
}

impl<'de, R: Deserializer<'de>> Deserializer<'de> for Reader<R> {
    type Error = R::Error;

    pass_on! {
        deserialize_any deserialize_bool deserialize_char deserialize_str deserialize_string deserialize_bytes
        deserialize_byte_buf deserialize_option deserialize_unit deserialize_seq deserialize_map
        deserialize_identifier deserialize_ignored_any
    }

    whole! {
        deserialize_u8: u64::from(u8::MAX),
        deserialize_u16: u64::from(u16::MAX),
        deserialize_u32: u64::from(u32::MAX),
        deserialize_u64: WHOLE_MAX,
        deserialize_i8: i8::MAX as u64,
        deserialize_i16: i16::MAX as u64,
        deserialize_i32: i32::MAX as u64,
        deserialize_i64: WHOLE_MAX,
    }

    float! { deserialize_f32 deserialize_f64 }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, R::Error> {
        self.0.deserialize_struct(name, fields, object(visitor))
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, R::Error> {
        self.0.deserialize_unit_struct(name, anything(visitor))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, R::Error> {
        self.0.deserialize_newtype_struct(name, anything(visitor))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, R::Error> {
        self.0.deserialize_tuple(len, anything(visitor))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, R::Error> {
        self.0.deserialize_tuple_struct(name, len, anything(visitor))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, R::Error> {
        self.0.deserialize_enum(name, variants, anything(visitor))
    }

    fn is_human_readable(&self) -> bool {
        self.0.is_human_readable()
    }
}

/// Methods of a visitor that hand a value on as it is.
macro_rules! hand_on {
    ($($method:ident: $value:ty,)*) => {$(
        fn $method<E: Error>(self, value: $value) -> Result<V::Value, E> {
            self.visitor.$method(value)
        }
    )*};
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Reading<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.visitor.expecting(f)
    }

    hand_on! {
        visit_bool: bool,
        visit_i64: i64,
        visit_i128: i128,
        visit_u128: u128,
        visit_char: char,
        visit_str: &str,
        visit_borrowed_str: &'de str,
        visit_string: String,
        visit_bytes: &[u8],
        visit_borrowed_bytes: &'de [u8],
        visit_byte_buf: Vec<u8>,
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<V::Value, E> {
        match self.expected {
            Expected::Whole { max } if value > max => {
                Err(E::custom(format!("the number {value} is too large")))
            }
            _ => self.visitor.visit_u64(value),
        }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<V::Value, E> {
        let is_exact = value.fract() == 0.0 && value.abs() <= EXACT_MAX;
        match self.expected {
            Expected::Whole { .. } if is_exact && value >= 0.0 => self.visit_u64(value as u64),
            Expected::Whole { .. } if is_exact => self.visitor.visit_i64(value as i64),
            _ => self.visitor.visit_f64(value),
        }
    }

    fn visit_none<E: Error>(self) -> Result<V::Value, E> {
        self.visitor.visit_none()
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.visitor.visit_unit()
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
        self.visitor.visit_some(Reader(deserializer))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
        self.visitor.visit_newtype_struct(Reader(deserializer))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<V::Value, A::Error> {
        match self.expected {
            Expected::Object => Err(A::Error::invalid_type(Unexpected::Seq, &self.visitor)),
            _ => self.visitor.visit_seq(Reader(items)),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<V::Value, A::Error> {
        self.visitor.visit_map(Reader(members))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, choice: A) -> Result<V::Value, A::Error> {
        self.visitor.visit_enum(Reader(choice))
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Reader<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<S::Value, D::Error> {
        self.0.deserialize(Reader(deserializer))
    }
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Reader<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_element_seed(Reader(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Reader<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_key_seed(seed)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.0.next_value_seed(Reader(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: EnumAccess<'de>> EnumAccess<'de> for Reader<A> {
    type Error = A::Error;
    type Variant = Reader<A::Variant>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self::Variant), A::Error> {
        self.0.variant_seed(seed).map(|(name, content)| (name, Reader(content)))
    }
}

impl<'de, A: VariantAccess<'de>> VariantAccess<'de> for Reader<A> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        self.0.unit_variant()
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, A::Error> {
        self.0.newtype_variant_seed(Reader(seed))
    }

    fn tuple_variant<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.0.tuple_variant(len, anything(visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        self.0.struct_variant(fields, object(visitor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq, Deserialize)]
    #[serde(default)]
    struct Inner {
        float: f64,
        pair: [f32; 2],
    }

    #[derive(Debug, Default, PartialEq, Deserialize)]
    #[serde(default)]
    struct Numbers {
        whole: u64,
        small: Option<u8>,
        signed: i32,
        inner: Option<Inner>,
        any: serde_json::Value,
    }

    fn of_json(json: &str) -> Result<Numbers, String> {
        let read: Result<AsDocumented<Numbers>, _> = serde_json::from_str(json);
        read.map(|AsDocumented(numbers)| numbers).map_err(|error| error.to_string())
    }

    /// The same document in CBOR, whole numbers as whole ones and others as floats.
    fn of_cbor(json: &str) -> Result<Numbers, String> {
        let value: serde_json::Value = serde_json::from_str(json).unwrap();
        let mut bytes = Vec::new();
        ciborium::into_writer(&value, &mut bytes).unwrap();
        let read: Result<AsDocumented<Numbers>, _> = ciborium::from_reader(bytes.as_slice());
        read.map(|AsDocumented(numbers)| numbers).map_err(|error| error.to_string())
    }

    #[test]
    fn a_number_is_a_number_however_it_is_written() {
        let json = r#"{"whole": 12.0, "small": 3e0, "signed": -4.0, "inner": {"float": 5, "pair": [1, 2.5]},
            "any": [1, 2.0]}"#;
        let expected = Numbers {
            whole: 12,
            small: Some(3),
            signed: -4,
            inner: Some(Inner { float: 5.0, pair: [1.0, 2.5] }),
            any: serde_json::json!([1, 2.0]),
        };
        assert_eq!(of_json(json).unwrap(), expected);
        assert_eq!(of_cbor(json).unwrap(), expected);
    }

    #[test]
    fn what_is_no_such_number_is_told() {
        for (wrong, told) in [
            (r#"{"whole": 12.5}"#, "12.5"),
            (r#"{"whole": -1}"#, "-1"),
            (r#"{"whole": -1.0}"#, "-1"),
            (r#"{"whole": 1e300}"#, "1e300"),
            (r#"{"whole": "1"}"#, "\"1\""),
            (r#"{"whole": 9223372036854775808}"#, "9223372036854775808 is too large"),
            (r#"{"small": 256}"#, "256 is too large"),
            (r#"{"small": 256.0}"#, "256 is too large"),
            (r#"{"inner": {"float": "1"}}"#, "\"1\""),
        ] {
            assert!(of_json(wrong).unwrap_err().contains(told), "{wrong}: {:?}", of_json(wrong));
            assert!(of_cbor(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_list_is_no_object_at_any_depth() {
        for wrong in ["[1, 2]", r#"{"inner": [1.0, [1, 2]]}"#, r#"{"inner": []}"#] {
            assert!(of_json(wrong).unwrap_err().contains("invalid type: sequence"), "{wrong}");
            assert!(of_cbor(wrong).is_err(), "{wrong}");
        }
    }
}
