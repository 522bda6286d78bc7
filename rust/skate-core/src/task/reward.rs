//! What pays: sliding on a loaded foot and holding the head up; effort costs.

use crate::{
    error::Invalid,
    model::{Model, contact_mode::SoleContact, layout::NV},
    rhs::Evaluation,
    sim::gait_statistics::Totals,
    task::{Episode, Task},
};

/// Names of the terms, in order.
pub const TERMS: [&str; 3] = ["slide", "head", "effort"];

/// What the terms are worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Per metre that a loaded foot slides forward [1/m].
    pub slide: f64,
    /// Per second with the head at standing height [1/s].
    pub head: f64,
    /// Per second of a full action in all joints [1/s].
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

/// The terms of one action, which began at the time `t` with `before`; `effort` is its mean square.
pub fn terms(task: &Task, episode: &Episode, (t, before): (f64, Totals), effort: f64) -> [f64; 3] {
    let (sim, weights) = (&episode.sim, &task.weights);
    let elapsed = sim.state.t - t;
    let slid = sim.totals().loaded_slide - before.loaded_slide;
    [
        weights.slide * slid,
        weights.head * elapsed * posture(episode),
        // Not -0.0 without any.
        0.0 - weights.effort * elapsed * effort,
    ]
}

/// Height of the top of the head of a robot that stands upright [m].
pub fn standing_height(model: &Model) -> f64 {
    let zero = [0.0; NV];
    let mut eval = Evaluation::default();
    eval.move_to(model, SoleContact::Toe, &zero, &zero);
    eval.kin.head(model).z
}

/// 1 with the head at standing height, 0 where it counts as fallen: at the ice, if the scene knows no fall.
fn posture(episode: &Episode) -> f64 {
    let model = &episode.sim.model;
    let fallen = model.scene.fall.as_ref().map_or(0.0, |f| f.head_height);
    let span = episode.standing - fallen;
    let head = episode.sim.head()[2] - fallen;
    // A head that falls above standing height is never up.
    if span > 0.0 {
        (head / span).clamp(0.0, 1.0)
    } else {
        0.0
    }
}
