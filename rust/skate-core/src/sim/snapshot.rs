//! Snapshots: saving and restoring a simulation, bit for bit.

use crate::{
    contact::equations::Solution,
    error::{Invalid, Termination},
    events::guards::MAX_GUARDS,
    model::{Model, layout::NV, state::State},
    numeric::checksum::checksum,
    sim::{Budget, NY, Simulation, Stats, gait_statistics::GaitMonitor},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{mem, sync::Arc};

/// The part of `Simulation` that cannot be recomputed. Rates and guard values can, but not to the last bit:
/// the last stage of a step is evaluated at a time that differs from the state's by rounding.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct SnapshotState {
    state: State,
    stats: Stats,
    ended: Option<Termination>,
    monitor: GaitMonitor,
    #[serde(with = "list")]
    values: [f64; MAX_GUARDS],
    #[serde(with = "list")]
    dy: [f64; NY],
    /// Contact `Solution`; after time-stepping, its mean over the last step.
    contact: [[f64; 3]; 4],
    averaging_time: f64,
    torque_jumped: bool,
    residual: [f64; NV],
    budget: Budget,
}

/// Contents of a snapshot, including the parameters of the episode.
#[derive(Serialize, Deserialize)]
pub(crate) struct Snapshot {
    /// Hash of the scene without its parameters.
    kind: u64,
    numbers: Vec<f64>,
    contents: SnapshotState,
}

/// Arrays of any length; serde supports up to 32 entries.
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

impl Snapshot {
    /// May its simulation have this number?
    pub(crate) fn allows(&self, x: f64) -> bool {
        self.contents.allows(x)
    }
}

impl SnapshotState {
    /// May the simulation have this number? It is finite, and far from overflow if the simulation goes on.
    fn allows(&self, x: f64) -> bool {
        x.abs() <= self.ended.map_or(LARGEST, |_| f64::MAX)
    }

    /// Check that a simulation may have produced these values. Every number is finite and far from overflow.
    fn check(&self) -> Result<(), &'static str> {
        let Self {
            state,
            stats,
            ended: _,
            monitor,
            values,
            dy,
            contact,
            averaging_time,
            torque_jumped: _,
            residual,
            budget,
        } = self;
        let lists = [&values[..], dy, residual, contact.as_flattened()].concat();
        let parts = state.numbers().chain(monitor.numbers());
        let numbers = parts.chain(budget.numbers()).chain(lists);
        let mut numbers = numbers.chain([*averaging_time]);
        if !numbers.all(|x| self.allows(x)) || !stats.error_estimate.is_finite() {
            return Err("a number is out of range");
        }
        let steps = state.h > 0.0 && *averaging_time >= 0.0;
        if !(steps && state.t.abs() <= MAX_TIME) {
            return Err("the time or the step size is out of range");
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
        if counts.iter().any(|&n| n > MAX_COUNT) {
            return Err("a counter is out of range");
        }
        Ok(())
    }
}

/// First bytes of a snapshot; the number counts incompatible changes of `Snapshot`.
const MAGIC: &[u8] = b"IceSkate11";
/// Maximum simulated time [s], beyond which the time no longer resolves milliseconds.
const MAX_TIME: f64 = 1e9;
/// Maximum size of a number of a simulation that goes on: products of several stay finite.
const LARGEST: f64 = 1e40;
/// Initial capacity; sufficient for most snapshots [bytes].
const INITIAL_CAPACITY: usize = 4096;
/// Maximum value of a counter.
const MAX_COUNT: u64 = 1 << 53;

