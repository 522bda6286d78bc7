//! The numbers of a scene: their ranges and units, one table for checks and for whoever draws random
//! ones.

use crate::{
    error::{Invalid, Shown},
    scene::Scene,
};
use serde_json::Value;

/// Where numbers of one kind may lie.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    /// Dotted name of the field; `*` stands for any one part.
    pattern: &'static str,
    pub low: f64,
    pub high: f64,
    pub unit: &'static str,
}

const fn range(pattern: &'static str, low: f64, high: f64, unit: &'static str) -> Range {
    Range {
        pattern,
        low,
        high,
        unit,
    }
}

/// Every number of a scene finds its range here; the first that fits counts.
const RANGES: [Range; 41] = [
    range("accuracy", 1e-13, 1e-2, "relative"),
    range("accuracy.tolerance", 1e-13, 1e-2, "relative"),
    range("accuracy.step", 1e-6, 0.1, "s"),
    range("body.foot.height", 0.01, 0.3, "m"),
    range("body.foot.toe", 0.02, 0.6, "m"),
    range("body.foot.heel", 0.02, 0.6, "m"),
    range("body.foot.width", 0.02, 0.3, "m"),
    range("body.shoulder", 0.02, 0.6, "m"),
    range("body.*.length", 0.02, 2.0, "m"),
    range("body.*.mass", 0.01, 200.0, "kg"),
    range("body.*.damping", 0.0, 1e3, "N m s/rad"),
    range("body.*.radius", 0.005, 0.5, "m"),
    range("ice.gravity", 0.0, 100.0, "m/s2"),
    range("ice.friction.mu_forward", 0.0, 10.0, "1"),
    range("ice.friction.mu_backward", 0.0, 10.0, "1"),
    range("ice.friction.mu", 0.0, 10.0, "1"),
    range("ice.friction.capture_speed", 0.0, 1.0, "m/s"),
    range("ice.friction.coefficient", 0.0, 1e3, "N s/m"),
    range("contact.edge_damping", 0.0, 1e3, "N m s/rad"),
    range("control.sample_period", 1e-5, 0.01, "s"),
    range("control.action_period", 1e-4, 1.0, "s"),
    range("control.lifting.K_p.*", 0.0, 1e9, "N/m"),
    range("control.lifting.ahead", -5.0, 5.0, "m"),
    range("control.lifting.height", -5.0, 5.0, "m"),
    range("control.feedforward.scale", -10.0, 10.0, "1"),
    range("control.feedforward.tau7_scale", -10.0, 10.0, "1"),
    range("control.arm_swing.amplitude", -1e3, 1e3, "N m"),
    range("stabilizers.head_damping.y", 0.0, 1e6, "N s/m"),
    range("stabilizers.head_damping.z", 0.0, 1e6, "N s/m"),
    range("stabilizers.knee_stop.stiffness", 0.0, 1e6, "N m/rad"),
    range("stabilizers.knee_stop.damping", 0.0, 10.0, "s/rad"),
    range("stabilizers.*.gain", 0.0, 1e6, "N m/rad"),
    range("stabilizers.*.reference", -4.0, 4.0, "rad"),
    range("stabilizers.*.damping", 0.0, 1e6, "N m s/rad"),
    range("fall.head_height", -10.0, 3.0, "m"),
    range("start.q.y0", -1e6, 1e6, "m"),
    range("start.q.z0", -1e6, 1e6, "m"),
    range("start.q.*", -1e6, 1e6, "rad"),
    range("start.v.y0", -1e6, 1e6, "m/s"),
    range("start.v.z0", -1e6, 1e6, "m/s"),
    range("start.v.*", -1e6, 1e6, "rad/s"),
];

/// One number of a scene.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Dotted; elements of a list count from 0, as in `control.lifting.K_p.2`.
    pub name: String,
    pub value: f64,
    pub range: Range,
}

impl Scene {
    /// All numbers of the scene, in the order of its fields.
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

/// Is every number a number, and within its range?
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
            // It may have a name instead.
            None if name == "accuracy" && value.is_string() => Ok(()),
            // A number that is not finite arrives as null.
            None => Err(Invalid(format!(
                "{name} = {value}: must be a number in [{}, {}] {unit}",
                Shown(low),
                Shown(high)
            ))),
        }
    })
}

/// Where the number of that name may lie.
pub(super) fn range_of(name: &str) -> Option<Range> {
    let fits = |pattern: &str| {
        let (mut parts, mut wanted) = (name.split('.'), pattern.split('.'));
        loop {
            match (parts.next(), wanted.next()) {
                (None, None) => return true,
                (Some(part), Some(pattern)) if pattern == "*" || pattern == part => {}
                _ => return false,
            }
        }
    };
    RANGES.iter().copied().find(|range| fits(range.pattern))
}

/// A field's name within a table's.
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
