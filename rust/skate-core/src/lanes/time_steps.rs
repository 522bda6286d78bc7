//! Time steps with impulses of many simulations in SIMD lanes, in any contact modes.

use crate::{
    control::ControllerInput,
    dynamics::{centre_of_mass::CentreOfMass, delassus::rows},
    error::Termination,
    lanes::scheduler::{Active, LaneDriver, LaneKey, active_in, in_lanes},
    model::{
        Model,
        contact_mode::ContactMode,
        lanes::{Broadcast, ModelLanes, PerLane},
        layout::NV,
    },
    numeric::{
        scalar::{MAX_LANES, Scalar},
        simd::Register,
    },
    rhs::{Evaluation, Stance, ankle_to_point, pivot_to_ankle},
    sim::Simulation,
    time_stepping::{
        driver::StepDriver,
        midpoint_input,
        step::{MoreauStep, moreau_step},
        step_contacts::{ModeConstraint, StepContacts},
        trial_steps::StepRequest,
    },
};
use std::{ops::DerefMut, sync::Arc};

/// Workspace of one register of simulations.
#[derive(Default)]
pub struct Workspace<T: Scalar> {
    eval: Evaluation<T>,
    step: MoreauStep<T>,
    /// Positions and velocities at the end, per lane.
    q: [[f64; NV]; MAX_LANES],
    v: [[f64; NV]; MAX_LANES],
}

impl LaneDriver for StepDriver {
    type Workspace<T: Register> = Workspace<T>;
    const MIXES_MODES: bool = true;

    fn new(sim: &mut Simulation, until: f64) -> Self {
        Self::new(sim, until)
    }

    fn start(&mut self, sim: &mut Simulation, until: f64) {
        self.start(sim, until);
    }

    fn next_mode(&mut self, sim: &mut Simulation) -> Option<ContactMode> {
        loop {
            let mode = self.next_request(sim)?.start.mode;
            // Between a leg swap and the next sample, the controller numbers the joints from the other foot.
            if !ControllerInput::of(&sim.state).mirrored {
                return Some(mode);
            }
            self.step_scalar(sim);
        }
    }

    fn step_scalar(&mut self, sim: &mut Simulation) {
        let mode = sim.compute_step(self.request());
        self.process(sim, mode);
    }

    fn finish(&mut self, sim: &mut Simulation) {
        Self::finish(self, sim);
    }

    // Inlined, so that it is made in its place rather than copied.
    #[inline(always)]
    fn workspace<T: Register>(_: &Simulation) -> Workspace<T> {
        Workspace::default()
    }

    fn step_register<T: Register, P: DerefMut<Target = Simulation>>(
        workspace: &mut Workspace<T>,
        active: &mut [Option<Active<P, Self>>],
        keys: &[LaneKey],
    ) {
        let lanes = std::array::from_fn(|i| {
            let Active { owner, driver } = in_lanes(active, keys, i);
            let sim: &Simulation = owner;
            Lane {
                model: &sim.model,
                residual: &sim.residual,
                request: driver.request(),
            }
        });
        let (stepped, outcomes) = step_lanes(workspace, lanes);
        let Workspace { eval, step, q, v } = workspace;
        for (lane, &key) in keys.iter().enumerate() {
            let Active { owner, driver } = active_in(active, key);
            let sim: &mut Simulation = owner;
            let result = stepped.then_some((&*step, &q[lane], &v[lane]));
            sim.store_step(driver.request(), outcomes[lane], result, lane);
            if driver.needs_contact_problem() {
                sim.eval.factored.problem = eval.factored.problem.lane(lane);
            }
            driver.process(sim, outcomes[lane]);
        }
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
    start.centre = CentreOfMass {
        at: [0, 1].map(|axis| T::from_lanes(|i| requests[i].centre.at[axis])),
        velocity: [0, 1].map(|axis| T::from_lanes(|i| requests[i].centre.velocity[axis])),
        spin: T::from_lanes(|i| requests[i].centre.spin),
    };
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
