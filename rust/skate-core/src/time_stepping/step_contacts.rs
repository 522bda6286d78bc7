//! Contact modes and impulses of a step, per lane.

mod driving_friction;
mod lanes_in_mode;

use crate::{
    contact::{
        conditions::{Tolerance, admissibility},
        equations::{ContactProblem, Slip, Solution},
        mode_query::ModeQuery,
        mode_selection::{consistent, select},
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, touches},
        lanes::ModelLanes,
    },
    numeric::scalar::{MAX_LANES, Mask, Scalar},
};

/// Impulses and velocities that count as zero, as at an impact [N s], [m/s].
const TOLERANCE: Tolerance = Tolerance {
    force: 1e-9,
    motion: 1e-11,
};

/// Restriction on the contact mode of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeConstraint {
    /// The consistent mode nearest to this one is chosen.
    pub near: ContactMode,
    /// That mode has just been chosen for this step and is kept.
    pub fixed: bool,
}

/// Contact modes of all lanes during a step.
pub struct StepContacts<'a, T: Scalar, R> {
    pub models: R,
    starts: &'a [ContactMode],
    constraints: &'a [ModeConstraint],
    /// Contact mode at the end of the step. A lane stops, and its step is void, on an error and if other ends of the
    /// soles touch the ice than at the start.
    outcomes: [Result<ContactMode, Termination>; MAX_LANES],
    /// Lanes that have not stopped.
    active: T::Mask,
    /// Lanes in which friction of a foot is left out of this step; see `drop_driving_friction`.
    frictionless: [T::Mask; 2],
}

impl<'a, T: Scalar, R: ModelLanes<T>> StepContacts<'a, T, R> {
    #[inline(always)]
    pub fn new(models: R, starts: &'a [ContactMode], constraints: &'a [ModeConstraint]) -> Self {
        let mut outcomes = [Err(Termination::Jam); MAX_LANES];
        for ((outcome, start), constraint) in outcomes.iter_mut().zip(starts).zip(constraints) {
            *outcome = Ok(if constraint.fixed {
                constraint.near
            } else {
                *start
            });
        }
        Self {
            models,
            starts,
            constraints,
            outcomes,
            active: T::Mask::of(true),
            frictionless: [T::Mask::of(false); 2],
        }
    }

    /// Contacts that end in the given modes.
    pub fn ending_in(
        models: R,
        starts: &'a [ContactMode],
        constraints: &'a [ModeConstraint],
        ends: &[ContactMode],
    ) -> Self {
        let mut contacts = Self::new(models, starts, constraints);
        for (outcome, end) in contacts.outcomes.iter_mut().zip(ends) {
            *outcome = Ok(*end);
        }
        contacts
    }

    /// Contact mode of a lane at the end. If other ends touch the ice than at the start, the lane's step is void.
    #[inline(always)]
    pub fn outcome(&self, lane: usize) -> Result<ContactMode, Termination> {
        self.outcomes[lane]
    }

    #[inline(always)]
    fn stop(&mut self, lane: usize, outcome: Result<ContactMode, Termination>) {
        self.outcomes[lane] = outcome;
        self.active = self.active & !T::Mask::only(lane);
    }

    /// Stop lanes with a singular matrix.
    #[inline(always)]
    pub fn stop_singular(&mut self, regular: T::Mask) {
        if !regular.all() {
            self.stop_lanes(!regular, Termination::Singular);
        }
    }

    /// Stop lanes with velocities outside the range of the arithmetic.
    #[inline(always)]
    pub fn stop_unbounded(&mut self, bounded: T::Mask) {
        if !bounded.all() {
            self.stop_lanes(!bounded, Termination::NotFinite);
        }
    }

    #[inline(never)]
    fn stop_lanes(&mut self, lanes: T::Mask, cause: Termination) {
        for i in 0..T::LANES {
            if lanes.lane(i) && self.active.lane(i) {
                self.stop(i, Err(cause));
            }
        }
    }

