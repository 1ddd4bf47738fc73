//! What the address of a question says, as a type.

use std::fmt::{self, Display};

use serde::Deserializer;
use serde::de::value::MapDeserializer;
use serde::de::{DeserializeOwned, Error, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;

use epirig_server::{Query, Refusal, RefusalKind};

/// The parts of the path and of the query, by their names.
///
/// # Errors
/// [`Refusal`] if one is missing, is none, or comes twice.
pub(super) fn read<T: DeserializeOwned>(
    named: &[(&'static str, String)],
    query: &Query,
) -> Result<T, Refusal> {
    let of_path = named.iter().map(|(name, text)| (*name, text.as_str()));
    let all = of_path.chain(query.pairs()).map(|(name, text)| (name, Text { name, text }));
    T::deserialize(MapDeserializer::new(all)).map_err(|Unfit(words)| Refusal::new(RefusalKind::Wrong, words))
}

/// Why a text is not what is asked for.
#[derive(Debug)]
struct Unfit(String);

impl Display for Unfit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl std::error::Error for Unfit {}

impl Error for Unfit {
    fn custom<T: Display>(words: T) -> Self {
        Self(words.to_string())
    }

    fn missing_field(field: &'static str) -> Self {
        Text { name: field, text: "" }.unfit()
    }
}

/// A text with its name.
#[derive(Clone, Copy)]
struct Text<'a> {
    name: &'a str,
    text: &'a str,
}

impl Text<'_> {
    fn unfit(self) -> Unfit {
        Unfit(format!("{}=\"{}\" cannot be used", self.name, self.text))
    }
}

impl<'de> IntoDeserializer<'de, Unfit> for Text<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// Numbers are read as the type asks for them.
macro_rules! numbers {
    ($($method:ident $visit:ident,)*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unfit> {
            visitor.$visit(self.text.parse().map_err(|_| self.unfit())?)
        })*
    };
}

impl<'de> Deserializer<'de> for Text<'de> {
    type Error = Unfit;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unfit> {
        visitor.visit_borrowed_str(self.text)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unfit> {
        visitor.visit_some(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unfit> {
        visitor.visit_enum(self.text.into_deserializer()).map_err(|_: Unfit| self.unfit())
    }

    numbers! {
        deserialize_u64 visit_u64,
        deserialize_i64 visit_i64,
        deserialize_f64 visit_f64,
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 u8 u16 u32 f32 char str string bytes byte_buf unit unit_struct newtype_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}
