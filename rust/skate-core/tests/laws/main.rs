//! Laws of mechanics and numerics, independent of the engine's derivation.
#![allow(non_snake_case)]

mod dynamics;
mod integrator;
mod kick;
mod late_times;
mod leg_swap;
mod modes;
mod motion;
mod stiffness;
mod time_stepping;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use skate_core::{
    model::{Model, layout::NV},
    scene::Scene,
};

/// Random numbers up to `size` in the first `n` coordinates.
fn draw(rng: &mut ChaCha8Rng, n: usize, size: f64) -> [f64; NV] {
    std::array::from_fn(|i| {
        if i < n {
            rng.random_range(-size..size)
        } else {
            0.0
        }
    })
}

/// Model of a scene given as JSON.
fn bare(extra: &str) -> Model {
    Model::compile(&Scene::from_json(extra).expect("a scene")).expect("a model")
}
