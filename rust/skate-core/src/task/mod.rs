//! What a learner is asked to do: actions, observations, rewards and starts of `IceSkate-v0`.

mod action;
mod episode;
mod kicks;
mod observe;
mod reward;
mod start;

use crate::{
    error::Invalid,
    model::{Model, layout::ROOT},
    scene::Scene,
    sim::check_kick,
};
pub(crate) use episode::RollbackState;
pub use episode::{ActionResult, ActionStart, Episode, EpisodeStatus, Info};
pub use observe::{Bounds, Entry, observation};
pub use reward::{TERMS, Weights};
pub use start::{Start, StateOverride, perturbed};
use start::{check_perturb, check_trunk_noise};
use std::sync::Arc;

/// What all episodes of an environment share.
#[derive(Debug, Clone)]
pub struct Task {
    /// Of the scene, shared by all episodes that have its numbers.
    pub model: Arc<Model>,
    /// Residual torque of a full action, joint by joint [N m].
    pub scale: Vec<f64>,
    /// An action may not take a joint beyond this torque, or beyond the baseline's own [N m].
    pub torque_limit: f64,
    pub weights: Weights,
    /// Size of the disturbance of every start; see `perturbed`.
    pub perturb: f64,
    /// Normal noise on angles and rates of the trunk's yaw and roll at every start [rad, rad/s].
    pub trunk_noise: f64,
    /// Somebody pushes now and then: by as much the robot's velocity changes [m/s].
    pub kick: f64,
    /// Actions after which an episode is truncated.
    pub limit: Option<u64>,
    /// What an observation consists of.
    pub observation: Vec<Entry>,
    /// Its bounds, close together.
    pub bounds: Bounds,
}

impl Task {
    /// An environment's task on a scene: no disturbance, no limit.
    ///
    /// # Errors
    /// `Invalid` where there is not one scale for every joint of the scene, or one is not finite.
    pub fn new(scene: Scene, scale: Vec<f64>, weights: Weights) -> Result<Self, Invalid> {
        let model = Arc::new(Model::compile(&scene)?);
        let joints = model.n - ROOT;
        if scale.len() != joints {
            let given = scale.len();
            return Err(Invalid(format!(
                "{given} action scales: must be {joints}, one per joint"
            )));
        }
        for (name, &x) in model.names[ROOT..].iter().zip(&scale) {
            Invalid::range(&format!("action_scale[{name}]"), x, 0.0, 1e6, "N m")?;
        }
        weights.check()?;
        let observation = observe::entries(&model);
        Ok(Self {
            bounds: Bounds::of(&observation),
            observation,
            torque_limit: f64::INFINITY,
            perturb: 0.0,
            trunk_noise: 0.0,
            kick: 0.0,
            limit: None,
            model,
            scale,
            weights,
        })
    }

    /// As given; episodes may have other numbers.
    pub fn scene(&self) -> &Scene {
        &self.model.scene
    }

    /// How long an action is held [s].
    pub fn action_period(&self) -> f64 {
        self.scene().control.action_period
    }

    /// Can episodes be disturbed like this?
    pub(crate) fn check_disturbances(&self) -> Result<(), Invalid> {
        check_perturb(self.perturb)?;
        check_trunk_noise(self.trunk_noise, &self.model)?;
        check_kick("kick", self.kick, 0.0, &self.model)
    }

    /// Numbers of an action.
    pub fn joints(&self) -> usize {
        self.scale.len()
    }
}
