//! Public calls of a simulation, decoded from bytes.

use crate::{
    draw::{any, below, byte, vector},
    laws::{finite, most_evaluations},
    scenes::other_numbers,
};
use arbitrary::Unstructured;
use skate_core::{
    model::{
        Model,
        layout::{NV, ROOT},
    },
    numeric::checksum::checksum,
    scene::{Leg, Scene},
    sim::{Coordinates, Simulation},
};

/// Remaining simulated time and evaluations of an input, so that it runs in milliseconds.
pub struct Budget {
    /// [s]
    time: f64,
    evaluations: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            time: 0.05,
            evaluations: 20_000,
        }
    }
}

impl Budget {
    pub fn is_spent(&self) -> bool {
        self.time <= 0.0 || self.evaluations == 0
    }
}

/// One random call.
pub fn random_call(sim: &mut Simulation, u: &mut Unstructured, budget: &mut Budget) {
    match below(u, 12) {
        0..=3 => advance(sim, u, budget),
        4 | 5 => hold(sim, u),
        6 => reset(sim, u),
        7 => restore(sim, u),
        8 => apply_guard(sim, u),
        9 => evaluate(sim, u),
        10 => set_model(sim, u),
        _ => take(sim),
    }
}

/// Constant residual torques [N m].
fn hold(sim: &mut Simulation, u: &mut Unstructured) {
    const SIZES: [f64; 8] = [0.0, 1.0, 10.0, 100.0, 1e3, 1e6, 1e-310, 5e-324];
    let size = SIZES[below(u, SIZES.len())];
    let mut torque = [0.0; NV];
    if below(u, 2) == 0 {
        torque[below(u, sim.model.n - ROOT)] = size;
    } else {
        torque.fill_with(|| size * f64::from(byte(u) as i8) / 128.0);
    }
    let before = (sim.ended.is_some()).then(|| sim.snapshot());
    sim.hold(&torque[..sim.model.n - ROOT]);
    assert_unchanged_after_end(sim, before);
}

fn advance(sim: &mut Simulation, u: &mut Unstructured, budget: &mut Budget) {
    const STEPS: [f64; 8] = [5e-324, 1e-300, 1e-17, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3];
    let now = sim.state.t;
    let until = match below(u, 4) {
        0 => now + STEPS[below(u, STEPS.len())],
        1 => sim.next_action_time().min(now + 0.02),
        _ => now + 0.02 * f64::from(byte(u)) / 255.0,
    };
    let before = (sim.ended.is_some()).then(|| sim.snapshot());
    // The counters restart if a snapshot of another run has been restored.
    let evaluations = sim.eval.count;
    sim.advance(until);
    let (t, ended) = (sim.state.t, sim.ended);
    assert!(
        (now..=until).contains(&t),
        "from {now} to {t}, {until} requested"
    );
    assert!(t == until || ended.is_some(), "{t} instead of {until}");
    let taken = sim.eval.count - evaluations;
    assert!(
        taken <= most_evaluations(&sim.model, until - now),
        "{taken} evaluations"
    );
    budget.time -= until - now;
    budget.evaluations = budget.evaluations.saturating_sub(taken);
    assert_unchanged_after_end(sim, before);
}

/// A terminated simulation does not change.
fn assert_unchanged_after_end(sim: &Simulation, ended: Option<Vec<u8>>) {
    assert!(ended.is_none_or(|before| before == sim.snapshot()));
}

/// A refused call changes nothing.
fn assert_unchanged_if_refused<T, E>(
    sim: &mut Simulation,
    what: impl FnOnce(&mut Simulation) -> Result<T, E>,
) {
    let before = sim.snapshot();
    if what(sim).is_err() {
        assert!(before == sim.snapshot(), "a refused call changed the state");
    }
}

