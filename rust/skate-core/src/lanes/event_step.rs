//! One time step in every lane of a register.

use crate::{
    contact::equations::Slip,
    control::ControllerInput,
    error::Termination,
    events::guards::{Guards, MAX_GUARDS},
    integrate::{
        Start, Stiffness, System, TimeStep,
        dop853::{self, END},
    },
    model::{
        Model,
        contact_mode::{ContactMode, End},
        lanes::{Broadcast, ModelLanes, PerLane},
        layout::NV,
    },
    numeric::{
        scalar::{MAX_LANES, Mask, Scalar},
        simd::Register,
    },
    rhs::{Evaluation, Inputs, Stance, projection::is_violated, sole_points::SolePoints},
    sim::{
        NY, Simulation,
        guard_samples::GuardSamples,
        mode_system::{slope, unpack},
        trial::{EndPoint, Evaluated},
    },
};
use std::{ops::RangeInclusive, sync::Arc};

/// Slopes that the dense output needs, besides those at both ends.
const SLOPES: RangeInclusive<usize> = 5..=11;

impl Simulation {
    /// Prepare a step of the length `h` that is computed in lanes.
    pub(super) fn start_in_lanes(&mut self, h: f64) {
        let (y, t) = (self.integrated_vector(), self.state.t);
        let (y, slope) = (&y, &self.dy);
        self.step.start(Start { t, y, slope }, h, END);
        self.guard_samples.start_step(self.guards, t, h);
    }
}

/// Workspace of one register of simulations.
pub struct Workspace<T: Scalar> {
    eval: Evaluation<T>,
    step: TimeStep<NY, T>,
    samples: [GuardSamples; MAX_LANES],
    /// Result by lanes: end of the step, and the slope there.
    y1: [[f64; NY]; MAX_LANES],
    dy1: [[f64; NY]; MAX_LANES],
}

impl<T: Register> Workspace<T> {
    /// For simulations like `sim`.
    pub fn new(sim: &Simulation) -> Self {
        Self {
            eval: Evaluation::default(),
            step: TimeStep::like(&sim.step),
            samples: [GuardSamples::none(sim.guards); MAX_LANES],
            y1: [[0.0; NY]; MAX_LANES],
            dy1: [[0.0; NY]; MAX_LANES],
        }
    }

    /// Store a lane's step in its simulation, without the slopes of `copy_slopes`. Returns the local error as a multiple
    /// of the tolerance, and the end.
    pub(super) fn result<'a>(
        &self,
        result: &StepResult<T>,
        (lane, copy_slopes): (usize, &'a dyn Fn(&mut TimeStep<NY>)),
        sim: &mut Simulation,
    ) -> (f64, EndPoint<'a>) {
        sim.step.y1 = self.y1[lane];
        sim.step.k[END] = self.dy1[lane];
        let tolerance = sim.method().tolerance();
        // As for a step alone, which has no estimate without a tolerance.
        sim.step.stiffness = tolerance.map_or(Stiffness::default(), |_| Stiffness {
            h_rho_squared: result.stiffness.h_rho_squared.lane(lane),
            size_squared: result.stiffness.size_squared.lane(lane),
        });
        sim.guard_samples = self.samples[lane];
        sim.eval.count += END as u64;
        sim.evaluated = Evaluated::EndInLanes;
        self.eval.solution.lane_to(lane, &mut sim.eval.solution);
        let mut end = EndPoint {
            guards: result.guards.map(|value| value.lane(lane)),
            sole_points: SolePoints::default(),
            is_violated: result.violated.lane(lane),
            copy_slopes,
        };
        result.sole_points.lane_to(lane, &mut end.sole_points);
        let squares = result.squares.map(|square| square.lane(lane));
        let tolerance = tolerance.unwrap_or(f64::INFINITY);
        let error = dop853::error(squares, sim.step.stiffness, tolerance);
        (error, end)
    }

    /// Copy the slopes inside a lane's step to its simulation.
    pub fn copy_slopes(&self, lane: usize, step: &mut TimeStep<NY>) {
        for s in SLOPES {
            step.k[s] = self.step.k[s].map(|slope| slope.lane(lane));
        }
    }
}

/// Result of a step in lanes, besides the workspace.
pub struct StepResult<T: Scalar> {
    /// Lanes without a result: there the contact equations have no finite solution.
    pub failed: T::Mask,
    /// Of the local errors.
    squares: [T; 2],
    stiffness: Stiffness<T>,
    guards: [T; MAX_GUARDS],
    sole_points: SolePoints<T>,
    violated: T::Mask,
}

/// One step in all lanes. Compiled twice for each width, as in `time_steps`.
pub fn step_lanes<T: Register>(
    workspace: &mut Workspace<T>,
    sims: &[&Simulation; MAX_LANES],
    h: &[f64; MAX_LANES],
) -> StepResult<T> {
    let models = sims.map(|sim| &sim.model);
    if models.iter().all(|model| Arc::ptr_eq(models[0], model)) {
        step_models(workspace, Broadcast(models[0]), sims, h)
    } else {
        let models: [&Model; MAX_LANES] = models.map(|model| &**model);
        step_models(workspace, PerLane(&models), sims, h)
    }
}

