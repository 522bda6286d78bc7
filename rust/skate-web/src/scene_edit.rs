//! Scenes as the page makes them: a preset's text and the changes to it.

use serde::Deserialize;
use serde_json::{Value, json};
use skate_core::{
    error::Invalid,
    scene::{Scene, effects::EFFECTS},
};
use std::collections::BTreeMap;

/// A scene and what to change in it, in this order: effects, numbers, accuracy.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneEdit {
    /// The scene as TOML.
    pub toml: String,
    /// Effects to switch on or off, in order.
    #[serde(default)]
    pub effects: Vec<(String, bool)>,
    /// Numbers by their dotted names.
    #[serde(default)]
    pub values: BTreeMap<String, f64>,
    /// `fast`, `balanced`, `reference`, or any other accuracy of a scene.
    #[serde(default)]
    pub accuracy: Option<Value>,
}

impl SceneEdit {
    /// Read an edit from JSON.
    ///
    /// # Errors
    /// `Invalid` for any other text.
    pub fn from_json(text: &[u8]) -> Result<Self, Invalid> {
        serde_json::from_slice(text).map_err(|e| Invalid(format!("not an edit of a scene: {e}")))
    }

    /// The changed scene.
    ///
    /// # Errors
    /// `Invalid` if the scene or a change is not valid.
    pub fn apply(&self) -> Result<Scene, Invalid> {
        let mut scene = Scene::from_toml(&self.toml)?;
        for (name, on) in &self.effects {
            scene = if *on {
                scene.with(name)?
            } else {
                scene.without(name)?
            };
        }
        let values = self.values.iter().map(|(name, x)| (name.as_str(), *x));
        scene = scene.with_values(values)?;
        if let Some(accuracy) = &self.accuracy {
            let mut table: Value = serde_json::from_str(&scene.to_json()).expect("a scene's JSON");
            table["accuracy"] = accuracy.clone();
            scene = Scene::from_json(&table.to_string())?;
        }
        Ok(scene)
    }
}

/// A scene as JSON: `scene`, all fields; `parameters`, all numbers with their ranges; `effects`, which are on,
/// and for each that cannot change why.
pub fn describe(scene: &Scene) -> Value {
    let parameters = scene.parameters().into_iter().map(|p| {
        let range = p.range;
        json!({"name": p.name, "value": p.value, "low": range.low, "high": range.high, "unit": range.unit})
    });
    let effects = EFFECTS.iter().map(|effect| {
        let on = effect.is_on(scene);
        let name = effect.name;
        let other = if on {
            scene.without(name)
        } else {
            scene.with(name)
        };
        let fixed = other.err().map(|why| why.to_string());
        json!({"name": name, "description": effect.description, "on": on, "fixed": fixed})
    });
    json!({
        "scene": serde_json::from_str::<Value>(&scene.to_json()).expect("a scene's JSON"),
        "parameters": parameters.collect::<Value>(),
        "effects": effects.collect::<Value>(),
    })
}
