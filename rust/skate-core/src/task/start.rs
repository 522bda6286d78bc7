//! Starts of episodes: domain randomisation, disturbed starts, phases of the gait.

use crate::{
    error::{Invalid, MessageNumber},
    model::{
        Model,
        layout::{NV, ROOT},
    },
    numeric::random::normal,
    scene::Leg,
    sim::Simulation,
    task::{Episode, Task},
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::{collections::BTreeMap, sync::Arc};

/// Maximum number of draws. If the free foot of a start is just above the ice, about half of all draws are below it and
/// not valid.
const ATTEMPTS: usize = 100;
/// Joints q2 to q7.
const LEGS: std::ops::Range<usize> = ROOT..ROOT + 6;
/// Yaw and roll of the trunk.
const TRUNK: [&str; 2] = ["q8", "q10"];
/// Maximum period of a gait step [s]. A robot without a step for this long may never make one.
const LONGEST_STEP: f64 = 20.0;
/// Maximum phase: number of gait steps before an episode.
const MAX_PHASE: f64 = 1000.0;

/// Start of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StartState {
    q: [f64; NV],
    v: [f64; NV],
    leg: Leg,
}

impl StartState {
    /// The scene's start.
    fn of(model: &Model) -> Self {
        let start = &model.scene.start;
        Self {
            q: model.from_names(&start.q),
            v: model.from_names(&start.v),
            leg: start.support_leg,
        }
    }

    /// Replace the parts that are given.
    fn with(mut self, given: &StateOverride) -> Self {
        self.q = given.q.unwrap_or(self.q);
        self.v = given.v.unwrap_or(self.v);
        self.leg = given.leg.unwrap_or(self.leg);
        self
    }

    /// Add normal noise to the angles (`sigma` rad) and rates (`sigma` rad/s) of the legs, and multiply the
    /// skating speed by 1 + `sigma` n with n standard normal.
    fn disturb(&mut self, sigma: f64, rng: &mut impl Rng) {
        if sigma > 0.0 {
            self.add_noise(LEGS, sigma, rng);
            self.v[0] *= 1.0 + sigma * normal(rng);
        }
    }

    /// Add normal noise to the angles (`sigma` rad) and rates (`sigma` rad/s) of joints.
    fn add_noise(
        &mut self,
        joints: impl Iterator<Item = usize> + Clone,
        sigma: f64,
        rng: &mut impl Rng,
    ) {
        let mut normal = || sigma * normal(rng);
        joints.clone().for_each(|c| self.q[c] += normal());
        joints.for_each(|c| self.v[c] += normal());
    }
}

/// Given parts of a start; the others are those of the scene.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StateOverride {
    pub q: Option<[f64; NV]>,
    pub v: Option<[f64; NV]>,
    pub leg: Option<Leg>,
}

/// Options of a reset.
#[derive(Debug, Clone, Default)]
pub struct Start {
    /// Seed of the random numbers; None continues the present sequence.
    pub seed: Option<u64>,
    /// Parts of the state that replace the scene's start.
    pub state: StateOverride,
    /// Parameters of this episode, named as in `Scene::parameters`; they override drawn ones.
    pub params: BTreeMap<String, f64>,
    /// Gait steps of the baseline before the episode, including a fraction of the last one.
    pub phase: f64,
    /// Overrides the task's value; a given state is disturbed only if this is set.
    pub perturb: Option<f64>,
    /// Number of actions that count as done with respect to the task's limit.
    pub elapsed: u64,
}

/// Check the standard deviation of a disturbance.
pub(super) fn check_perturb(sigma: f64) -> Result<(), Invalid> {
    Invalid::range("perturb", sigma, 0.0, 10.0, "rad, rad/s, 1")
}

/// Check the standard deviation of the trunk noise for the model.
pub(super) fn check_trunk_noise(sigma: f64, model: &Model) -> Result<(), Invalid> {
    Invalid::range("trunk_noise", sigma, 0.0, 1.0, "rad, rad/s")?;
    if sigma > 0.0 && trunk(model).next().is_none() {
        return Err(Invalid(format!(
            "trunk_noise = {}: must be 0 where the scene locks both q8 and q10",
            MessageNumber(sigma)
        )));
    }
    Ok(())
}

/// Coordinates of the trunk's yaw and roll that are not locked.
pub(super) fn trunk(model: &Model) -> impl Iterator<Item = usize> + Clone + '_ {
    let names = model.names.iter().enumerate();
    names.filter_map(|(c, &name)| TRUNK.contains(&name).then_some(c))
}

/// Reset to a disturbed start: the first valid draw for the seed. A draw with a foot below the ice is not
/// valid and is repeated.
///
/// # Errors
/// `Invalid`, and nothing has changed, if no draw is valid.
pub fn perturbed(sim: &mut Simulation, sigma: f64, seed: u64) -> Result<(), Invalid> {
    check_perturb(sigma)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scene_start = StartState::of(&sim.model);
    let mut next = sim.draft();
    let attempts = if sigma > 0.0 { ATTEMPTS } else { 1 };
    retry_draws(attempts, &|| true, || {
        let mut state = scene_start;
        state.disturb(sigma, &mut rng);
        next.reset_in_place(&state.q, &state.v, state.leg)
    })?;
    sim.replace(next);
    Ok(())
}

