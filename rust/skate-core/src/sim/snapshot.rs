//! Save and continue, bit for bit.

use crate::{
    contact::equations::Solution,
    error::{Invalid, Termination},
    events::guards::MOST,
    model::{Model, layout::NV, state::State},
    numeric::checksum::checksum,
    sim::{Budget, NY, Simulation, Stats, gait_statistics::Monitor},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::sync::Arc;

/// What `Simulation` cannot compute again. Rates and guards could be, but not to the last bit: the
/// last stage of a step is evaluated at a time that differs from the state's by rounding.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Kept {
    state: State,
    stats: Stats,
    ended: Option<Termination>,
    monitor: Monitor,
    #[serde(with = "list")]
    values: [f64; MOST],
    #[serde(with = "list")]
    dy: [f64; NY],
    /// The contacts' `Solution`: after time steps it is the mean over the last one.
    contact: [[f64; 3]; 4],
    averaged: f64,
    jumped: bool,
    residual: [f64; NV],
    budget: Budget,
}

/// A simulation to go on with, whatever the numbers of its episode.
#[derive(Serialize, Deserialize)]
pub(crate) struct Saved {
    /// Of the scene, all but whose numbers is the same wherever this is taken.
    kind: u64,
    numbers: Vec<f64>,
    kept: Kept,
}

/// Lists of any length; serde itself knows them up to 32.
mod list {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer>(list: &[f64], to: S) -> Result<S::Ok, S::Error> {
        list.serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const N: usize>(
        from: D,
    ) -> Result<[f64; N], D::Error> {
        let list = Vec::deserialize(from)?;
        list.try_into().map_err(|_| Error::custom("wrong lengths"))
    }
}

impl Kept {
    /// Is it one that a simulation may have made? What it says is otherwise believed.
    fn check(&self) -> Result<(), &'static str> {
        let Self { state, stats, .. } = self;
        let (energy_balance, controller) = (&state.energy_balance, &state.controller);
        let others = [
            state.anchor,
            self.averaged,
            controller.t0,
            controller.t1,
            controller.t2,
            controller.tau7,
            energy_balance.start,
            energy_balance.actuators,
            energy_balance.kicks,
            energy_balance.damping,
            energy_balance.friction,
            energy_balance.impacts,
            energy_balance.capture,
        ];
        let numbers = [&state.q[..], &state.v, &self.residual, &others].concat();
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err("a number is not finite");
        }
        let steps = state.h > 0.0 && state.h.is_finite() && self.averaged >= 0.0;
        if !(steps && state.t.abs() <= MOST_TIME) {
            return Err("its time or its step is out of range");
        }
        let counts = [
            stats.steps,
            stats.rejections,
            stats.evaluations,
            stats.events,
            stats.root_iterations,
            stats.projections,
            stats.factorisations,
        ];
        if counts.iter().any(|&n| n > MOST_COUNT) {
            return Err("it has counted too much");
        }
        Ok(())
    }
}

/// First bytes of a snapshot; the number counts incompatible changes of `Saved`.
const MAGIC: &[u8] = b"IceSkate10";
/// Longest time that a simulation may have run, beyond which its clock has no milliseconds [s].
const MOST_TIME: f64 = 1e9;
/// Room that most snapshots find enough [bytes].
const USUAL: usize = 4096;
/// Most that can have been counted.
const MOST_COUNT: u64 = 1 << 53;

