//! Save and continue, bit for bit.

use crate::{
    contact::Solution,
    error::{EndCause, Invalid},
    model::{Model, NV},
    monitor::Monitor,
    scene::Scene,
    sim::{Budget, Simulation, Stats},
    state::State,
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// What `Simulation` cannot compute again. Rates and guards could be, but not to the last bit: the
/// last stage of a step is evaluated at a time that differs from the state's by rounding.
#[derive(Serialize, Deserialize)]
struct Saved {
    /// As JSON: an episode may have other numbers than its scene.
    scene: String,
    state: State,
    stats: Stats,
    ended: Option<EndCause>,
    monitor: Monitor,
    values: Vec<f64>,
    dy: Vec<f64>,
    /// The contacts' `Solution`: after time steps it is the mean over the last one.
    contact: [[f64; 3]; 4],
    residual: [f64; NV],
    budget: Budget,
}

impl Saved {
    /// Is it one that a simulation may have made? What it says is otherwise believed.
    fn check(&self) -> Result<(), &'static str> {
        let Self { state, stats, .. } = self;
        let (ledger, clock) = (&state.ledger, &state.clock);
        let others = [
            state.anchor,
            clock.t0,
            clock.t1,
            clock.t2,
            clock.tau7,
            ledger.start,
            ledger.actuators,
            ledger.damping,
            ledger.friction,
            ledger.impacts,
            ledger.capture,
        ];
        let numbers = [&state.q[..], &state.v, &self.residual, &others].concat();
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err("a number is not finite");
        }
        if !(state.t.abs() <= MOST_TIME && state.h > 0.0 && state.h.is_finite()) {
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

/// First bytes of a snapshot; the digit counts incompatible changes of `Saved`.
const MAGIC: &[u8] = b"IceSkate7";
/// Longest time that a simulation may have run, beyond which its clock has no milliseconds [s].
const MOST_TIME: f64 = 1e9;
/// Most that can have been counted.
const MOST_COUNT: u64 = 1 << 53;

/// Of everything before the last bytes of a snapshot, which hold it: FNV-1a (Fowler, Noll and Vo). One
/// damaged byte never goes unseen.
pub fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, &byte| {
        (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// A value as bytes between a kind's first bytes and a checksum.
pub fn seal(magic: &[u8], saved: &impl Serialize) -> Vec<u8> {
    let mut bytes = postcard::to_extend(saved, magic.to_vec()).expect("plain numbers");
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
        let Solution {
            a_root,
            f_root,
            a_free,
            lam,
        } = self.eval.solution;
        let saved = Saved {
            scene: self.model.scene.to_json(),
            state: self.state,
            stats: self.stats,
            ended: self.ended,
            monitor: self.monitor,
            values: self.values.to_vec(),
            dy: self.dy.to_vec(),
            contact: [a_root, f_root, a_free, lam].map(Into::into),
            residual: self.residual,
            budget: self.budget,
        };
        seal(MAGIC, &saved)
    }

    /// Go back to a snapshot of a simulation of the same scene.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where the bytes are damaged or of another kind.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        let damaged = |why: &str| Invalid(format!("not a snapshot of this scene: {why}"));
        let saved: Saved = open(MAGIC, bytes).map_err(|why| damaged(&why))?;
        saved.check().map_err(damaged)?;
        let (Ok(values), Ok(dy)) = (saved.values.try_into(), saved.dy.try_into()) else {
            return Err(damaged("wrong lengths"));
        };
        let mut back = self.clone();
        let scene = Scene::from_json(&saved.scene)?;
        let own = &self.model.scene;
        if scene != *own {
            let known = own.parameters();
            let values = known.iter().map(|p| (p.name.as_str(), p.value));
            if scene.with_values(values).as_ref() != Ok(own) {
                return Err(damaged("more than its numbers is different"));
            }
            back.exchange(Model::compile(&scene)?)?;
        }
        let mut mode = saved.state.mode;
        // Either is possible where a foot slides in two-way contact.
        (mode.support.pulled, mode.free.pulled) = (false, false);
        if !back.model.modes().contains(&mode) {
            return Err(damaged("no such contact state"));
        }
        back.state = saved.state;
        back.stats = saved.stats;
        back.ended = saved.ended;
        back.monitor = saved.monitor;
        back.residual = saved.residual;
        back.budget = saved.budget;
        if back.begin_mode().is_err() && back.ended.is_none() {
            return Err(damaged("its state has no motion"));
        }
        back.eval.count = saved.stats.evaluations;
        back.implicit.count = saved.stats.factorisations;
        (back.values, back.dy) = (values, dy);
        let [a_root, f_root, a_free, lam] = saved.contact.map(Into::into);
        back.eval.solution = Solution {
            a_root,
            f_root,
            a_free,
            lam,
        };
        *self = back;
        Ok(())
    }
}
