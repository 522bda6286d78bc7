//! Reinforcement-learning task of `IceSkate-v0`: actions, observations, rewards and starts.

mod action;
mod derivatives;
mod episode;
mod kicks;
mod mirror;
mod observe;
mod observe_derivatives;
mod reward;
mod start;
mod weights;

use crate::{
    error::Invalid,
    model::{Model, layout::ROOT},
    scene::{Leg, Scene},
    sim::check_kick,
};
pub use derivatives::{ActionDerivatives, MEMORY};
pub use episode::{ActionResult, ActionStart, Episode, EpisodeStatus, Info};
pub use mirror::Mirror;
pub use observe::{Bounds, Entry, observation};
pub use start::{Start, StateOverride, perturbed};
use start::{check_perturb, check_trunk_noise};
use std::sync::Arc;
pub use weights::{TERMS, WEIGHTS, Weights};

/// Properties that all episodes of an environment share.
#[derive(Debug, Clone)]
pub struct Task {
    /// Compiled scene, shared by all episodes with the scene's own parameters.
    pub model: Arc<Model>,
    /// Residual torque of a full action, per joint of the scene [N m].
    pub scale: Vec<f64>,
    /// Joint of each entry of an action.
    pub chosen: Vec<usize>,
    /// Present if states with left support are mirrored.
    pub mirror: Option<Mirror>,
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
    /// Task on a scene with actions for all joints, not mirrored, without disturbances and without a limit.
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
        let observation = observe::entries(&model);
        Ok(Self {
            bounds: Bounds::of(&observation),
            observation,
            torque_limit: f64::INFINITY,
            perturb: 0.0,
            trunk_noise: 0.0,
            kick: 0.0,
            limit: None,
            chosen: (0..joints).collect(),
            mirror: None,
            model,
            scale,
            weights,
        })
    }

    /// The same with actions for some joints only, by name.
    ///
    /// # Errors
    /// `Invalid` for a joint that is locked, unknown or named twice, and without any joint.
    pub fn with_joints(mut self, names: &[String]) -> Result<Self, Invalid> {
        let known = self.all_joints();
        let mut chosen = Vec::new();
        for name in names {
            let found = known.iter().position(|known| known == name);
            let Some(i) = found.filter(|i| !chosen.contains(i)) else {
                let known = known.join(", ");
                let message = format!("joints: {name:?}: must be one of {known}, each once");
                return Err(Invalid(message));
            };
            chosen.push(i);
        }
        if chosen.is_empty() {
            return Err(Invalid("joints: none: must be at least one".into()));
        }
        self.chosen = chosen;
        Ok(self)
    }

    /// The same with states with left support shown and acted on in the mirror.
    ///
    /// # Errors
    /// `Invalid` if the scene locks a joint of one arm only.
    pub fn with_mirror(mut self) -> Result<Self, Invalid> {
        self.mirror = Some(Mirror::new(self.all_joints(), &self.observation)?);
        Ok(self)
    }

    /// The mirror, if states with this supporting leg are mirrored.
    fn mirror_for(&self, leg: Leg) -> Option<&Mirror> {
        self.mirror.as_ref().filter(|_| leg == Leg::Left)
    }

    /// Names of all joints with a torque.
    fn all_joints(&self) -> &[&'static str] {
        &self.model.names[ROOT..self.model.n]
    }

    /// Names of the joints of an action, in its order.
    pub fn joint_names(&self) -> Vec<&'static str> {
        let all = self.all_joints();
        self.chosen.iter().map(|&i| all[i]).collect()
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
        self.chosen.len()
    }
}
