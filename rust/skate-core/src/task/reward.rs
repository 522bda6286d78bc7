//! Reward: slide distance of the loaded foot + head height - control effort.

use crate::{
    error::Invalid,
    model::{Model, contact_mode::SoleContact, layout::NV},
    rhs::Evaluation,
    sim::gait_statistics::Totals,
    task::{Episode, Task},
};

/// Names of the reward terms, in order.
pub const TERMS: [&str; 3] = ["slide", "head", "effort"];

/// Weights of the reward terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Per metre of forward slide of a loaded foot [1/m].
    pub slide: f64,
    /// Per second with the head at standing height [1/s].
    pub head: f64,
    /// Per second of full action in all joints [1/s].
    pub effort: f64,
}

impl Weights {
    pub(super) fn check(&self) -> Result<(), Invalid> {
        let Self {
            slide,
            head,
            effort,
        } = *self;
        for (name, x, unit) in [
            ("slide_weight", slide, "1/m"),
            ("head_weight", head, "1/s"),
            ("effort_weight", effort, "1/s"),
        ] {
            Invalid::range(name, x, -1e6, 1e6, unit)?;
        }
        Ok(())
    }
}

/// Reward terms of an action that started at the time `t` [s] with the totals `before`; `effort` is the
/// action's mean square.
pub fn terms(task: &Task, episode: &Episode, (t, before): (f64, Totals), effort: f64) -> [f64; 3] {
    let (sim, weights) = (&episode.sim, &task.weights);
    let elapsed = sim.state.t - t;
    let slid = sim.totals().loaded_slide - before.loaded_slide;
    [
        weights.slide * slid,
        weights.head * elapsed * head_height(episode),
        // Avoids -0.0 for zero effort.
        0.0 - weights.effort * elapsed * effort,
    ]
}

/// Height of the top of the head when standing upright [m].
pub fn standing_height(model: &Model) -> f64 {
    let zero = [0.0; NV];
    let mut eval = Evaluation::default();
    eval.set_configuration(model, SoleContact::Toe, &zero, &zero);
    eval.kin.head(model).z
}

/// Normalised head height: 1 at standing height, 0 at the fall height (or at the ice, if the scene has no
/// fall condition).
fn head_height(episode: &Episode) -> f64 {
    let model = &episode.sim.model;
    let fallen = model.scene.fall.as_ref().map_or(0.0, |f| f.head_height);
    let span = episode.standing - fallen;
    let head = episode.sim.head()[2] - fallen;
    // If the fall height exceeds the standing height, the term is 0.
    if span > 0.0 {
        (head / span).clamp(0.0, 1.0)
    } else {
        0.0
    }
}
