//! Scenes as text.
//!
//! A file holds only what differs from the defaults and is merged into them before it is parsed. An
//! unknown name, a missing value and a value out of range are refused with the dotted name of the field.

use crate::{
    error::Invalid,
    scene::{Scene, json, ranges},
};
use serde::de::DeserializeOwned;
use serde_json::Value;

impl Scene {
    /// Read a scene file.
    ///
    /// # Errors
    /// `Invalid` names the wrong field and the valid values; the same holds for all functions here.
    pub fn from_toml(text: &str) -> Result<Self, Invalid> {
        let table: toml::Value = toml::from_str(text).map_err(|e| Invalid(not_toml(text, &e)))?;
        // JSON has no such numbers and writes null instead.
        refuse_non_finite("", &table)?;
        Self::merged_with_defaults(serde_json::to_value(table).expect("numbers are finite"))
    }

    /// Read a scene as JSON, in full or in part.
    pub fn from_json(text: &str) -> Result<Self, Invalid> {
        let table = json::parse(text).map_err(|e| Invalid(format!("not JSON: {e}")))?;
        Self::merged_with_defaults(table)
    }

    /// Every field, as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene is made of tables, strings and numbers")
    }

    /// Every field, as JSON.
    pub fn to_json(&self) -> String {
        self.to_value().to_string()
    }

    /// A field or a table of fields as JSON, by its dotted name; `null` inside of an effect that is off.
    pub fn field(&self, name: &str) -> Result<String, Invalid> {
        let mut value = self.to_value();
        let mut path = String::new();
        for key in name.split('.') {
            value = match &mut value {
                Value::Null => return Ok("null".into()),
                table => match table.get_mut(key) {
                    Some(inner) => inner.take(),
                    None => return Err(unknown(name, &path, table)),
                },
            };
            path = ranges::join(&path, key);
        }
        Ok(value.to_string())
    }

    pub(super) fn to_value(&self) -> Value {
        serde_json::to_value(self).expect("a scene is made of tables, strings and numbers")
    }

    /// A copy with new values of numbers, by their dotted names as in `parameters`.
    pub fn with_values<'a>(
        &self,
        values: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<Self, Invalid> {
        let mut table = self.to_value();
        for (name, x) in values {
            // Special characters of a JSON pointer are in no name.
            let is_name = !name.contains(['/', '~']);
            let path = is_name.then(|| format!("/{}", name.replace('.', "/")));
            match path.and_then(|path| table.pointer_mut(&path)) {
                Some(number @ Value::Number(_)) => {
                    check_number(name, x)?;
                    *number = x.into();
                }
                _ => {
                    return Err(Invalid(format!(
                        "\"{name}\": this scene has no number of that name"
                    )));
                }
            }
        }
        Self::checked(table)
    }

    fn merged_with_defaults(given: Value) -> Result<Self, Invalid> {
        let mut table = Self::default().to_value();
        merge(&mut table, given);
        Self::checked(table)
    }

    fn checked(table: Value) -> Result<Self, Invalid> {
        let ranges = table["randomise"].as_object().into_iter().flatten();
        if let Some((name, _)) = ranges.into_iter().find(|(_, range)| range.is_object()) {
            return Err(Invalid(format!(
                "randomise.{name}: a name stands in quotes as a whole, as in \"ice.gravity\" = [9.7, 9.9]"
            )));
        }
        // Before parsing, because errors of the parser do not have the full names.
        ranges::check(&table)?;
        let scene: Self = parse(table)?;
        // Again, because the numbers of a table given as a list had no names.
        scene.validate()?;
        Ok(scene)
    }

    /// Check that all numbers are in their ranges, and that no choices contradict each other.
    pub fn validate(&self) -> Result<(), Invalid> {
        ranges::check(&self.to_value())?;
        self.check_rules()
    }
}

/// Write the values of `given` into `base`. Tables are merged, unless their `kind` changes; all else is
/// replaced.
fn merge(base: &mut Value, given: Value) {
    match (base, given) {
        (Value::Object(base), Value::Object(given)) => {
            if given
                .get("kind")
                .is_some_and(|kind| base.get("kind") != Some(kind))
            {
                base.clear();
            }
            for (key, value) in given {
                match base.get_mut(&key) {
                    Some(old) => merge(old, value),
                    None => {
                        base.insert(key, value);
                    }
                }
            }
        }
        (base, given) => *base = given,
    }
}

/// Error for a name that is not in the table of this path.
fn unknown(name: &str, path: &str, table: &Value) -> Invalid {
    let keys: Vec<_> = table.as_object().into_iter().flatten().collect();
    let keys: Vec<_> = keys.iter().map(|(key, _)| key.as_str()).collect();
    let table = if path.is_empty() { "a scene" } else { path };
    let has = match keys.is_empty() {
        true => "no fields".into(),
        false => format!("the fields {}", keys.join(", ")),
    };
    Invalid(format!("field \"{name}\": unknown; {table} has {has}"))
}

fn parse<T: DeserializeOwned>(table: Value) -> Result<T, Invalid> {
    serde_path_to_error::deserialize(table)
        .map_err(|e| Invalid(format!("{}: {}", e.path(), e.inner())))
}

fn refuse_non_finite(name: &str, value: &toml::Value) -> Result<(), Invalid> {
    match value {
        toml::Value::Table(table) => table
            .iter()
            .try_for_each(|(key, value)| refuse_non_finite(&ranges::join(name, key), value)),
        toml::Value::Array(list) => list.iter().enumerate().try_for_each(|(i, value)| {
            refuse_non_finite(&ranges::join(name, &i.to_string()), value)
        }),
        toml::Value::Float(x) if !x.is_finite() => check_number(name, *x),
        _ => Ok(()),
    }
}

/// Check that a number is finite, and within its range if it has one.
fn check_number(name: &str, x: f64) -> Result<(), Invalid> {
    let bounds = ranges::range_of(name).map_or((f64::MIN, f64::MAX, ""), |range| {
        (range.low, range.high, range.unit)
    });
    Invalid::range(name, x, bounds.0, bounds.1, bounds.2)
}

/// Message with the position of a syntax error, without the line, which may be very long.
fn not_toml(text: &str, error: &toml::de::Error) -> String {
    let at = error.span().map_or(0, |span| span.start.min(text.len()));
    let before = &text.as_bytes()[..at];
    let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
    let column = 1 + before
        .iter()
        .rev()
        .take_while(|&&byte| byte != b'\n')
        .count();
    let message = error.message();
    format!("not TOML at line {line}, column {column}: {message}")
}
