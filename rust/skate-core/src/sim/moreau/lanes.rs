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
            driver::StepDriver,
            midpoint_input,
            step::{MoreauStep, moreau_step},
            step_contacts::{ModeConstraint, StepContacts},
            trial_steps::StepRequest,
        },
    },
};
use std::{mem, sync::Arc};

/// Maximum number of simulations that are advanced at a time: enough to fill the lanes with simulations of one contact
/// mode, few enough to keep their states in the processor's caches.
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

/// Advance simulations of one structure by time steps, each to its own end time, at most `max_batch` at once. `done`
/// receives the owners of finished simulations in arbitrary order. Results do not depend on the other simulations.
pub fn advance_many<P: HasSimulation>(
    owners: impl Iterator<Item = (P, f64)>,
    (width, max_batch): (Width, usize),
    done: impl FnMut(P),
) {
    width.run(BatchAdvance {
        owners,
        max_batch: max_batch.min(MAX_BATCH),
        done,
    });
}

struct BatchAdvance<I, A> {
    owners: I,
    max_batch: usize,
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
    /// Positions and velocities at the end, per lane.
    q: [[f64; NV]; MAX_LANES],
    v: [[f64; NV]; MAX_LANES],
}

/// A simulation that is being advanced.
struct Active<P> {
    owner: P,
    driver: StepDriver,
}

/// Sort key of a simulation with a pending step request: its contact mode, then its slot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct LaneKey(u32);

impl LaneKey {
    fn new(mode: ContactMode, slot: usize) -> Self {
        let foot = |foot: Foot| {
            (foot.touch as u32) << 3 | (foot.friction_mode as u32) << 1 | u32::from(foot.pulled)
        };
        Self(foot(mode.free) << 16 | foot(mode.support) << 8 | slot as u32)
    }

    fn slot(self) -> usize {
        (self.0 & 0xff) as usize
    }
}

impl<P: HasSimulation, I: Iterator<Item = (P, f64)>, A: FnMut(P)> BatchAdvance<I, A> {
    /// Sort the simulations with a pending request by contact mode and return their number. Finished simulations are
    /// replaced by the next ones.
    #[inline(never)]
    fn collect_ready(
        &mut self,
        active: &mut [Option<Active<P>>; MAX_BATCH],
        ready: &mut [LaneKey; MAX_BATCH],
    ) -> usize {
        let mut n = 0;
        for (i, slot) in active[..self.max_batch].iter_mut().enumerate() {
            loop {
                let Some(simulation) = slot else {
                    let Some((mut owner, until)) = self.owners.next() else {
                        break;
                    };
                    let driver = StepDriver::new(owner.sim_mut(), until);
                    *slot = Some(Active { owner, driver });
                    continue;
                };
                if let Some(mode) = simulation.next_mode() {
                    ready[n] = LaneKey::new(mode, i);
                    n += 1;
                    break;
                }
                simulation.driver.finish(simulation.owner.sim_mut());
                if let Some((next, until)) = self.owners.next() {
                    (self.done)(mem::replace(&mut simulation.owner, next));
                    simulation.driver.start(simulation.owner.sim_mut(), until);
                } else if let Some(Active { owner, .. }) = slot.take() {
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
    simulation.expect("a pending request")
}

impl<P: HasSimulation> Active<P> {
    /// Contact mode of the next step; None at the end. Steps that cannot be computed in lanes are computed here.
    fn next_mode(&mut self) -> Option<ContactMode> {
        loop {
            let sim = self.owner.sim_mut();
            let mode = self.driver.next_request(sim)?.start.mode;
            // Between a leg swap and the next sample, the controller numbers the joints from the other foot.
            if !ControllerInput::of(&sim.state).mirrored {
                return Some(mode);
            }
            self.step_scalar();
        }
    }

    fn step_scalar(&mut self) {
        let sim = self.owner.sim_mut();
        let mode = sim.compute_step(&self.driver.trials.request);
        self.driver.process(sim, mode);
    }
}

/// Compute the requested steps of at most as many simulations as there are lanes.
fn step_register<T: Register, P: HasSimulation>(
    workspace: &mut Workspace<T>,
    active: &mut [Option<Active<P>>],
    keys: &[LaneKey],
) {
    let lanes = std::array::from_fn(|i| {
        // Unused lanes repeat the first.
        let key = keys[if i < keys.len() { i } else { 0 }];
        let simulation = active[key.slot()].as_ref();
        let Active { owner, driver } = simulation.expect("a pending request");
        let sim = owner.sim();
        Lane {
            model: &sim.model,
            residual: &sim.residual,
            request: &driver.trials.request,
        }
    });
    let (stepped, outcomes) = step_lanes(workspace, lanes);
    let Workspace { eval, step, q, v } = workspace;
    for (lane, &key) in keys.iter().enumerate() {
        let Active { owner, driver } = active_in(active, key);
        let sim = owner.sim_mut();
        let result = stepped.then_some((&*step, &q[lane], &v[lane]));
        sim.store_step(&driver.trials.request, outcomes[lane], result, lane);
        if driver.trials.needs_contact_problem() {
            sim.eval.factored.problem = eval.factored.problem.lane(lane);
        }
        driver.process(sim, outcomes[lane]);
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

/// Whether the step was made in any lane, and the contact mode of each lane after it.
type Outcomes = (bool, [Result<ContactMode, Termination>; MAX_LANES]);

/// One time step in all lanes. Compiled twice for each width: for lanes that share a model, and for one model per lane,
/// whose parameters take longer to gather.
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
    let constraints: [ModeConstraint; MAX_LANES] = requests.map(|request| request.constraint);
    let now: [ControllerInput; MAX_LANES] =
        requests.map(|request| midpoint_input(&request.start, request.h));
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
    let mut contacts = StepContacts::new(models, &modes[..T::LANES], &constraints[..T::LANES]);
    let stepped = moreau_step(eval, &mut contacts, step, &stance, &now[..T::LANES]);
    if stepped {
        T::to_rows(&step.end.q, q);
        T::to_rows(&step.end.v, v);
    }
    (stepped, std::array::from_fn(|i| contacts.outcome(i)))
}
