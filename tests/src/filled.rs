//! Messages with every field different from its default.

use serde::de::value::Error;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error as _, SeqAccess, Visitor};
use serde_json::Value;

/// Elements of what has no fixed length.
const LENGTH: usize = 2;

/// A message in which no field has its default and neighbours differ, so that fields that are left out or swapped show.
pub fn filled<M: for<'de> Deserialize<'de>>() -> M {
    let mut count = 0;
    M::deserialize(Filler(&mut count)).unwrap()
}

/// Fails where a number is 0, a text or a list is empty or a flag is false.
pub fn assert_filled(what: &str, value: &Value) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                assert_filled(&format!("{what}.{name}"), value);
            }
        }
        Value::Array(elements) => {
            assert!(!elements.is_empty(), "{what} is empty");
            for value in elements {
                assert_filled(what, value);
            }
        }
        Value::Number(number) => assert_ne!(number.as_f64(), Some(0.0), "{what}"),
        Value::String(text) => assert!(!text.is_empty(), "{what} is empty"),
        Value::Bool(flag) => assert!(flag, "{what} is false"),
        Value::Null => panic!("{what} is null"),
    }
}

/// Makes up a value for whatever is asked: numbers count from 1 to 120, which fits into every type.
struct Filler<'a>(&'a mut u8);

impl Filler<'_> {
    fn next(&mut self) -> u8 {
        *self.0 = *self.0 % 120 + 1;
        *self.0
    }
}

macro_rules! fill_numbers {
    ($($method:ident $visit:ident $kind:ty),*) => {
        $(fn $method<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
            visitor.$visit(<$kind>::try_from(self.next()).unwrap())
        })*
    };
}

impl<'de> Deserializer<'de> for Filler<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(Error::custom("no ROS message has such a field"))
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_bool(true)
    }

    fill_numbers!(
        deserialize_i8 visit_i8 i8, deserialize_i16 visit_i16 i16, deserialize_i32 visit_i32 i32,
        deserialize_i64 visit_i64 i64, deserialize_u8 visit_u8 u8, deserialize_u16 visit_u16 u16,
        deserialize_u32 visit_u32 u32, deserialize_u64 visit_u64 u64
    );

    fn deserialize_f32<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f32(f32::from(self.next()) + 0.25)
    }

    fn deserialize_f64<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f64(f64::from(self.next()) + 0.25)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_string(visitor)
    }

    fn deserialize_string<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_string(format!("text {}", self.next()))
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_tuple(LENGTH, visitor)
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        left: usize,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_seq(Elements {
            count: self.0,
            left,
        })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.deserialize_tuple(fields.len(), visitor)
    }

    serde::forward_to_deserialize_any! {
        char bytes byte_buf option unit unit_struct newtype_struct tuple_struct map enum identifier ignored_any
    }
}

struct Elements<'a> {
    count: &'a mut u8,
    left: usize,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Error> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(Filler(self.count)).map(Some)
    }
}
