//! Scenes from bytes.

use crate::draw::{below, byte, logarithmic, near_or_within};
use arbitrary::Unstructured;
use skate_core::{
    integrate::{Control, ErrorControl, Fixed, Method},
    scene::{Accuracy, AccuracyName, Scene, TimeStepping, effects::EFFECTS},
};
use std::sync::LazyLock;

/// The presets, and the default scene on one leg and on both legs.
static KNOWN_SCENES: LazyLock<Vec<Scene>> = LazyLock::new(|| {
    let presets = [
        include_str!("../../../skate_env/scenes/paper.toml"),
        include_str!("../../../skate_env/studies/scenes/paper_damped.toml"),
        include_str!("../../../skate_env/scenes/paper_arms.toml"),
        include_str!("../../../skate_env/studies/scenes/blade.toml"),
        include_str!("../../../skate_env/scenes/push_only.toml"),
        include_str!("../../../skate_env/scenes/paper_printed.toml"),
        "[start.q]\nq2 = 0.1\nq3 = -0.2\nq5 = 0.5\nq6 = -0.9\nq7 = 0.4\n[start.v]\ny0 = 1.0",
        "",
    ];
    let read = |text| Scene::from_toml(text).expect("a known scene");
    presets.map(read).to_vec()
});

/// Maximum number of toggled effects and drawn parameters.
const MAX_CHANGES: usize = 16;

/// If the first byte is 0 or 1: the text up to a zero byte. Otherwise a known scene with changes.
pub fn scene(u: &mut Unstructured) -> Option<Scene> {
    let kind = byte(u);
    if kind >= 2 {
        return Some(changed(
            u,
            &KNOWN_SCENES[kind as usize % KNOWN_SCENES.len()],
        ));
    }
    let rest = u.peek_bytes(u.len()).unwrap_or_default();
    let end = rest.iter().position(|&b| b == 0).unwrap_or(rest.len());
    let text = String::from_utf8_lossy(&rest[..end]).into_owned();
    u.bytes((end + 1).min(u.len())).expect("enough bytes");
    let read = match kind {
        0 => Scene::from_toml(&text),
        _ => Scene::from_json(&text),
    };
    match read {
        Ok(scene) => Some(scene),
        Err(refused) => {
            assert!(!refused.0.is_empty());
            None
        }
    }
}

fn changed(u: &mut Unstructured, known: &Scene) -> Scene {
    let mut scene = known.clone();
    scene.accuracy = accuracy(u);
    for _ in 0..below(u, MAX_CHANGES) {
        let effect = &EFFECTS[below(u, EFFECTS.len())];
        let switched = match effect.is_on(&scene) {
            true => scene.without(effect.name),
            false => scene.with(effect.name),
        };
        scene = switched.unwrap_or(scene);
    }
    other_numbers(u, &scene)
}

/// The same scene with some parameters drawn within their ranges.
pub fn other_numbers(u: &mut Unstructured, scene: &Scene) -> Scene {
    let mut known = scene.parameters();
    // Resets draw the start; `accuracy` has been chosen.
    known.retain(|p| !p.name.starts_with("start.") && !p.name.starts_with("accuracy"));
    let count = below(u, MAX_CHANGES);
    let values: Vec<_> = (0..count)
        .map(|_| {
            let p = &known[below(u, known.len())];
            let x = near_or_within(u, p.value, p.range.low, p.range.high);
            (p.name.as_str(), x)
        })
        .collect();
    // A parameter that was zero may conflict with a choice; then the scene is unchanged.
    scene.with_values(values).unwrap_or(scene.clone())
}

fn accuracy(u: &mut Unstructured) -> Accuracy {
    let tolerance = |u: &mut Unstructured| {
        Control::Error(ErrorControl {
            tolerance: logarithmic(u, 1e-13, 1e-2),
        })
    };
    // Smaller steps are valid but slow.
    let step = |u: &mut Unstructured| logarithmic(u, 1e-5, 0.1);
    match below(u, 8) {
        0 | 1 => Accuracy::Named(AccuracyName::Fast),
        2 => Accuracy::Named(AccuracyName::Reference),
        3 => Accuracy::Method(Method::Dopri5(tolerance(u))),
        4 => Accuracy::Method(Method::Rosenbrock(tolerance(u))),
        5 => Accuracy::Method(Method::Rk4(Fixed { step: step(u) })),
        6 => Accuracy::TimeStepping(TimeStepping::Moreau { step: step(u) }),
        _ => Accuracy::Named(AccuracyName::Balanced),
    }
}
