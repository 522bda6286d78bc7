//! Time steps of many simulations in SIMD lanes. Simulations in the same contact mode share a register.

use crate::{
    control::ControllerInput,
    dynamics::delassus::rows,
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, Foot},
        lanes::{Broadcast, ModelLanes, PerLane},
        layout::NV,
    },
    numeric::{
        scalar::{MAX_LANES, Scalar},
        simd::{Register, SimdTask, Width},
    },
    rhs::{Evaluation, Stance, ankle_to_point, pivot_to_ankle},
    sim::{
        Simulation,
        moreau::{
            StepDriver, middle,
            step::{MoreauStep, glide},
            step_contacts::{Freedom, StepContacts},
            trial_steps::StepRequest,
        },
    },
};
use std::{mem, sync::Arc};

/// Most simulations under way at a time: enough to fill the lanes with simulations of one contact mode, few enough
/// to keep their states in the processor's caches.
pub(crate) const MAX_BATCH: usize = 64;

/// Owner of a simulation to advance.
pub trait HasSimulation {
    fn sim(&self) -> &Simulation;
    fn sim_mut(&mut self) -> &mut Simulation;
}

impl HasSimulation for &mut Simulation {
    fn sim(&self) -> &Simulation {
        self
    }

    fn sim_mut(&mut self) -> &mut Simulation {
        self
    }
}

/// Advance simulations of one structure by time steps, each to its own time, at most `most` at once. `done` receives
/// each owner when its simulation arrives, in no particular order. A result does not depend on the other
/// simulations.
pub fn advance_many<P: HasSimulation>(
    owners: impl Iterator<Item = (P, f64)>,
    (width, most): (Width, usize),
    done: impl FnMut(P),
) {
    width.run(BatchAdvance {
        owners,
        most: most.min(MAX_BATCH),
        done,
    });
}

struct BatchAdvance<I, A> {
    owners: I,
    most: usize,
    done: A,
}

impl<P: HasSimulation, I: Iterator<Item = (P, f64)>, A: FnMut(P)> SimdTask for BatchAdvance<I, A> {
    fn run_scalar(mut self) {
        self.owners.for_each(|(mut owner, until)| {
            owner.sim_mut().advance_by_steps(until);
            (self.done)(owner);
        });
    }

    fn run_simd<T: Register>(mut self) {
        let mut workspace = Workspace::<T>::default();
        let mut active = [const { None }; MAX_BATCH];
        let mut ready = [LaneKey::default(); MAX_BATCH];
        loop {
            let n = self.collect_ready(&mut active, &mut ready);
            if n == 0 {
                break;
            }
            for keys in ready[..n].chunks(T::LANES) {
                if keys.len() > T::LANES / 4 {
                    step_register(&mut workspace, &mut active, keys);
                } else {
                    for &key in keys {
                        active_in(&mut active, key).step_scalar();
                    }
                }
            }
        }
    }
}

/// Workspace of one register of simulations.
#[derive(Default)]
struct Workspace<T: Scalar> {
    eval: Evaluation<T>,
    step: MoreauStep<T>,
    /// Positions and rates at the end, lane by lane.
    q: [[f64; NV]; MAX_LANES],
    v: [[f64; NV]; MAX_LANES],
}

/// A simulation under way.
struct Active<P> {
    owner: P,
    driver: StepDriver,
}

/// A simulation with a step to make. The order is by contact mode, then by slot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct LaneKey(u32);

impl LaneKey {
    fn new(mode: ContactMode, place: usize) -> Self {
        let foot = |foot: Foot| {
            (foot.touch as u32) << 3 | (foot.friction_mode as u32) << 1 | u32::from(foot.pulled)
        };
        Self(foot(mode.free) << 16 | foot(mode.support) << 8 | place as u32)
    }

    fn slot(self) -> usize {
        (self.0 & 0xff) as usize
    }
}

impl<P: HasSimulation, I: Iterator<Item = (P, f64)>, A: FnMut(P)> BatchAdvance<I, A> {
    /// Sort the simulations with a step to make by contact mode and return their number. A simulation that has
    /// arrived makes room for the next one.
    #[inline(never)]
    fn collect_ready(
        &mut self,
        active: &mut [Option<Active<P>>; MAX_BATCH],
        ready: &mut [LaneKey; MAX_BATCH],
    ) -> usize {
        let mut n = 0;
        for (i, place) in active[..self.most].iter_mut().enumerate() {
            loop {
                let Some(simulation) = place else {
                    let Some((mut owner, until)) = self.owners.next() else {
                        break;
                    };
                    let driver = StepDriver::to(owner.sim_mut(), until);
                    *place = Some(Active { owner, driver });
                    continue;
                };
                if let Some(mode) = simulation.next_mode() {
                    ready[n] = LaneKey::new(mode, i);
                    n += 1;
                    break;
                }
                simulation.driver.end(simulation.owner.sim_mut());
                if let Some((next, until)) = self.owners.next() {
                    (self.done)(mem::replace(&mut simulation.owner, next));
                    simulation.driver.set_out(simulation.owner.sim_mut(), until);
                } else if let Some(Active { owner, .. }) = place.take() {
                    (self.done)(owner);
                }
            }
        }
        ready[..n].sort_unstable();
        n
    }
}

fn active_in<P>(active: &mut [Option<Active<P>>], key: LaneKey) -> &mut Active<P> {
    let simulation = active[key.slot()].as_mut();
    simulation.expect("it has a step to make")
}

