//! Numbers of a scene by their dotted names, and the check of their ranges.

pub use crate::scene::declaration::Range;

use crate::{
    error::{Invalid, MessageNumber},
    scene::{Scene, declaration::Numbers},
};
use serde_json::Value;

/// One number of a scene.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Dotted; elements of a list count from 0, as in `control.lifting.K_p.2`.
    pub name: String,
    pub value: f64,
    pub range: Range,
}

impl Scene {
    /// All numbers of the scene, each table sorted by name.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut found = Vec::new();
        walk("", &self.to_value(), &mut |name, value| {
            if let (Some(value), Some(range)) = (value.as_f64(), range_of(name)) {
                let name = name.to_owned();
                found.push(Parameter { name, value, range });
            }
            Ok(())
        })
        .expect("nothing is refused");
        found
    }
}

/// Check that every number is a number, and within its range.
pub(super) fn check(scene: &Value) -> Result<(), Invalid> {
    walk("", scene, &mut |name, value| {
        let Some(Range {
            low, high, unit, ..
        }) = range_of(name)
        else {
            return Ok(());
        };
        match value.as_f64() {
            Some(x) => Invalid::range(name, x, low, high, unit),
            // A named accuracy.
            None if name == "accuracy" && value.is_string() => Ok(()),
            // A number that is not finite arrives as null.
            None => Err(Invalid(format!(
                "{name} = {value}: must be a number in [{}, {}] {unit}",
                MessageNumber(low),
                MessageNumber(high)
            ))),
        }
    })
}

/// Range of the number of that dotted name, whether or not a certain scene has it.
pub(super) fn range_of(name: &str) -> Option<Range> {
    Scene::range(&mut name.split('.'))
}

/// Dotted name of a field of a table.
pub(super) fn join(table: &str, key: &str) -> String {
    if table.is_empty() {
        key.to_owned()
    } else {
        format!("{table}.{key}")
    }
}

/// Visit everything that is neither a table nor a list.
fn walk(
    name: &str,
    value: &Value,
    visit: &mut impl FnMut(&str, &Value) -> Result<(), Invalid>,
) -> Result<(), Invalid> {
    match value {
        Value::Object(table) => table
            .iter()
            .try_for_each(|(key, value)| walk(&join(name, key), value, visit)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .try_for_each(|(i, value)| walk(&join(name, &i.to_string()), value, visit)),
        _ => visit(name, value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number without a range would never be checked.
    #[test]
    fn every_number_has_a_range() {
        let mut scene = Scene::default();
        for effect in super::super::effects::EFFECTS {
            scene = scene.with(effect.name).unwrap_or(scene);
        }
        walk("", &scene.to_value(), &mut |name, value| {
            assert!(!value.is_number() || range_of(name).is_some(), "{name}");
            Ok(())
        })
        .expect("nothing is refused");
    }
}
