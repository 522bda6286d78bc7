//! Events: transitions from one contact mode to the next. Two-way contact follows the table of transition
//! rules, `EDGES`. In push-only contact the next mode follows from the contact law alone.

mod edges;
pub mod guards;
mod impact;
mod kick;
pub mod leg_swap;

pub use edges::{EDGES, Edge};

use crate::{
    contact::mode_selection::{ModeQuery, Tolerance, amplification, select},
    error::Termination,
    events::guards::{FORCE_SLACK, Guard},
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, Foot, FrictionMode, SUPPORT, SoleContact, touches},
        controller_state::Phase,
        layout::{NV, reverse_legs},
        state::State,
    },
    rhs::{Evaluation, StepContext, sole_points::SolePoints},
};

/// An end that lands counts others this close to the ice as landing with it [m],
const CLOSE: f64 = 1e-9;
/// and this close if they are slow.
const HOVERING: f64 = 1e-8;
/// A landing slower than this brings all ends on the ice to rest [m/s]. A hard sole would go on
/// rattling from end to end, two feet from toe to toe, each landing kicking the other end up, a million
/// times a second.
const SLOW_LANDING: f64 = 1e-3;
/// A large load on a sliding foot is the torques' work unless friction multiplies it by more than this.
const WEDGE_GAIN: f64 = 5.0;
/// Slower than this an end of a sole is at rest [m/s].
const REST: f64 = 1e-9;

/// Make a state and its workspace pass an event.
pub struct EventHandler<'a> {
    pub model: &'a Model,
    pub eval: &'a mut Evaluation,
    pub state: &'a mut State,
    /// Held joint torques; the joints' names change with the legs'.
    pub residual: &'a mut [f64; NV],
    /// The contacts and the positions for which `eval` knows the bodies, if in this event.
    pub entered: Option<((SoleContact, SoleContact), [f64; NV])>,
    /// The free foot's touch for which M there is still to be factored.
    pub unfactored: Option<SoleContact>,
}