/// A value as bytes between a kind's first bytes and a checksum.
pub fn seal(magic: &[u8], saved: &impl Serialize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(USUAL);
    bytes.extend(magic);
    let mut bytes = postcard::to_extend(saved, bytes).expect("plain numbers");
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// What `seal` was given.
///
/// # Errors
/// Why the bytes are not of that kind, or damaged.
pub fn open<T: DeserializeOwned>(magic: &[u8], bytes: &[u8]) -> Result<T, String> {
    let body = bytes.strip_prefix(magic).ok_or("unknown beginning")?;
    let (body, sum) = body.split_last_chunk().ok_or("too short")?;
    if u64::from_le_bytes(*sum) != checksum(&bytes[..bytes.len() - sum.len()]) {
        return Err("its checksum is another".into());
    }
    let (saved, rest) = postcard::take_from_bytes(body).map_err(|e| e.to_string())?;
    if !rest.is_empty() {
        return Err(format!("{} bytes too many", rest.len()));
    }
    Ok(saved)
}

impl Simulation {
    /// Everything needed to continue; events and steps not yet taken are not part of it.
    pub fn snapshot(&self) -> Vec<u8> {
        seal(MAGIC, &self.saved())
    }

    /// Go back to a snapshot of a simulation of the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let saved: Saved = open(MAGIC, bytes).map_err(|why| damaged(&why))?;
        self.restore_saved(&saved)
    }

    /// The same before it becomes bytes.
    pub(crate) fn saved(&self) -> Saved {
        Saved {
            kind: self.model.kind,
            numbers: self.model.scene.numbers(),
            kept: self.kept(),
        }
    }

    /// See `restore`.
    pub(crate) fn restore_saved(&mut self, saved: &Saved) -> Result<(), Invalid> {
        saved.kept.check().map_err(damaged)?;
        if saved.kind != self.model.kind {
            return Err(damaged("more than its numbers is different"));
        }
        let model = self.renumbered(&saved.numbers)?;
        let mut mode = saved.kept.state.mode;
        // Either is possible where a foot slides in two-way contact.
        (mode.support.pulled, mode.free.pulled) = (false, false);
        if !model.allows(mode) {
            return Err(damaged("no such contact state"));
        }
        let present = self.present();
        self.exchange(model)?;
        if self.put(&saved.kept).is_err() && self.ended.is_none() {
            self.put_back(present);
            return Err(damaged("its state has no motion"));
        }
        Ok(())
    }

    /// The model with these numbers, which is its own where they are.
    fn renumbered(&self, numbers: &[f64]) -> Result<Arc<Model>, Invalid> {
        let own = self.model.scene.numbers();
        if own.len() != numbers.len() {
            return Err(damaged("wrong lengths"));
        }
        let mut pairs = own.iter().zip(numbers);
        if pairs.all(|(own, other)| own.to_bits() == other.to_bits()) {
            return Ok(Arc::clone(&self.model));
        }
        let scene = self.model.scene.with_numbers(numbers);
        Ok(Arc::new(if self.model.scene.may_draw(numbers) {
            // What the ranges allow has been checked with them.
            self.model.renumbered(scene)
        } else {
            Model::compile(&scene)?
        }))
    }

    pub(crate) fn kept(&self) -> Kept {
        let Solution {
            a_root,
            f_root,
            a_free,
            lam,
        } = self.eval.solution;
        Kept {
            state: self.state,
            stats: self.stats,
            ended: self.ended,
            monitor: self.monitor,
            values: self.values,
            dy: self.dy,
            contact: [a_root, f_root, a_free, lam].map(Into::into),
            averaged: self.averaged,
            jumped: self.jumped,
            residual: self.residual,
            budget: self.budget,
        }
    }

    /// Go on with what was kept.
    ///
    /// # Errors
    /// Why there is no motion, as is normal where it had ended.
    pub(crate) fn put(&mut self, kept: &Kept) -> Result<(), Termination> {
        self.state = kept.state;
        self.stats = kept.stats;
        self.ended = kept.ended;
        self.monitor = kept.monitor;
        self.residual = kept.residual;
        self.budget = kept.budget;
        let begun = self.begin_mode();
        self.eval.count = kept.stats.evaluations;
        self.implicit.count = kept.stats.factorisations;
        self.update_counters();
        (self.values, self.dy) = (kept.values, kept.dy);
        let [a_root, f_root, a_free, lam] = kept.contact.map(Into::into);
        self.eval.solution = Solution {
            a_root,
            f_root,
            a_free,
            lam,
        };
        (self.averaged, self.jumped) = (kept.averaged, kept.jumped);
        begun
    }
}

fn damaged(why: &str) -> Invalid {
    Invalid(format!("not a snapshot of this scene: {why}"))
}