/// Serialise a value between magic bytes and a checksum.
pub fn seal(magic: &[u8], saved: &impl Serialize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(INITIAL_CAPACITY);
    bytes.extend(magic);
    let mut bytes = postcard::to_extend(saved, bytes).expect("plain numbers");
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// Inverse of `seal`.
///
/// # Errors
/// A message if the bytes are of another kind or damaged.
pub fn open<T: DeserializeOwned>(magic: &[u8], bytes: &[u8]) -> Result<T, String> {
    let body = bytes.strip_prefix(magic).ok_or("unknown format")?;
    let (body, sum) = body.split_last_chunk().ok_or("too short")?;
    if u64::from_le_bytes(*sum) != checksum(&bytes[..bytes.len() - sum.len()]) {
        return Err("the checksum does not match".into());
    }
    let (saved, rest) = postcard::take_from_bytes(body).map_err(|e| e.to_string())?;
    if !rest.is_empty() {
        return Err(format!("{} trailing bytes", rest.len()));
    }
    Ok(saved)
}

impl Simulation {
    /// Everything needed to continue, except events and gait steps not yet taken.
    pub fn snapshot(&self) -> Vec<u8> {
        seal(MAGIC, &self.to_snapshot())
    }

    /// Restore a snapshot of a simulation of the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let saved: Snapshot = open(MAGIC, bytes).map_err(|error| damaged(&error))?;
        self.restore_snapshot(&saved)
    }

    /// Snapshot before serialisation.
    pub(crate) fn to_snapshot(&self) -> Snapshot {
        Snapshot {
            kind: self.model.kind,
            numbers: self.model.scene_numbers.clone(),
            contents: self.snapshot_state(),
        }
    }

    /// See `restore`.
    pub(crate) fn restore_snapshot(&mut self, saved: &Snapshot) -> Result<(), Invalid> {
        saved.contents.check().map_err(damaged)?;
        if saved.kind != self.model.kind {
            return Err(damaged("the scenes differ in more than their numbers"));
        }
        let model = self.renumbered(&saved.numbers)?;
        let mut mode = saved.contents.state.mode;
        // A sliding foot in two-way contact may have either value.
        (mode.support.pulled, mode.free.pulled) = (false, false);
        if !model.modes().contains(&mode) {
            return Err(damaged("the scene does not have its contact state"));
        }
        let mut draft = self.draft();
        draft.set_model(model)?;
        if draft.load_state(&saved.contents).is_err() && draft.ended.is_none() {
            return Err(damaged("no motion is possible from its state"));
        }
        mem::swap(&mut draft.events, &mut self.events);
        mem::swap(&mut draft.records, &mut self.records);
        *self = draft;
        Ok(())
    }

    /// Model with the given parameters; the present one if they are equal.
    fn renumbered(&self, numbers: &[f64]) -> Result<Arc<Model>, Invalid> {
        let present = &self.model.scene_numbers;
        if present.len() != numbers.len() {
            return Err(damaged("wrong lengths"));
        }
        let mut pairs = present.iter().zip(numbers);
        if pairs.all(|(present, new)| present.to_bits() == new.to_bits()) {
            return Ok(Arc::clone(&self.model));
        }
        let scene = self.model.scene.with_numbers(numbers);
        Ok(Arc::new(if self.model.scene.may_draw(numbers) {
            // Parameters inside the ranges have been validated with the ranges.
            self.model.renumbered(scene)
        } else {
            Model::compile(&scene)?
        }))
    }

    pub(crate) fn snapshot_state(&self) -> SnapshotState {
        let solution = &self.eval.solution;
        let contact = [
            solution.a_root,
            solution.f_root,
            solution.a_free,
            solution.lam,
        ];
        SnapshotState {
            state: self.state,
            stats: self.stats,
            ended: self.ended,
            monitor: self.monitor,
            values: self.values.map(kept),
            dy: self.dy.map(kept),
            contact: contact.map(|of| <[f64; 3]>::from(of).map(kept)),
            averaging_time: self.averaging_time,
            torque_jumped: self.torque_jumped,
            residual: self.residual,
            budget: self.budget,
        }
    }

    /// Load a state.
    ///
    /// # Errors
    /// The cause of termination if there is no motion, as is usual for a terminated simulation.
    pub(crate) fn load_state(&mut self, contents: &SnapshotState) -> Result<(), Termination> {
        self.state = contents.state;
        self.stats = contents.stats;
        self.ended = contents.ended;
        self.monitor = contents.monitor;
        self.residual = contents.residual;
        self.budget = contents.budget;
        self.observe_beginning();
        let done = self.begin_mode();
        self.eval.count = contents.stats.evaluations;
        self.implicit.count = contents.stats.factorisations;
        self.update_counters();
        (self.values, self.dy) = (contents.values, contents.dy);
        let [a_root, f_root, a_free, lam] = contents.contact.map(Into::into);
        self.eval.solution = Solution {
            a_root,
            f_root,
            a_free,
            lam,
        };
        (self.averaging_time, self.torque_jumped) =
            (contents.averaging_time, contents.torque_jumped);
        done
    }
}

/// After a termination rates and forces may be out of range; nothing continues from them.
fn kept(x: f64) -> f64 {
    if x.abs() <= LARGEST { x } else { 0.0 }
}

fn damaged(error: &str) -> Invalid {
    Invalid(format!("not a snapshot of this scene: {error}"))
}
