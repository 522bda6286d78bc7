//! How the feet go on over a step: contact states and impulses, lane by lane.

use crate::{
    contact::{
        conditions::{Tolerance, admissibility},
        equations::{ContactProblem, PHI, Slip, Solution, Y},
        mode_query::ModeQuery,
        mode_selection::{consistent, select},
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact, touches},
        lanes::ModelLanes,
    },
    numeric::scalar::{MAX_LANES, Mask, Scalar},
};

/// Impulses and velocities that count as zero, as at an impact [N s], [m/s].
const TOLERANCE: Tolerance = Tolerance {
    force: 1e-9,
    motion: 1e-11,
};

/// What a step may do with contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Freedom {
    /// The mode to stay as close to as possible.
    pub near: ContactMode,
    /// The start's mode has just been chosen for this step and stays.
    pub decided: bool,
}

/// See the module's documentation.
pub struct StepContacts<'a, T: Scalar, R> {
    pub models: R,
    starts: &'a [ContactMode],
    freedom: &'a [Freedom],
    /// The contact state at the end of the step, or the error or the other touches because of which a robot
    /// has not moved.
    outcomes: [Result<ContactMode, Termination>; MAX_LANES],
    moved: T::Mask,
}

impl<'a, T: Scalar, R: ModelLanes<T>> StepContacts<'a, T, R> {
    #[inline(always)]
    pub fn new(models: R, starts: &'a [ContactMode], freedom: &'a [Freedom]) -> Self {
        let mut outcomes = [Err(Termination::Jam); MAX_LANES];
        for (outcome, start) in outcomes.iter_mut().zip(starts) {
            *outcome = Ok(*start);
        }
        Self {
            models,
            starts,
            freedom,
            outcomes,
            moved: T::Mask::of(true),
        }
    }

    /// The contact state of a lane at the end; with other touches than at the start nothing has moved there.
    #[inline(always)]
    pub fn outcome(&self, lane: usize) -> Result<ContactMode, Termination> {
        self.outcomes[lane]
    }

    #[inline(always)]
    fn stop(&mut self, lane: usize, why: Result<ContactMode, Termination>) {
        self.outcomes[lane] = why;
        self.moved = self.moved & !T::Mask::only(lane);
    }

    /// A matrix had an inverse.
    #[inline(always)]
    pub fn require(&mut self, regular: T::Mask) {
        if !regular.all() {
            self.stop_all(!regular, Termination::Singular);
        }
    }

    /// The new velocities are such as the arithmetic can hold.
    #[inline(always)]
    pub fn bound(&mut self, bounded: T::Mask) {
        if !bounded.all() {
            self.stop_all(!bounded, Termination::NotFinite);
        }
    }

    #[inline(never)]
    fn stop_all(&mut self, which: T::Mask, cause: Termination) {
        for i in 0..T::LANES {
            if which.lane(i) && self.moved.lane(i) {
                self.stop(i, Err(cause));
            }
        }
    }

