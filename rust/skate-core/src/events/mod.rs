//! Events: transitions from one contact mode to the next. Two-way contact follows the table of transition
//! rules, `EDGES`. In push-only contact the next mode follows from the contact law alone.

mod edges;
mod frame;
pub mod guard;
pub mod guards;
mod impact;
mod kick;
pub mod leg_swap;
mod next_mode;
pub mod observer;
mod stop;

pub use edges::{EDGES, Edge};

use crate::{
    contact::equations::{Y, Z},
    error::Termination,
    events::{
        guard::Guard,
        observer::{Observer, Operation},
    },
    model::{
        Model,
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact, touches},
        controller_state::Phase,
        friction::FrictionMode,
        layout::NV,
        state::State,
    },
    rhs::Evaluation,
    scene::PushOffStart,
};

/// A landing slower than this brings all closed ends to rest [m/s]. Rigid soles would otherwise rock from end to
/// end with ever shorter flights, a million impacts per second.
const SLOW_LANDING: f64 = 1e-3;
/// Below this speed an end of a sole is at rest [m/s].
pub(crate) const REST: f64 = 1e-9;
/// A sliding foot is wedged if friction multiplies its normal force by more than this; below, the torques cause a
/// large load.
const WEDGE_GAIN: f64 = 5.0;

/// Carries a state and its workspace through an event.
pub struct EventHandler<'a> {
    pub model: &'a Model,
    pub eval: &'a mut Evaluation,
    pub state: &'a mut State,
    /// Held joint torques; a swap of the legs reorders them.
    pub residual: &'a mut [f64; NV],
    observer: Option<&'a mut dyn Observer>,
    /// Forces (y, z) on the feet before the event [N].
    forces: [[f64; 2]; 2],
    /// Contacts and positions for which `eval` contains the kinematics, if set in this event.
    frame: Option<((SoleContact, SoleContact), [f64; NV])>,
    /// Contact of the free foot for which M is still to be factored there.
    unfactored: Option<SoleContact>,
}

impl<'a> EventHandler<'a> {
    pub fn new(
        model: &'a Model,
        eval: &'a mut Evaluation,
        state: &'a mut State,
        residual: &'a mut [f64; NV],
        observer: Option<&'a mut dyn Observer>,
    ) -> Self {
        let forces = [&eval.solution.f_root, &eval.solution.lam].map(|f| [f[Y], f[Z]]);
        Self {
            model,
            eval,
            state,
            residual,
            observer,
            forces,
            frame: None,
            unfactored: None,
        }
    }

    /// Tell the observer about an operation.
    fn observe(&mut self, operation: Operation) {
        if let Some(observer) = &mut self.observer {
            observer.operation(operation);
        }
    }

    /// The transition when `guard` has fallen through zero.
    ///
    /// # Errors
    /// `Fall`; `Jam` or `Singular` where no next mode is consistent.
    pub fn handle(&mut self, guard: Guard) -> Result<(), Termination> {
        let before = self.state.mode;
        self.transition(guard)?;
        self.update_phase(before);
        Ok(())
    }

    /// Open the ends that are not on the ice in a mode that a time step has found. The feet slide on as before: how they
    /// move in that mode is a result of the step.
    pub fn open_ends(&mut self, mode: ContactMode) {
        let before = self.state.mode;
        let foot = |which| Foot::new(mode.foot(which).touch, before.foot(which).friction_mode);
        self.set_mode(ContactMode {
            support: foot(SUPPORT),
            free: foot(FREE),
        });
        self.update_phase(before);
    }

    /// Record the time from which a law of the feedforward counts.
    fn update_phase(&mut self, before: ContactMode) {
        let after = self.state.mode;
        let phase = Phase::of(after);
        let changed = phase != Phase::of(before);
        let flat = |mode: ContactMode| mode.free.touch == SoleContact::Flat;
        let t2 = (self.model.scene.control.feedforward.as_ref())
            .map_or(PushOffStart::Rotation, |law| law.t2);
        let controller = &mut self.state.controller;
        if changed && phase == Some(Phase::Touched) {
            controller.t1 = self.state.t;
            self.observe(Operation::PhaseBegins(1));
        }
        let begins = match t2 {
            PushOffStart::Rotation => changed && phase == Some(Phase::PushOff),
            PushOffStart::Flat => flat(after) && !flat(before),
        };
        if begins {
            self.state.controller.t2 = self.state.t;
            self.observe(Operation::PhaseBegins(2));
        }
    }

