//! What a step tries: the whole of it, and where contacts change in it the parts up to there. It asks for
//! one motion after the other; who computes them, alone or many at a time, it need not know.

mod release_time;

use crate::{
    contact::equations::Solution,
    error::Termination,
    events::{
        guard::{GAP_TOLERANCE, Guard},
        guards::Guards,
    },
    model::{
        contact_mode::{ContactMode, End, SoleContact, touches},
        state::State,
    },
    rhs::sole_points::SolePoints,
    sim::{
        Simulation,
        moreau::{landing_time::Height, step_contacts::Freedom},
    },
};

/// How often a step may begin anew because contacts have changed.
const CHANGES: u32 = 8;
/// An end this far below the ice has landed [m].
const DEPTH: f64 = 1e-6;
/// A landing is located to this [m], with as many trials at most.
const LANDED: f64 = 1e-5;
const TRIALS: usize = 6;
/// What happens in this share of a step happens at its start.
const AT_ONCE: f64 = 0.01;

/// A requested step of length `h` from `start`.
#[derive(Debug, Clone, Copy)]
pub struct StepRequest {
    pub start: State,
    pub h: f64,
    pub freedom: Freedom,
}

/// Mean forces over a step that has been made, and its length [s].
#[derive(Debug, Clone, Copy)]
pub(super) struct Means {
    pub forces: Solution,
    pub h: f64,
}

/// See the module's documentation.
#[derive(Debug, Clone)]
pub(super) struct Stepping {
    pub wish: StepRequest,
    /// The step's length, and that of a whole one [s].
    pub h: f64,
    length: f64,
    /// Over the step before, if contacts were the same.
    past: Option<Means>,
    /// Of the ends of the soles, as they were where a step last began.
    guards: Guards,
    guarded: (SoleContact, SoleContact),
    /// At the start of the present attempt.
    sole_points: SolePoints,
    /// What was on the ice before some of it left.
    closed: (SoleContact, SoleContact),
    changes: u32,
    trial: Trial,
}

/// What the present wish is for.
#[derive(Debug, Clone, Copy)]
enum Trial {
    Whole,
    /// A landing: heights, with their sign at the start, at both ends of the bracket.
    Landing {
        guard: Guard,
        sign: f64,
        a: Height,
        b: Height,
        left: usize,
    },
    /// The whole once more, past a landing.
    Rollback,
    /// A foot that lets go of an end, whose mean load over `h`, the whole step, is known [N].
    Release {
        which: (usize, End),
        whole: f64,
        h: f64,
        left: usize,
    },
}

/// What has become of a step.
#[derive(Debug, Clone, Copy)]
pub(super) enum Progress {
    /// Another motion is wanted.
    Wants,
    /// It has come to its end, or to a landing or a release.
    Done(Option<Guard>),
}

impl Stepping {
    /// None yet.
    pub fn at(sim: &Simulation) -> Self {
        Self {
            wish: StepRequest {
                start: sim.state,
                h: 0.0,
                freedom: Freedom {
                    near: sim.state.mode,
                    decided: false,
                },
            },
            h: 0.0,
            length: 0.0,
            past: None,
            guards: Guards::of_ends(&sim.model, touches(sim.state.mode)),
            guarded: touches(sim.state.mode),
            sole_points: sim.sole_points,
            closed: touches(sim.state.mode),
            changes: 0,
            trial: Trial::Whole,
        }
    }

    /// A step of `h` from the present state; whole ones have some `length`. The means are those of the step
    /// before.
    pub fn begin(
        &mut self,
        sim: &mut Simulation,
        (h, length): (f64, f64),
        past: Option<Means>,
    ) -> Result<(), Termination> {
        self.wish.freedom = Freedom {
            near: sim.state.mode,
            decided: false,
        };
        if sim.model.contact.is_unilateral() {
            sim.close_ends(h)?;
        }
        self.closed = touches(sim.state.mode);
        (self.h, self.length, self.changes, self.past) = (h, length, 0, past);
        self.attempt(sim);
        Ok(())
    }

    /// Begin anew from the present state, whose contacts have just changed; they may ask for a shorter step.
    fn restart(&mut self, sim: &mut Simulation) -> Progress {
        let longest = sim.longest(self.length).min(sim.until_noticed());
        self.h = self.h.min(longest);
        self.past = None;
        self.attempt(sim)
    }

    /// Wish for the whole step from the present state.
    fn attempt(&mut self, sim: &mut Simulation) -> Progress {
        self.changes += 1;
        self.wish.start = sim.state;
        (self.wish.h, self.trial) = (self.h, Trial::Whole);
        self.sole_points = sim.sole_points;
        Progress::Wants
    }

    /// Will more be asked of the motion than where it leads? Whether a foot can let go says its contact
    /// problem.
    pub fn wants_problem(&self) -> bool {
        matches!(self.trial, Trial::Release { .. })
    }

    fn wish(&mut self, h: f64, trial: Trial) -> Progress {
        (self.wish.h, self.trial) = (h, trial);
        Progress::Wants
    }