impl EventHandler<'_> {
    /// Carry out what follows when `guard` has fallen through zero.
    ///
    /// # Errors
    /// `Fall`; `Jam` or `Singular` where no next mode is consistent.
    pub fn through(&mut self, guard: Guard) -> Result<(), Termination> {
        let phase = Phase::of(self.state.mode);
        self.pass(guard)?;
        self.note_phase(phase);
        Ok(())
    }

    /// Take over a mode that a time step has found, in which ends may have left the ice.
    pub fn open(&mut self, mode: ContactMode) {
        let phase = Phase::of(self.state.mode);
        self.adopt(mode);
        self.note_phase(phase);
    }

    /// Remember when the feedforward's present phase began.
    fn note_phase(&mut self, phase: Option<Phase>) {
        let next = Phase::of(self.state.mode);
        let controller = &mut self.state.controller;
        if next != phase {
            match next {
                Some(Phase::Touched) => controller.t1 = self.state.t,
                Some(Phase::PushOff) => controller.t2 = self.state.t,
                _ => {}
            }
        }
    }

    fn pass(&mut self, guard: Guard) -> Result<(), Termination> {
        let before = self.state.mode;
        let mut near = before;
        let mut decided = [moving(before.support), moving(before.free)];
        match guard {
            Guard::Fall => return Err(Termination::Fall),
            Guard::Gap(..) => {
                (near.support.touch, near.free.touch) = landed(touches(before), guard);
                if self.model.contact.is_unilateral() {
                    near = self.with_close_ends(near, &self.sole_points());
                }
                return self.begin(near);
            }
            Guard::Load(..) if !self.model.contact.is_unilateral() => {
                let from = (before.support.touch, before.free.touch);
                let edge = EDGES.iter().find(|e| e.guard == guard && e.from == from);
                let edge = edge.ok_or(Termination::Jam)?;
                if edge.swap {
                    self.swap(before.free);
                    self.settle();
                    (near, decided) = (self.state.mode, [decided[FREE], None]);
                } else if edge.to.1 == SoleContact::Air {
                    if before.free.friction_mode.has_dry_friction() && !self.would_rise()? {
                        return self.wedge(before, [None, decided[FREE]]);
                    }
                    near.free = Foot::AIR;
                } else {
                    near.support.touch = edge.to.0;
                }
            }
            Guard::Load(..) | Guard::Pull(_) => {}
            Guard::ConeForward(which) | Guard::ConeBackward(which) => decided[which] = None,
            Guard::Wedge(which) => {
                let gain = amplification(&self.eval.factored.problem, self.model, before, which)?;
                if (0.0..WEDGE_GAIN).contains(&gain) {
                    return Ok(());
                }
                decided[1 - which] = None;
                return match self.wedge(before, decided) {
                    // Short of the paradox friction cannot yet stop the foot at a blow: it slides on under
                    // a large force.
                    Err(Termination::Jam) if gain > 0.0 => Ok(()),
                    caught => caught,
                };
            }
            Guard::Reversal(which) => {
                self.strike(stuck(before, which))?;
                decided[which] = None;
            }
            Guard::Speed(which) => {
                if !self.capture(which)? {
                    return Ok(());
                }
                decided[which] = None;
                return self.choose(self.state.mode, decided, None);
            }
        }
        if self.model.contact.is_unilateral() {
            near = self.with_resting_ends(near);
            for (decided, (old, new)) in decided
                .iter_mut()
                .zip([(before.support, near.support), (before.free, near.free)])
            {
                if old.touch == SoleContact::Air {
                    *decided = moving(new);
                }
            }
        }
        self.choose(near, decided, Some((before, guard)))
    }

    /// Would the free foot rise from the ice if that let go of it? Where friction drags it down
    /// (Painleve) it would land again at once, and so without end. Its force, zero but for rounding, cannot tell.
    fn would_rise(&self) -> Result<bool, Termination> {
        let problem = &self.eval.factored.problem;
        Ok(amplification(problem, self.model, self.state.mode, FREE)? > 0.0)
    }

    /// Ends that are about to land at the same instant land together; one by one they would rattle.
    fn with_close_ends(&self, near: ContactMode, sole_points: &SolePoints) -> ContactMode {
        self.with_ends(near, sole_points, |gap, speed| {
            gap <= CLOSE || gap <= HOVERING && speed.abs() <= SLOW_LANDING
        })
    }

    /// An end that has opened at this very instant may still close: other torques have come since.
    fn with_resting_ends(&self, near: ContactMode) -> ContactMode {
        self.with_ends(near, &self.sole_points(), |gap, speed| {
            gap <= CLOSE && speed.abs() <= REST
        })
    }

    /// The mode with the ends closed of which height and vertical speed say so, too.
    fn with_ends(
        &self,
        near: ContactMode,
        sole_points: &SolePoints,
        closed: impl Fn(f64, f64) -> bool,
    ) -> ContactMode {
        let ends = sole_points.closed_ends(self.model, closed);
        let with = |foot: Foot, touch: SoleContact, which: usize| {
            let friction_mode = match foot.touch {
                SoleContact::Air => {
                    let [along, _] = sole_points.speeds[which][usize::from(!touch.heel())];
                    self.model.friction.mode_at(along, REST)
                }
                _ => foot.friction_mode,
            };
            let heel = foot.touch.heel() || touch.heel();
            Foot::new(
                SoleContact::of(heel, foot.touch.toe() || touch.toe()),
                friction_mode,
            )
        };
        ContactMode {
            support: with(near.support, ends.0, SUPPORT),
            free: with(near.free, ends.1, FREE),
        }
    }

    /// Where the ends of the soles are and how they move; `eval` knows the velocities.
    fn sole_points(&self) -> SolePoints {
        let State { q, mode, .. } = &*self.state;
        SolePoints::of_one(self.model, &self.eval.kin, *mode, q[1])
    }

    /// The same after the event, when `eval` may not know where they have come to.
    pub fn marks_after(&mut self) -> SolePoints {
        let State { q, v, mode, .. } = &*self.state;
        if self.entered == Some((touches(*mode), *q)) {
            self.eval.kin.planar_velocities(self.model, v);
        } else {
            self.eval.move_planar(self.model, *mode, q, v);
        }
        self.sole_points()
    }

    /// Find the mode in which the motion goes on, given which feet move already and which mode has ended
    /// by which guard, and take it over.
    pub fn choose(
        &mut self,
        near: ContactMode,
        moving: [Option<FrictionMode>; 2],
        ended: Option<(ContactMode, Guard)>,
    ) -> Result<(), Termination> {
        self.enter_frame(near);
        self.factor();
        let frozen = StepContext::of(self.model, self.state, self.residual);
        let (q, v) = (self.state.q, self.state.v);
        self.eval.load(self.model, &q, &v, &frozen);
        let force = FORCE_SLACK * self.model.weight();
        let push_only = self.model.contact.is_unilateral();
        let closed = [near.support.touch, near.free.touch];
        let question = ModeQuery {
            closed,
            may_carry: match ended {
                Some((_, Guard::Load(which, end))) if push_only => lifted(closed, which, end),
                _ => closed,
            },
            moving,
            caught: None,
            slips: match ended {
                Some((_, Guard::ConeForward(which) | Guard::ConeBackward(which))) => Some(which),
                _ => None,
            },
            // An end that might close once more is not to be preferred for that.
            near: match ended {
                Some((before, Guard::Load(..))) if push_only => before,
                _ => near,
            },
            not: ended.map(|(mode, _)| mode),
            tolerance: Tolerance {
                force,
                motion: 10.0 * force / self.model.mass(),
            },
        };
        let problem = &self.eval.factored.problem;
        let mut found = select(self.model, problem, &question).map(|(mode, _)| mode);
        if ended.is_some() {
            // A guard passed a little early: the end carries on, the other foot slips, or nothing but the old
            // mode is left, which soon ends anew.
            for not in [question.not, None] {
                if found == Err(Termination::Jam) {
                    let carry_on = ModeQuery {
                        may_carry: closed,
                        slips: None,
                        not,
                        ..question
                    };
                    found = select(self.model, problem, &carry_on).map(|(mode, _)| mode);
                }
            }
        }
        match found {
            Ok(mode) => self.adopt(mode),
            Err(Termination::Jam) => self.wedge(near, moving)?,
            Err(cause) => return Err(cause),
        }
        Ok(())
    }

    /// Take over a mode: the pivot moves, a free foot that carries the robot alone takes its name.
    fn adopt(&mut self, mode: ContactMode) {
        let before = self.state.mode.free;
        leg_swap::move_pivot(self.model, self.state, mode.support.touch);
        self.state.mode = mode;
        if mode.support.touch == SoleContact::Air && mode.free.touch != SoleContact::Air {
            self.swap(mode.free);
        }
        self.settle();
        if !mode.free.slides() && mode.free != before {
            self.set_anchor();
        }
    }

    /// The free foot becomes the supporting one. A held torque stays on the joint it was put on.
    fn swap(&mut self, support: Foot) {
        leg_swap::swap(self.model, self.eval, self.state, support, Foot::AIR);
        reverse_legs(self.residual);
    }

    /// Move the state and the workspace to the frame in which `mode`'s contacts are closed; `factor` follows
    /// where forces are asked for.
    fn enter_frame(&mut self, mode: ContactMode) {
        leg_swap::move_pivot(self.model, self.state, mode.support.touch);
        let State { q, v, .. } = &*self.state;
        if self.entered == Some((touches(mode), *q)) {
            // Nothing but velocities has changed.
            self.eval.change_velocities(self.model, mode, v);
            return;
        }
        self.eval.move_planar(self.model, mode, q, v);
        self.entered = Some((touches(mode), *q));
        self.unfactored = Some(mode.free.touch);
    }

    /// Set up the contact problem where the frame was entered, if that is still to be done.
    fn factor(&mut self) {
        if let Some(free) = self.unfactored.take() {
            self.eval.assemble(self.model, free);
        }
    }

    /// Set exactly what the mode fixes on the supporting foot.
    fn settle(&mut self) {
        let State { q, v, mode, .. } = self.state;
        if mode.support.touch == SoleContact::Air {
            return;
        }
        (q[1], v[1]) = (0.0, 0.0);
        if mode.support.touch == SoleContact::Flat {
            (q[2], v[2]) = (0.0, 0.0);
        }
        if !mode.support.slides() {
            v[0] = 0.0;
        }
    }

    /// Remember where the free foot sticks.
    pub fn set_anchor(&mut self) {
        let (q, v) = (self.state.q, self.state.v);
        self.eval.move_legs(self.model, self.state.mode, &q, &v);
        let sole = &self.model.sole;
        let along = if self.state.mode.free.touch == SoleContact::Toe {
            sole.toe
        } else {
            sole.heel
        };
        self.state.anchor = q[0] + self.eval.kin.sole_point(self.model, along).y;
    }
}

