//! JSON without a name twice in a table, as in TOML: of two values, readers would disagree on the one that counts.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt;

/// Parse a text.
pub fn parse(text: &str) -> serde_json::Result<Value> {
    let mut from = serde_json::Deserializer::from_str(text);
    let value = Distinct.deserialize(&mut from)?;
    from.end()?;
    Ok(value)
}

/// Makes a value of which every table has distinct names.
struct Distinct;

impl<'de> DeserializeSeed<'de> for Distinct {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        from.deserialize_any(self)
    }
}

macro_rules! scalars {
    ($($name:ident: $kind:ty),*) => {
        $(fn $name<E>(self, given: $kind) -> Result<Value, E> { Ok(given.into()) })*
    };
}

impl<'de> Visitor<'de> for Distinct {
    type Value = Value;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    scalars!(visit_bool: bool, visit_i64: i64, visit_u64: u64, visit_f64: f64, visit_str: &str);

    fn visit_seq<A: SeqAccess<'de>>(self, mut given: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(value) = given.next_element_seed(Self)? {
            list.push(value);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut given: A) -> Result<Value, A::Error> {
        let mut table = Map::new();
        while let Some(name) = given.next_key::<String>()? {
            let value = given.next_value_seed(Self)?;
            if table.contains_key(&name) {
                return Err(A::Error::custom(format!("{name:?} occurs twice")));
            }
            table.insert(name, value);
        }
        Ok(Value::Object(table))
    }
}
