//! What a step tries: the whole of it, and where contacts change in it the parts up to there. It asks for
//! one motion after the other; who computes them, alone or many at a time, it need not know.

use super::{super::Simulation, feet::Freedom, height::Height, longest};
use crate::{
    contact::{Mode, Touch},
    error::EndCause,
    guards::{GAP_TOLERANCE, Guard, Guards},
    marks::Marks,
    scene::ContactLaw,
    state::State,
    transition::{landed, touches},
};

/// How often a step may begin anew because contacts have changed.
const CHANGES: u32 = 8;
/// An end this far below the ice has landed [m].
const DEPTH: f64 = 1e-6;
/// A landing is located to this [m], with as many trials at most.
const LANDED: f64 = 1e-5;
const TRIALS: usize = 6;
/// A step that has more than this share of a long one's length is one.
const LONG: f64 = 0.51;
/// What a foot does that moves by less need not be resolved [m].
const STILL: f64 = 1e-6;
/// What happens in this share of a step happens at its start.
const AT_ONCE: f64 = 0.01;

/// A motion that somebody wants: by `h` from `start`.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    pub start: State,
    pub h: f64,
    pub freedom: Freedom,
}

/// See the module's documentation.
#[derive(Debug, Clone)]
pub(super) struct Stepping {
    pub wish: Wish,
    /// The step's length, and that of a long one [s].
    pub h: f64,
    long: f64,
    /// Of the mode in which a step last began.
    guards: Guards,
    guarded: Mode,
    /// At the start of the present attempt.
    marks: Marks,
    /// What was on the ice before some of it left.
    closed: (Touch, Touch),
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
    Past,
    /// Half of the step, after a force at the end of the whole.
    Half {
        guard: Guard,
        whole: f64,
    },
    /// Where a foot lets go.
    Release {
        guard: Guard,
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
            wish: Wish {
                start: sim.state,
                h: 0.0,
                freedom: Freedom {
                    near: sim.state.mode,
                    decided: false,
                },
            },
            h: 0.0,
            long: 0.0,
            guards: Guards::of(&sim.model, sim.state.mode),
            guarded: sim.state.mode,
            marks: sim.marks,
            closed: touches(sim.state.mode),
            changes: 0,
            trial: Trial::Whole,
        }
    }

    /// A step of `h` from the present state; half of that, if it is a `long` one, where a foot begins to stick
    /// or to slide in it, or the ice to pull.
    pub fn begin(&mut self, sim: &mut Simulation, h: f64, long: f64) -> Result<(), EndCause> {
        self.wish.freedom = Freedom {
            near: sim.state.mode,
            decided: false,
        };
        if sim.model.scene.contact.law == ContactLaw::PushOnly {
            sim.close_ends(h)?;
        }
        self.closed = touches(sim.state.mode);
        (self.h, self.long, self.changes) = (h, long, 0);
        self.attempt(sim);
        Ok(())
    }

    /// Begin anew from the present state, whose contacts have just changed; they may ask for a shorter step.
    fn restart(&mut self, sim: &mut Simulation) -> Progress {
        let longest = longest(self.long, &sim.state).min(sim.until_noticed());
        self.h = self.h.min(longest);
        self.attempt(sim)
    }

    /// Wish for the whole step from the present state.
    fn attempt(&mut self, sim: &mut Simulation) -> Progress {
        self.changes += 1;
        self.wish.start = sim.state;
        (self.wish.h, self.trial) = (self.h, Trial::Whole);
        self.marks = sim.marks;
        Progress::Wants
    }

    /// Will more be asked of the motion than where it leads? Whether a foot can let go says its contact
    /// problem.
    pub fn wants_problem(&self) -> bool {
        matches!(self.trial, Trial::Half { .. } | Trial::Release { .. })
    }

    fn wish(&mut self, h: f64, trial: Trial) -> Progress {
        (self.wish.h, self.trial) = (h, trial);
        Progress::Wants
    }

    /// Go on after the wish has come true; `mode` is the contact state that the impulses were consistent
    /// with. If it has other touches than the start's, nothing has moved.
    pub fn after(&mut self, sim: &mut Simulation, mode: Mode) -> Result<Progress, EndCause> {
        match self.trial {
            Trial::Whole => self.after_whole(sim, mode),
            Trial::Landing {
                guard,
                sign,
                a,
                b,
                left,
            } => {
                let now = Height::of(&sim.marks, guard, sign, self.wish.h);
                if now.gap.abs() < LANDED || left == 0 {
                    // What lets go before that comes first.
                    self.h = self.wish.h;
                    return self.release_or_finish(sim, Some(guard));
                }
                let (a, b) = if now.gap > 0.0 { (now, b) } else { (a, now) };
                self.landing(sim, (guard, sign), (a, b), left)
            }
            Trial::Past => self.finish(sim, None),
            Trial::Half { guard, whole } => {
                let half = load(sim, guard, self.wish.start.mode);
                let h = self.h;
                let at = 0.25 * h * (1.0 + half / (half - whole));
                if half <= whole || at <= AT_ONCE * h {
                    return self.release_at_once(sim, guard);
                }
                Ok(self.wish(at.min(h), Trial::Release { guard }))
            }
            Trial::Release { guard } => self.finish(sim, Some(guard)),
        }
    }

    fn after_whole(&mut self, sim: &mut Simulation, mode: Mode) -> Result<Progress, EndCause> {
        let before = self.wish.start.mode;
        if touches(mode) != touches(before) {
            // Once only: the next attempt stays with this mode.
            self.closed = touches(before);
            sim.state = self.wish.start;
            sim.happen(&self.wish.start, |passage| {
                passage.open(mode);
                Ok(())
            })?;
            self.wish.freedom.decided = true;
            return Ok(self.restart(sim));
        }
        // Only one foot is on the ice then.
        let way = sim.state.q[0] - self.wish.start.q[0];
        if mode != before && self.h > LONG * self.long && way.abs() > STILL {
            self.h *= 0.5;
            sim.state = self.wish.start;
            sim.marks = self.marks;
            return Ok(self.attempt(sim));
        }
        // What ends the mode in which the step began.
        if before != self.guarded {
            self.guarded = before;
            self.guards = Guards::of(&sim.model, before);
        }
        // After a landing forces are others: whether a foot lets go says the motion up to there.
        let Some((guard, sign)) = self.landed(sim) else {
            return self.release_or_finish(sim, None);
        };
        let mut start = Height::of(&self.marks, guard, sign, 0.0);
        // It may have been a little below.
        start.gap = start.gap.max(0.0);
        let end = Height::of(&sim.marks, guard, sign, self.h);
        self.landing(sim, (guard, sign), (start, end), TRIALS)
    }

    /// After a motion of the step's length: wish for half of it if a foot lets go in it, else finish.
    fn release_or_finish(
        &mut self,
        sim: &mut Simulation,
        event: Option<Guard>,
    ) -> Result<Progress, EndCause> {
        let mode = self.wish.start.mode;
        match released(sim, &self.guards, mode) {
            Some(guard) if self.changes <= CHANGES => {
                let whole = load(sim, guard, mode);
                Ok(self.wish(0.5 * self.h, Trial::Half { guard, whole }))
            }
            _ => self.finish(sim, event),
        }
    }

    /// The next trial for a landing between two instants.
    fn landing(
        &mut self,
        sim: &mut Simulation,
        (guard, sign): (Guard, f64),
        (a, b): (Height, Height),
        left: usize,
    ) -> Result<Progress, EndCause> {
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
    fn land_at_once(&mut self, sim: &mut Simulation, guard: Guard) -> Result<Progress, EndCause> {
        let left = self.wish.freedom.decided && landed(self.closed, guard) == self.closed;
        if !left && self.changes <= CHANGES {
            self.wish.freedom.decided = false;
            sim.state = self.wish.start;
            sim.marks = self.marks;
            sim.land(guard)?;
            return Ok(self.restart(sim));
        }
        Ok(self.wish(self.h, Trial::Past))
    }

    /// A foot lets go where the step begins.
    fn release_at_once(
        &mut self,
        sim: &mut Simulation,
        guard: Guard,
    ) -> Result<Progress, EndCause> {
        let start = self.wish.start;
        sim.state = start;
        sim.happen(&start, |passage| passage.through(guard))?;
        Ok(self.restart(sim))
    }

    fn finish(&self, sim: &mut Simulation, event: Option<Guard>) -> Result<Progress, EndCause> {
        let start = &self.wish.start;
        let (solution, marks) = (&sim.eval.solution, &sim.marks);
        sim.monitor
            .watch(&sim.model, (solution, marks), start, &sim.state);
        sim.remember(start)?;
        Ok(Progress::Done(event))
    }

    /// The end that lands first since the start, by straight lines, and the side from which it comes.
    fn landed(&self, sim: &Simulation) -> Option<(Guard, f64)> {
        let push_only = sim.model.scene.contact.law == ContactLaw::PushOnly;
        let mut first: Option<(f64, Guard, f64)> = None;
        for &guard in self.guards.as_slice() {
            let Guard::Gap(which, end) = guard else {
                continue;
            };
            let start = self.marks.gap(which, end) + GAP_TOLERANCE;
            let end = sim.marks.gap(which, end) + GAP_TOLERANCE;
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

/// Two-way contact: the end of a sole that the ice would have to hold down, and that may let go.
fn released(sim: &Simulation, guards: &Guards, mode: Mode) -> Option<Guard> {
    if sim.model.scene.contact.law == ContactLaw::PushOnly {
        return None;
    }
    let mut guards = guards.as_slice().iter().copied();
    guards.find(|&guard| matches!(guard, Guard::Load(..)) && load(sim, guard, mode) < 0.0)
}

/// The force that a guard watches.
fn load(sim: &Simulation, guard: Guard, mode: Mode) -> f64 {
    guard.value(&sim.model, &sim.eval, mode, (0.0, 0.0))
}