/// Call `reset` until it succeeds, or `go_on` returns false, at most `attempts` times.
fn retry_draws(
    attempts: usize,
    go_on: &dyn Fn() -> bool,
    mut reset: impl FnMut() -> Result<(), Invalid>,
) -> Result<(), Invalid> {
    let mut last = reset();
    for _ in 1..attempts {
        if last.is_ok() || !go_on() {
            break;
        }
        last = reset();
    }
    last.map_err(|Invalid(error)| {
        if attempts > 1 {
            Invalid(format!(
                "{ATTEMPTS} draws gave no valid start; of the last: {error}"
            ))
        } else {
            Invalid(error)
        }
    })
}

/// Model of an episode: the task's own, or one with other parameters. `present` is reused if it has these.
fn model(
    task: &Task,
    start: &Start,
    present: &Arc<Model>,
    rng: &mut impl Rng,
) -> Result<Arc<Model>, Invalid> {
    let ranges = &task.scene().randomise;
    if ranges.is_empty() && start.params.is_empty() {
        return Ok(Arc::clone(&task.model));
    }
    let mut scene = task.scene().clone();
    for (name, &[low, high]) in ranges {
        let x = (low + (high - low) * rng.random::<f64>()).min(high);
        let number = scene.number_mut(name).expect("checked with the ranges");
        *number = x;
    }
    if start.params.is_empty() {
        // Parameters inside the ranges have been validated with the ranges.
        return Ok(Arc::new(task.model.renumbered(scene)));
    }
    if start.params.contains_key("control.action_period") {
        return Err(Invalid(
            "params: control.action_period is the same for all episodes; give it as a keyword"
                .into(),
        ));
    }
    let given = start.params.iter().map(|(name, &x)| (name.as_str(), x));
    scene.randomise.clear();
    scene = scene.with_values(given)?;
    scene.randomise.clone_from(ranges);
    Ok(if scene == present.scene {
        Arc::clone(present)
    } else {
        Arc::new(Model::compile(&scene)?)
    })
}

/// Reset the simulation of an episode.
///
/// # Errors
/// `Invalid` if the start is not valid, or `go_on` has returned false; the simulation has changed.
pub(super) fn reset(
    task: &Task,
    start: &Start,
    episode: &mut Episode,
    go_on: &dyn Fn() -> bool,
) -> Result<(), Invalid> {
    let scene_start = start.state == StateOverride::default();
    let sigma = match start.perturb {
        Some(sigma) => sigma,
        None if scene_start => task.perturb,
        None => 0.0,
    };
    let noise = if scene_start { task.trunk_noise } else { 0.0 };
    check_perturb(sigma)?;
    Invalid::range("phase", start.phase, 0.0, MAX_PHASE, "steps")?;
    let Episode { sim, random, .. } = episode;
    let rng = &mut random.rng;
    let drawn = sigma > 0.0 || noise > 0.0 || !task.scene().randomise.is_empty();
    retry_draws(if drawn { ATTEMPTS } else { 1 }, go_on, || {
        let model = model(task, start, &sim.model, rng)?;
        if !Arc::ptr_eq(&model, &sim.model) {
            sim.set_model(model)?;
        }
        let mut state = StartState::of(&sim.model).with(&start.state);
        state.disturb(sigma, rng);
        if noise > 0.0 {
            state.add_noise(trunk(&task.model), noise, rng);
        }
        sim.reset_in_place(&state.q, &state.v, state.leg)?;
        advance_to_phase(sim, start.phase, go_on)
    })
}

/// Advance the baseline to a phase of its gait: a number of gait steps and a fraction of the next one,
/// rounded to the nearest action period. `go_on` is called before every action.
fn advance_to_phase(
    sim: &mut Simulation,
    phase: f64,
    go_on: &dyn Fn() -> bool,
) -> Result<(), Invalid> {
    if phase == 0.0 {
        return Ok(());
    }
    let whole = phase.floor() as usize;
    let mut ahead = sim.clone();
    // Times of the steps' ends, preceded by the start.
    let mut ends = vec![0.0];
    while ends.len() < whole + 2 {
        let last = ends[ends.len() - 1];
        if ahead.ended.is_some() || ahead.state.t - last > LONGEST_STEP {
            let cause = ahead.ended.map_or("no_step", |cause| cause.name());
            return Err(Invalid(format!(
                "phase = {}: the baseline makes only {} steps and ends with {cause}",
                MessageNumber(phase),
                ends.len() - 1
            )));
        }
        if !go_on() {
            return Err(interrupted());
        }
        ahead.advance(ahead.next_action_time());
        ends.extend(ahead.take_records().iter().map(|record| record.time));
    }
    let (from, to) = (ends[whole], ends[whole + 1]);
    let period = sim.model.scene.control.action_period;
    let until = from + (phase - phase.floor()) * (to - from);
    for _ in 0..(until / period).round() as u64 {
        if !go_on() {
            return Err(interrupted());
        }
        sim.advance(sim.next_action_time());
    }
    sim.take_events();
    sim.take_records();
    sim.reset_totals();
    Ok(())
}

fn interrupted() -> Invalid {
    Invalid("the reset has been interrupted".into())
}