    /// New velocities and impulses, or None if all lanes have stopped. The mode found by the previous call is tried
    /// first, for all lanes with that mode at once.
    #[inline(always)]
    pub fn solve_impulses(&mut self, problem: &ContactProblem<T>) -> Option<Solution<T>> {
        let mut solution = Solution::default();
        let mut accepted = T::Mask::of(false);
        let mut rejected = T::Mask::of(false);
        let mut seen = T::Mask::of(false);
        let modes: [ContactMode; MAX_LANES] = std::array::from_fn(|i| self.tried(i % T::LANES));
        for i in 0..T::LANES {
            if seen.lane(i) {
                continue;
            }
            let mode = modes[i];
            let same = T::Mask::from_lanes(|j| modes[j] == mode);
            seen = seen | same;
            let (found, regular) = problem.regular(mode, self.slip(mode));
            let [support, free] = self.frictionless;
            let fixed = T::Mask::from_lanes(|j| self.constraints[j].fixed) | support | free;
            let admissibility =
                admissibility(self.models, (problem.lever, &found), mode, TOLERANCE);
            blend(same, &found, &mut solution);
            accepted = accepted | same & regular & (fixed | admissibility.holds);
            rejected = rejected | same & regular & admissibility.fails;
        }
        for i in 0..T::LANES {
            if self.active.lane(i) && !accepted.lane(i) {
                let lane = problem.lane(i);
                let robot = self.models.lane(i);
                let found = if self.frictionless.iter().any(|lanes| lanes.lane(i)) {
                    let Slip { support, free } = self.slip(modes[i]);
                    let slip = Slip {
                        support: support.lane(i),
                        free: free.lane(i),
                    };
                    lane.solve(modes[i], slip)
                        .map(|solution| (modes[i], solution))
                } else {
                    let tried = (modes[i], rejected.lane(i));
                    select_mode(robot, &lane, self.starts[i], tried, self.constraints[i])
                };
                match found {
                    Ok((mode, found)) => {
                        solution.set_lane(i, &found);
                        self.outcomes[i] = Ok(mode);
                        if touches(mode) != touches(self.starts[i]) {
                            self.stop(i, Ok(mode));
                        }
                    }
                    Err(cause) => self.stop(i, Err(cause)),
                }
            }
        }
        self.active.any().then_some(solution)
    }

    /// The mode to try in a lane: the last one found, or the start's if the lane has stopped.
    #[inline(always)]
    fn tried(&self, lane: usize) -> ContactMode {
        match self.outcomes[lane] {
            Ok(mode) if self.active.lane(lane) => mode,
            _ => self.starts[lane],
        }
    }

    /// Smallest change of positions that removes the violation of the free foot's constraints, `problem.alpha0`.
    #[inline(always)]
    pub fn solve_correction(&mut self, problem: &ContactProblem<T>) -> Solution<T> {
        let mut solution = Solution::default();
        let mut seen = T::Mask::of(false);
        for i in 0..T::LANES {
            let Ok(mode) = self.outcomes[i] else {
                continue;
            };
            if seen.lane(i) {
                continue;
            }
            let same = T::Mask::from_lanes(|j| self.outcomes[j] == Ok(mode));
            seen = seen | same;
            let (found, regular) = problem.regular(mode, Slip::default());
            blend(same, &found, &mut solution);
            if !(regular | !same).all() {
                for j in 0..T::LANES {
                    if same.lane(j) && !regular.lane(j) && self.active.lane(j) {
                        match problem.lane(j).solve(mode, Slip::default()) {
                            Ok(found) => solution.set_lane(j, &found),
                            Err(cause) => self.stop(j, Err(cause)),
                        }
                    }
                }
            }
        }
        solution
    }
}

/// Copy `from` to `to` in some lanes.
#[inline(always)]
fn blend<T: Scalar>(lanes: T::Mask, from: &Solution<T>, to: &mut Solution<T>) {
    for i in 0..3 {
        to.a_root[i] = T::select(lanes, from.a_root[i], to.a_root[i]);
        to.f_root[i] = T::select(lanes, from.f_root[i], to.f_root[i]);
        to.a_free[i] = T::select(lanes, from.a_free[i], to.a_free[i]);
        to.lam[i] = T::select(lanes, from.lam[i], to.lam[i]);
    }
}

/// Contact mode of a step that begins with `start`, with its new velocities and impulses. The mode `tried` is
/// skipped if it was `rejected`. If no mode is consistent, the start's is kept.
#[inline(never)]
fn select_mode(
    model: &Model,
    problem: &ContactProblem,
    start: ContactMode,
    (tried, rejected): (ContactMode, bool),
    constraint: ModeConstraint,
) -> Result<(ContactMode, Solution), Termination> {
    let keep = |mode| Ok((mode, problem.solve(mode, Slip::of(model, mode))?));
    if constraint.fixed {
        return keep(constraint.near);
    }
    let closed = [start.support.touch, start.free.touch];
    let query = ModeQuery::new(closed, [None; 2], constraint.near, TOLERANCE);
    if !rejected && let Some(solution) = consistent(model, problem, &query, tried)? {
        return Ok((tried, solution));
    }
    let others = ModeQuery {
        excluded: Some(tried),
        ..query
    };
    match select(model, problem, &others) {
        Err(Termination::Jam) => keep(start),
        found => found,
    }
}