    /// Go on after the wish has come true; `mode` is the contact state that the impulses were consistent
    /// with. If it has other touches than the start's, nothing has moved.
    pub fn after(
        &mut self,
        sim: &mut Simulation,
        mode: ContactMode,
    ) -> Result<Progress, Termination> {
        match self.trial {
            Trial::Whole => self.after_whole(sim, mode),
            Trial::Landing {
                guard,
                sign,
                a,
                b,
                left,
            } => {
                let now = Height::of(&sim.sole_points, guard, sign, self.wish.h);
                if now.gap.abs() < LANDED || left == 0 {
                    // What lets go before that comes first.
                    self.h = self.wish.h;
                    return self.release_or_finish(sim, Some(guard));
                }
                let (a, b) = if now.gap > 0.0 { (now, b) } else { (a, now) };
                self.landing(sim, (guard, sign), (a, b), left)
            }
            Trial::Rollback => self.finish(sim, None),
            Trial::Release {
                which,
                whole,
                h,
                left,
            } => {
                self.h = self.wish.h;
                self.release(sim, which, (whole, h), left)
            }
        }
    }

    fn after_whole(
        &mut self,
        sim: &mut Simulation,
        mode: ContactMode,
    ) -> Result<Progress, Termination> {
        let before = touches(self.wish.start.mode);
        if touches(mode) != before {
            // Once only: the next attempt stays with this mode.
            self.closed = before;
            sim.state = self.wish.start;
            sim.happen(&self.wish.start, |passage| {
                passage.accept_mode(mode);
                Ok(())
            })?;
            self.wish.freedom.decided = true;
            return Ok(self.restart(sim));
        }
        if before != self.guarded {
            self.guarded = before;
            self.guards = Guards::of_ends(&sim.model, before);
        }
        // After a landing forces are others: whether a foot lets go says the motion up to there.
        let Some((guard, sign)) = self.landed(sim) else {
            return self.release_or_finish(sim, None);
        };
        let mut start = Height::of(&self.sole_points, guard, sign, 0.0);
        // It may have been a little below.
        start.gap = start.gap.max(0.0);
        let end = Height::of(&sim.sole_points, guard, sign, self.h);
        self.landing(sim, (guard, sign), (start, end), TRIALS)
    }

    /// The next trial for a landing between two instants.
    fn landing(
        &mut self,
        sim: &mut Simulation,
        (guard, sign): (Guard, f64),
        (a, b): (Height, Height),
        left: usize,
    ) -> Result<Progress, Termination> {
        let now = a.zero(b);
        // What hops comes down where it has left.
        if now.min(a.line(b)) <= AT_ONCE * self.h {
            return self.land_at_once(sim, guard);
        }
        sim.stats.root_iterations += 1;
        let trial = Trial::Landing {
            guard,
            sign,
            a,
            b,
            left: left - 1,
        };
        Ok(self.wish(now, trial))
    }

    /// It lands where the step begins, unless it has just left the ice.
    fn land_at_once(
        &mut self,
        sim: &mut Simulation,
        guard: Guard,
    ) -> Result<Progress, Termination> {
        let left = self.wish.freedom.decided && guard.landed(self.closed) == self.closed;
        if !left && self.changes <= CHANGES {
            self.wish.freedom.decided = false;
            sim.state = self.wish.start;
            sim.sole_points = self.sole_points;
            sim.land(guard)?;
            return Ok(self.restart(sim));
        }
        Ok(self.wish(self.h, Trial::Rollback))
    }

    fn finish(&self, sim: &mut Simulation, event: Option<Guard>) -> Result<Progress, Termination> {
        let start = &self.wish.start;
        let (solution, sole_points) = (&sim.eval.solution, &sim.sole_points);
        sim.monitor
            .accumulate(&sim.model, (solution, sole_points), start, &sim.state);
        sim.remember(start)?;
        Ok(Progress::Done(event))
    }

    /// The end that lands first since the start, by straight lines, and the side from which it comes.
    fn landed(&self, sim: &Simulation) -> Option<(Guard, f64)> {
        let push_only = sim.model.contact.is_unilateral();
        let mut first: Option<(f64, Guard, f64)> = None;
        for &guard in self.guards.as_slice() {
            let Guard::Gap(which, end) = guard else {
                continue;
            };
            let start = self.sole_points.gap(which, end) + GAP_TOLERANCE;
            let end = sim.sole_points.gap(which, end) + GAP_TOLERANCE;
            // What may come from both sides has landed as soon as it is close: from there on nobody could
            // tell from which.
            let (sign, depth) = if guard.counts_both_ways(&sim.model) && start.abs() > DEPTH {
                (start.signum(), -DEPTH)
            } else {
                (1.0, DEPTH)
            };
            let (start, end) = (sign * start, sign * end);
            if end < -depth && end < start && (start > -DEPTH || push_only) {
                let theta = start.max(0.0) / (start - end);
                if first.is_none_or(|(least, ..)| theta < least) {
                    first = Some((theta, guard, sign));
                }
            }
        }
        first.map(|(_, guard, sign)| (guard, sign))
    }
}
