//! Reinforcement-learning task of `IceSkate-v0`: actions, observations, rewards and starts.

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

/// Properties that all episodes of an environment share.
#[derive(Debug, Clone)]
pub struct Task {
    /// Compiled scene, shared by all episodes with the scene's own parameters.
    pub model: Arc<Model>,
    /// Residual torque of a full action, per joint [N m].
    pub scale: Vec<f64>,
    /// Limit on the total torque of a joint due to an action; the baseline's own torque may exceed it [N
    /// m].
    pub torque_limit: f64,
    pub weights: Weights,
    /// Standard deviation of the disturbance of every start; see `perturbed`.
    pub perturb: f64,
    /// Standard deviation of the noise on angles and rates of the trunk's yaw and roll at every start [rad,
    /// rad/s].
    pub trunk_noise: f64,
    /// Change of velocity per random kick [m/s]; 0 for none.
    pub kick: f64,
    /// Number of actions after which an episode is truncated.
    pub limit: Option<u64>,
    /// Entries of an observation.
    pub observation: Vec<Entry>,
    /// Bounds of the entries, as arrays.
    pub bounds: Bounds,
}

impl Task {
    /// Task on a scene, without disturbances and without a limit.
    ///
    /// # Errors
    /// `Invalid` unless there is one finite scale per joint of the scene.
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

    /// Scene of the task; episodes may have other parameters.
    pub fn scene(&self) -> &Scene {
        &self.model.scene
    }

    /// Action period [s].
    pub fn action_period(&self) -> f64 {
        self.scene().control.action_period
    }

    /// Check that the disturbances are valid for the model.
    pub(crate) fn check_disturbances(&self) -> Result<(), Invalid> {
        check_perturb(self.perturb)?;
        check_trunk_noise(self.trunk_noise, &self.model)?;
        check_kick("kick", self.kick, 0.0, &self.model)
    }

    /// Number of entries of an action.
    pub fn joints(&self) -> usize {
        self.scale.len()
    }
}