/// Parts of the soles on the ice after an end has come down to it.
pub fn landed(
    (support, free): (SoleContact, SoleContact),
    guard: Guard,
) -> (SoleContact, SoleContact) {
    let with = |touch: SoleContact, end| match end {
        End::Heel => SoleContact::of(true, touch.toe()),
        End::Toe => SoleContact::of(touch.heel(), true),
    };
    match guard {
        Guard::Gap(SUPPORT, end) => (with(support, end), free),
        Guard::Gap(_, end) => (support, with(free, end)),
        _ => (support, free),
    }
}

/// Parts of the soles on the ice after an end has let go.
fn lifted(mut closed: [SoleContact; 2], which: usize, end: End) -> [SoleContact; 2] {
    let touch = closed[which];
    closed[which] = match end {
        End::Heel => SoleContact::of(false, touch.toe()),
        End::Toe => SoleContact::of(touch.heel(), false),
    };
    closed
}

/// The direction of a foot that already slides.
fn moving(foot: Foot) -> Option<FrictionMode> {
    foot.slides().then_some(foot.friction_mode)
}

/// The mode with one foot stuck.
fn stuck(mut mode: ContactMode, which: usize) -> ContactMode {
    let foot = if which == SUPPORT {
        &mut mode.support
    } else {
        &mut mode.free
    };
    *foot = Foot::new(foot.touch, FrictionMode::Stuck);
    mode
}