fn reset(sim: &mut Simulation, u: &mut Unstructured) {
    let (model, n) = (&sim.model, sim.model.n);
    let start = &model.scene.start;
    let from = match below(u, 3) {
        0 => (sim.state.q, sim.state.v),
        _ => (model.from_names(&start.q), model.from_names(&start.v)),
    };
    let q = vector(u, &from.0, n, 1.0);
    let v = vector(u, &from.1, n, 10.0);
    let leg = [Leg::Right, Leg::Left][below(u, 2)];
    assert_unchanged_if_refused(sim, |sim| sim.reset(&q, &v, leg));
}

/// Restoring the own snapshot changes nothing; a damaged snapshot is refused or gives another valid state.
fn restore(sim: &mut Simulation, u: &mut Unstructured) {
    let mut bytes = sim.snapshot();
    sim.restore(&bytes).expect("its own snapshot");
    assert!(
        sim.snapshot() == bytes,
        "restoring the own snapshot changed the state"
    );
    for _ in 0..below(u, 4) {
        let at = u.arbitrary::<u16>().unwrap_or(0) as usize % bytes.len();
        match below(u, 4) {
            0 => bytes.truncate(at.max(1)),
            1 => bytes.insert(at, byte(u)),
            2 => bytes[at] ^= 1 << below(u, 8),
            _ => bytes[at] = byte(u),
        }
    }
    if below(u, 2) == 0 {
        // With a recomputed checksum, to test the checks behind it.
        let sealed = bytes.len().saturating_sub(8);
        let sum = checksum(&bytes[..sealed]).to_le_bytes();
        bytes.splice(sealed.., sum);
    }
    assert_unchanged_if_refused(sim, |sim| sim.restore(&bytes));
}

/// Apply an event at the present state, as an external integrator does.
fn apply_guard(sim: &mut Simulation, u: &mut Unstructured) {
    let (t, Coordinates { q, v }) = (sim.state.t, sim.coordinates());
    let known = sim.guards_at(t, &q, &v).unwrap_or_default();
    let which = below(u, known.len() + 2);
    let name = match known.get(which) {
        Some((guard, _)) => Some(guard.describe()),
        None if which == known.len() => Some("no such guard"),
        None => None,
    };
    assert_unchanged_if_refused(sim, |sim| sim.reset_map(t, &q, &v, name));
}

fn evaluate(sim: &mut Simulation, u: &mut Unstructured) {
    let n = sim.model.n;
    let Coordinates { q, v } = sim.coordinates();
    let q = vector(u, &q, n, 1.0);
    let v = vector(u, &v, n, 10.0);
    let t = any(u, 1.0);
    let before = sim.snapshot();
    if let Ok(accelerations) = sim.accelerations_at(t, &q, &v) {
        finite("accelerations", &accelerations[..n]);
    }
    sim.guards_at(t, &q, &v).ok();
    sim.controller_would_change(t, &q, &v);
    sim.violation();
    sim.energy_residual();
    assert!(before == sim.snapshot(), "an evaluation changed the state");
}

/// Other parameters of the same scene, or another scene, with a new start.
fn set_model(sim: &mut Simulation, u: &mut Unstructured) {
    let scene = match below(u, 4) {
        0 => Scene::default(),
        _ => other_numbers(u, &sim.model.scene),
    };
    let model = Model::compile(&scene).expect("a valid scene compiles");
    let start = (
        model.from_names(&scene.start.q),
        model.from_names(&scene.start.v),
    );
    let mut other = sim.clone();
    assert_unchanged_if_refused(&mut other, |other| other.set_model(model));
    if other.model.scene == scene
        && other
            .reset(&start.0, &start.1, scene.start.support_leg)
            .is_ok()
    {
        *sim = other;
    }
}

fn take(sim: &mut Simulation) {
    let events = sim.take_events();
    for pair in events.windows(2) {
        assert!(pair[0].t <= pair[1].t, "{pair:?}");
    }
    for record in sim.take_records() {
        assert!(
            record.time <= sim.state.t && record.period >= 0.0,
            "{record:?}"
        );
    }
}