    /// New velocities and impulses; None where no robot moves any more. What was found before is tried first.
    #[inline(always)]
    pub fn impulses(&mut self, problem: &ContactProblem<T>) -> Option<Solution<T>> {
        let mut solution = Solution::default();
        let mut certain = T::Mask::of(false);
        let mut fails = T::Mask::of(false);
        let mut seen = T::Mask::of(false);
        let modes: [ContactMode; MAX_LANES] = std::array::from_fn(|i| self.present(i % T::LANES));
        for i in 0..T::LANES {
            if seen.lane(i) {
                continue;
            }
            let mode = modes[i];
            let same = T::Mask::from_lanes(|j| modes[j] == mode);
            seen = seen | same;
            let slip = Slip::of(self.models, mode);
            let (found, regular) = problem.regular(mode, slip);
            let decided = T::Mask::from_lanes(|j| self.freedom[j].decided);
            let admissibility = admissibility(self.models, &found, mode, TOLERANCE);
            blend(same, &found, &mut solution);
            certain = certain | same & regular & (decided | admissibility.holds);
            fails = fails | same & regular & admissibility.fails;
        }
        for i in 0..T::LANES {
            if self.moved.lane(i) && !certain.lane(i) {
                let problem = problem.lane(i);
                let robot = self.models.lane(i);
                let tried = (modes[i], fails.lane(i));
                match impulses(robot, &problem, self.starts[i], tried, self.freedom[i]) {
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
        self.moved.any().then_some(solution)
    }

    /// The contact state found so far for a lane that moves; another's is its start's.
    #[inline(always)]
    fn present(&self, lane: usize) -> ContactMode {
        match self.outcomes[lane] {
            Ok(mode) if self.moved.lane(lane) => mode,
            _ => self.starts[lane],
        }
    }

    /// Least motion that takes violations of the free foot's constraints away.
    #[inline(always)]
    pub fn correction(&mut self, problem: &ContactProblem<T>) -> Solution<T> {
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
                    if same.lane(j) && !regular.lane(j) && self.moved.lane(j) {
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

    #[inline(always)]
    fn each(&self, of: impl Fn(ContactMode, ContactMode) -> bool) -> T::Mask {
        T::Mask::from_lanes(|i| self.outcomes[i].is_ok_and(|end| of(self.starts[i], end)))
    }

    /// Where the free foot, on the ice, has come to stick.
    #[inline(always)]
    pub fn newly_stuck(&self) -> T::Mask {
        self.each(|start, end| !end.free.slides() && end.free != start.free)
    }

    /// Where the free foot is on the ice.
    #[inline(always)]
    pub fn touching(&self) -> T::Mask {
        self.moved & self.each(|_, end| end.free.touch != SoleContact::Air)
    }

    /// Where the supporting foot turns about its heel.
    #[inline(always)]
    pub fn on_heel(&self) -> T::Mask {
        self.each(|_, end| end.support.touch == SoleContact::Heel)
    }

    /// 1 where contact holds the free foot's y, z, rotation, else 0.
    #[inline(always)]
    pub fn held(&self) -> [T; 3] {
        let one = |mask| T::select(mask, T::one(), T::zero());
        let mut held = [T::one(); 3];
        held[Y] = one(self.each(|_, end| !end.free.slides()));
        held[PHI] = one(self.each(|_, end| end.free.touch == SoleContact::Flat));
        held
    }
}

#[inline(always)]
fn blend<T: Scalar>(which: T::Mask, from: &Solution<T>, to: &mut Solution<T>) {
    for i in 0..3 {
        to.a_root[i] = T::select(which, from.a_root[i], to.a_root[i]);
        to.f_root[i] = T::select(which, from.f_root[i], to.f_root[i]);
        to.a_free[i] = T::select(which, from.a_free[i], to.a_free[i]);
        to.lam[i] = T::select(which, from.lam[i], to.lam[i]);
    }
}

/// Contact state over a step that begins with `start`, its new velocities and impulses; not the one just tried
/// where that `fails`. Where none is consistent the feet go on as they did.
#[inline(never)]
fn impulses(
    model: &Model,
    problem: &ContactProblem,
    start: ContactMode,
    (tried, fails): (ContactMode, bool),
    freedom: Freedom,
) -> Result<(ContactMode, Solution), Termination> {
    let stay = || Ok((start, problem.solve(start, Slip::of(model, start))?));
    if freedom.decided {
        return stay();
    }
    let closed = [start.support.touch, start.free.touch];
    let query = ModeQuery::new(closed, [None; 2], freedom.near, TOLERANCE);
    if !fails && let Some(solution) = consistent(model, problem, &query, tried)? {
        return Ok((tried, solution));
    }
    let others = ModeQuery {
        excluded: Some(tried),
        ..query
    };
    match select(model, problem, &others) {
        Err(Termination::Jam) => stay(),
        found => found,
    }
}