    fn transition(&mut self, guard: Guard) -> Result<(), Termination> {
        let before = self.state.mode;
        let contacts = touches(before);
        let mut next = before;
        let mut sliding = [sliding_mode(before.support), sliding_mode(before.free)];
        match guard {
            Guard::Fall => return Err(Termination::Fall),
            Guard::Gap(..) => {
                (next.support.touch, next.free.touch) = guard.landed(contacts);
                let landed = next;
                if self.model.contact.is_push_only {
                    next = self.with_close_ends(next, &self.sole_points(), 0.0);
                }
                return self.close_contacts(next, landed);
            }
            Guard::Load(..) if !self.model.contact.is_push_only => {
                let edge = EDGES
                    .iter()
                    .find(|edge| edge.guard == guard && edge.starts_from(contacts))
                    .ok_or(Termination::Jam)?;
                let (support, free) = edge.target(contacts);
                if edge.swap {
                    self.stop_feet();
                    self.swap(before.free);
                    self.stop_new_support();
                    (next, sliding) = (self.state.mode, [sliding[FREE], None]);
                } else if free == SoleContact::Air {
                    let slides =
                        before.free.friction_mode.has_dry_friction() && !before.free.pulled;
                    if slides && !self.free_foot_rises()? {
                        return self.stop_wedged_foot(before, sliding, &[FREE]);
                    }
                    next.free = Foot::AIR;
                } else {
                    next.support.touch = support;
                }
            }
            Guard::Load(..) | Guard::Pull(_) => {}
            Guard::ConeForward(which) | Guard::ConeBackward(which) => sliding[which] = None,
            Guard::Wedge(which) if before.foot(which).pulled => return Ok(()),
            // Friction in the direction of sliding: the foot is pulled, and friction keeps the sign of its normal force.
            Guard::Wedge(which) if self.eval.solution.normal_force(which) < 0.0 => {
                next = before.with_reversed_pull(which);
            }
            Guard::Wedge(which) => {
                let problem = &self.eval.factored.problem;
                let gain = problem.load_gain(self.model, before, which)?;
                if (0.0..WEDGE_GAIN).contains(&gain) {
                    return Ok(());
                }
                return match self.stop_wedged_foot(before, sliding, &[which]) {
                    // Before the paradox an impact cannot yet stop the foot. It slides on under a large force.
                    Err(Termination::Jam) if gain > 0.0 => Ok(()),
                    result => result,
                };
            }
            Guard::Reversal(which) => sliding = self.reverse(which)?,
            Guard::Speed(which) => {
                if !self.capture(which)? {
                    return Ok(());
                }
                sliding[which] = None;
                return self.select_mode(self.state.mode, sliding, None);
            }
        }
        if self.model.contact.is_push_only {
            next = self.with_resting_ends(next);
            for (sliding, (old, new)) in sliding
                .iter_mut()
                .zip([(before.support, next.support), (before.free, next.free)])
            {
                if old.touch == SoleContact::Air {
                    *sliding = sliding_mode(new);
                }
            }
        }
        self.select_mode(next, sliding, Some((before, guard)))
    }

    /// Would the free foot rise from the ice without contact force? With friction beyond Painleve's paradox it would
    /// land again at once, without end. The present force, zero up to rounding, does not decide that.
    fn free_foot_rises(&self) -> Result<bool, Termination> {
        let problem = &self.eval.factored.problem;
        Ok(problem.load_gain(self.model, self.state.mode, FREE)? > 0.0)
    }
}

/// Friction mode of a foot that slides.
fn sliding_mode(foot: Foot) -> Option<FrictionMode> {
    foot.slides().then_some(foot.friction_mode)
}