fn step_models<T: Register, R: ModelLanes<T>>(
    workspace: &mut Workspace<T>,
    models: R,
    sims: &[&Simulation; MAX_LANES],
    h: &[f64; MAX_LANES],
) -> StepResult<T> {
    let Workspace {
        eval,
        step,
        samples,
        y1,
        dy1,
    } = workspace;
    *samples = sims.map(|sim| sim.guard_samples);
    let first = sims[0];
    let mode = first.state.mode;
    // Fixed steps have no tolerance; every error is small.
    let tolerances = sims.map(|sim| sim.method().tolerance().unwrap_or(f64::INFINITY));
    T::with_target_features(
        #[inline(always)]
        || {
            let (mut y, mut dy) = ([T::zero(); NY], [T::zero(); NY]);
            T::from_rows(&sims.map(|sim| &sim.step.y0), &mut y);
            T::from_rows(&sims.map(|sim| &sim.dy), &mut dy);
            let mut residual = [T::zero(); NV];
            T::from_rows(&sims.map(|sim| &sim.residual), &mut residual);
            let mut system = LaneSystem {
                eval,
                models,
                mode,
                slip: Slip::of(models, mode),
                stance: Stance::of(models, mode),
                now: sims.map(|sim| ControllerInput::of(&sim.state)),
                residual,
                guards: first.guards,
                samples,
                failed: T::Mask::of(false),
            };
            let t = T::from_lanes(|i| sims[i].state.t);
            let h = T::from_lanes(|i| h[i]);
            // The system reports errors by lanes.
            let _ = step.dop853(
                &mut system,
                Start {
                    t,
                    y: &y,
                    slope: &dy,
                },
                h,
            );
            T::to_rows(&step.y1, y1);
            T::to_rows(&step.k[END], dy1);
            let n = models.shape().n.min(NV);
            let (q, _) = unpack(&step.y1, n);
            let on_heel = T::Mask::of(mode.support.touch.pivot() == End::Heel);
            let anchor = T::from_lanes(|i| sims[i].state.anchor);
            StepResult {
                failed: system.failed,
                stiffness: step.dop853_stiffness(),
                squares: step.dop853_squares(T::from_lanes(|i| tolerances[i])),
                guards: system.guard_values(q[1], step.y1[n]),
                sole_points: SolePoints::of(models, &system.eval.kin, on_heel, q[1]),
                violated: is_violated(system.eval, q, (mode.free, anchor)),
            }
        },
    )
}

/// Dynamics of one contact mode in every lane.
struct LaneSystem<'a, T: Scalar, R> {
    eval: &'a mut Evaluation<T>,
    models: R,
    mode: ContactMode,
    slip: Slip<T>,
    stance: Stance<T>,
    now: [ControllerInput; MAX_LANES],
    residual: [T; NV],
    guards: Guards,
    samples: &'a mut [GuardSamples; MAX_LANES],
    failed: T::Mask,
}

impl<T: Register, R: ModelLanes<T>> LaneSystem<'_, T, R> {
    /// Guards at the last evaluation, at the height `z0` and the velocity `vy` of the pivot.
    #[inline(always)]
    fn guard_values(&self, z0: T, vy: T) -> [T; MAX_GUARDS] {
        let mut values = [T::zero(); MAX_GUARDS];
        for (value, guard) in values.iter_mut().zip(self.guards.as_slice()) {
            *value = guard.value_in_lanes(self.models, self.eval, self.mode, (z0, vy));
        }
        values
    }

    /// The right-hand side. Not inlined: it would be compiled for every stage.
    #[inline(never)]
    fn evaluate(&mut self, t: &T, y: &[T; NY], dy: &mut [T; NY]) {
        T::with_target_features(
            #[inline(always)]
            || {
                let models = self.models;
                let n = models.shape().n.min(NV);
                let (q, v) = unpack(y, n);
                for (i, now) in self.now[..T::LANES].iter_mut().enumerate() {
                    now.t = t.lane(i);
                }
                let inputs = Inputs {
                    mode: self.mode,
                    slip: self.slip,
                    stance: &self.stance,
                    now: &self.now[..T::LANES],
                    residual: &self.residual,
                };
                let failed = self.eval.evaluate(models, (q, v), &inputs);
                self.failed = self.failed | failed.lanes;
                slope(models, self.eval, self.mode, v, dy);
                let is_due = |i: usize| self.samples[i].is_due(t.lane(i));
                if (0..T::LANES).any(is_due) {
                    let values = self.guard_values(q[1], v[0]);
                    for (i, samples) in self.samples[..T::LANES].iter_mut().enumerate() {
                        if samples.is_due(t.lane(i)) {
                            samples.record(t.lane(i), |guard, _| values[guard].lane(i));
                        }
                    }
                }
            },
        );
    }
}

impl<T: Register, R: ModelLanes<T>> System<NY, T> for LaneSystem<'_, T, R> {
    #[inline(always)]
    fn rhs(&mut self, t: T, y: &[T; NY], dy: &mut [T; NY]) -> Result<(), Termination> {
        self.evaluate(&t, y, dy);
        Ok(())
    }
}