impl<P: HasSimulation> Active<P> {
    /// The contact mode of its next step, or `None` at its end. Steps that lanes cannot make are made here.
    fn next_mode(&mut self) -> Option<ContactMode> {
        loop {
            let sim = self.owner.sim_mut();
            let mode = self.driver.wish(sim)?.start.mode;
            // Until its next sample after a swap, the controller numbers the joints from the other foot.
            if !ControllerInput::of(&sim.state).mirrored {
                return Some(mode);
            }
            self.step_scalar();
        }
    }

    fn step_scalar(&mut self) {
        let sim = self.owner.sim_mut();
        let mode = sim.glide(&self.driver.step.wish);
        self.driver.after(sim, mode);
    }
}

/// Make the time steps of at most as many simulations as there are lanes.
fn step_register<T: Register, P: HasSimulation>(
    workspace: &mut Workspace<T>,
    active: &mut [Option<Active<P>>],
    keys: &[LaneKey],
) {
    let lanes = std::array::from_fn(|i| {
        // Unused lanes repeat the first.
        let key = keys[if i < keys.len() { i } else { 0 }];
        let simulation = active[key.slot()].as_ref();
        let Active { owner, driver } = simulation.expect("it has a step to make");
        let sim = owner.sim();
        Lane {
            model: &sim.model,
            residual: &sim.residual,
            request: &driver.step.wish,
        }
    });
    let (moved, outcomes) = step_lanes(workspace, lanes);
    let Workspace { eval, step, q, v } = workspace;
    for (lane, &key) in keys.iter().enumerate() {
        let Active { owner, driver } = active_in(active, key);
        let sim = owner.sim_mut();
        let moved = moved.then_some((&*step, &q[lane], &v[lane]));
        sim.take_glided(&driver.step.wish, outcomes[lane], moved, lane);
        if driver.step.wants_problem() {
            sim.eval.factored.problem = eval.factored.problem.lane(lane);
        }
        driver.after(sim, outcomes[lane]);
    }
}

/// Input of one lane.
#[derive(Clone, Copy)]
struct Lane<'a> {
    model: &'a Arc<Model>,
    /// Residual torques held over the step [N m].
    residual: &'a [f64; NV],
    request: &'a StepRequest,
}

/// Whether the step was made, and the contact mode of each lane after it.
type Outcomes = (bool, [Result<ContactMode, Termination>; MAX_LANES]);

/// One time step in all lanes. Compiled twice for each width: for lanes that share a model, and for a model in
/// each lane, whose numbers take longer to gather.
fn step_lanes<T: Register>(workspace: &mut Workspace<T>, lanes: [Lane<'_>; MAX_LANES]) -> Outcomes {
    let models = lanes.map(|lane| lane.model);
    if models.iter().all(|model| Arc::ptr_eq(models[0], model)) {
        T::with_target_features(
            #[inline(always)]
            || step_models(workspace, Broadcast(models[0]), &lanes),
        )
    } else {
        let models: [&Model; MAX_LANES] = models.map(|model| &**model);
        T::with_target_features(
            #[inline(always)]
            || step_models(workspace, PerLane(&models), &lanes),
        )
    }
}

#[inline(always)]
fn step_models<T: Scalar, R: ModelLanes<T>>(
    Workspace { eval, step, q, v }: &mut Workspace<T>,
    models: R,
    lanes: &[Lane<'_>; MAX_LANES],
) -> Outcomes {
    let requests = lanes.map(|lane| lane.request);
    let start = &mut step.start;
    T::from_rows(&requests.map(|request| &request.start.q), &mut start.q);
    T::from_rows(&requests.map(|request| &request.start.v), &mut start.v);
    start.anchor = T::from_lanes(|i| requests[i].start.anchor);
    start.energies = [
        T::from_lanes(|i| requests[i].start.energy_balance.actuators),
        T::from_lanes(|i| requests[i].start.energy_balance.damping),
        T::from_lanes(|i| requests[i].start.energy_balance.friction),
    ];
    let residuals = lanes.map(|lane| lane.residual);
    T::from_rows(&residuals, &mut step.residual);
    step.h = T::from_lanes(|i| requests[i].h);
    let modes: [ContactMode; MAX_LANES] = requests.map(|request| request.start.mode);
    let freedom: [Freedom; MAX_LANES] = requests.map(|request| request.freedom);
    let now: [ControllerInput; MAX_LANES] =
        requests.map(|request| middle(&request.start, request.h));
    let pivots: [[f64; 2]; MAX_LANES] =
        std::array::from_fn(|i| pivot_to_ankle(models.lane(i % T::LANES), modes[i].support.touch));
    let stance = Stance {
        pivot_to_ankle: [
            T::from_lanes(|i| pivots[i][0]),
            T::from_lanes(|i| pivots[i][1]),
        ],
        ankle_to_point: T::from_lanes(|i| ankle_to_point(models.lane(i), modes[i].free.touch)),
        rows: modes[..T::LANES]
            .iter()
            .map(|mode| rows(mode.free.touch))
            .fold(0, usize::max),
    };
    let mut feet = StepContacts::new(models, &modes[..T::LANES], &freedom[..T::LANES]);
    let moved = glide(eval, &mut feet, step, &stance, &now[..T::LANES]);
    if moved {
        T::to_rows(&step.end.q, q);
        T::to_rows(&step.end.v, v);
    }
    (moved, std::array::from_fn(|i| feet.outcome(i)))
}
