//! Time-stepping after Moreau (1988): steps of fixed length in which contacts act by impulses.
//!
//! A step is evaluated once, at the middle of the way that the old velocities would take: the rule is of
//! order 2 while nothing happens. Friction of the joints, visual lifting and the head's damping act on
//! the mean of old and new velocities and positions, M + h/2 D + J^T (h/2 D_h + h^2/4 K_p) J taking the
//! place of M: stiff ones keep no step short. Feet stick and slip by the signs of impulses and new
//! velocities; a landing, and in two-way contact a foot that lets go, ends a step early. A slow foot is
//! not captured: friction itself brings it to rest.

mod glide;
mod locate;

use super::{Simulation, TICK_ROUNDING};
use crate::{
    contact::{Grip, Mode, Solution},
    control::sampled,
    error::EndCause,
    guards::{End, Guard, Guards, MOST},
    model::FREE_FOOT,
    scene::ContactLaw,
    state::State,
    transition::{landed, touches},
};
use glide::Freedom;

/// What is left of the time after a landing, or before a sample, is not stepped if it is this short [s]:
/// divided by it, rounding would be a force.
const SLIVER: f64 = 1e-8;
/// How often a step may begin anew because contacts have changed.
const CHANGES: u32 = 8;
/// An end this far below the ice has landed [m].
const DEPTH: f64 = 1e-6;
/// An end this high above it is on it [m].
const CLOSED: f64 = 1e-9;

impl Simulation {
    /// One step, or a part of it that ends with an event. `eval` knows where the bodies are. Returns the
    /// mean forces if they are those of the present contact state.
    pub(super) fn time_step(
        &mut self,
        step: f64,
        until: f64,
    ) -> Result<Option<Solution>, EndCause> {
        self.count_step()?;
        let left = until - self.state.t;
        if left < SLIVER {
            self.state.t = until;
            return Ok(None);
        }
        let mut h = left / (left / step - 1e-9).ceil().max(1.0);
        let tick = self.tick();
        let angle = self.eval.kin.angle[FREE_FOOT];
        if sampled(&self.model, &self.state, angle) != self.state.clock {
            // The controller will notice at its next sample.
            let next = (tick + 1.0) * self.model.scene.control.sample_period;
            h = h.min((next - self.state.t).max(SLIVER));
        }
        let event = self.settle_contacts(h)?;
        if event.is_none() && h == left {
            self.state.t = until;
        }
        if self.model.scene.fall.is_some()
            && Guard::Fall.value(&self.model, &self.eval, self.state.mode, self.pivot()) <= 0.0
        {
            return Err(EndCause::Fall);
        }
        let forces = self.eval.solution;
        if let Some(guard) = event {
            self.land(guard)?;
        }
        if self.tick() > tick {
            self.sample();
        }
        Ok(event.is_none().then_some(forces))
    }

    /// Move by `h` in the contact state that the impulses are consistent with, or by less, up to a
    /// landing.
    fn settle_contacts(&mut self, h: f64) -> Result<Option<Guard>, EndCause> {
        let mut freedom = Freedom {
            near: self.state.mode,
            decided: false,
        };
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            self.close_ends(h)?;
        }
        // What was on the ice before some of it left.
        let mut closed = touches(self.state.mode);
        let mut changes = 0;
        loop {
            let last = changes >= CHANGES;
            changes += 1;
            let start = self.state;
            let heights = self.heights();
            let mode = self.glide(&start, h, freedom)?;
            if touches(mode) != touches(start.mode) {
                // Once only: the next attempt stays with this mode.
                closed = touches(start.mode);
                self.state = start;
                self.passage().open(mode);
                self.arrive(&start)?;
                freedom.decided = true;
                continue;
            }
            if let Some(guard) = self.released(start.mode)
                && !last
            {
                if self.locate_release(&start, h, guard, freedom)? {
                    self.monitor
                        .watch(&self.model, &self.eval, &start, &self.state);
                    self.remember(&start)?;
                    return Ok(Some(guard));
                }
                self.state = start;
                self.passage().through(guard)?;
                self.arrive(&start)?;
                continue;
            }
            let mut landing = self.landing(&heights);
            if let Some((guard, low)) = landing
                && !self.locate_landing(&start, h, (guard, low), freedom)?
            {
                // It lands where the step begins, unless it has just left the ice.
                let left = freedom.decided && landed(closed, guard) == closed;
                if !left && !last {
                    freedom.decided = false;
                    self.state = start;
                    let State { q, v, mode, .. } = &start;
                    self.eval.move_planar(&self.model, *mode, q, v);
                    self.land(guard)?;
                    continue;
                }
                self.glide(&start, h, freedom)?;
                landing = None;
            }
            self.monitor
                .watch(&self.model, &self.eval, &start, &self.state);
            self.remember(&start)?;
            return Ok(landing.map(|(guard, _)| guard));
        }
    }

    /// Push-only: all ends that are on the ice, and do not leave it within half a step, may act.
    fn close_ends(&mut self, h: f64) -> Result<(), EndCause> {
        let mode = self.state.mode;
        let closed = self
            .passage()
            .closed_ends(|gap, rise| gap.max(gap + 0.5 * h * rise) <= CLOSED);
        if closed != touches(mode) {
            let before = self.state;
            self.passage().close(closed)?;
            self.arrive(&before)?;
        }
        Ok(())
    }

    /// Pass a landing at the present state.
    fn land(&mut self, guard: Guard) -> Result<(), EndCause> {
        let before = self.state;
        self.passage().land(guard)?;
        self.arrive(&before)
    }

    /// The controller's last sample, counted from t = 0.
    fn tick(&self) -> f64 {
        ((self.state.t + TICK_ROUNDING) / self.model.scene.control.sample_period).floor()
    }

    /// Height and velocity of the pivot.
    fn pivot(&self) -> (f64, f64) {
        (self.state.q[1], self.state.v[0])
    }

    /// The state has passed an event: find the bodies, and remember it.
    fn arrive(&mut self, before: &State) -> Result<(), EndCause> {
        let State { q, v, mode, .. } = &self.state;
        self.eval.move_planar(&self.model, *mode, q, v);
        self.remember(before)
    }

    /// Remember what has become of the contacts.
    fn remember(&mut self, before: &State) -> Result<(), EndCause> {
        if let Some(guard) = change(before.mode, self.state.mode) {
            self.stats.events += 1;
            self.spend()?;
            self.note(guard.describe(), before.mode, before.support_leg);
        }
        Ok(())
    }

    /// Guards of landings, at the present state.
    fn heights(&mut self) -> [f64; MOST] {
        let mut heights = [f64::NAN; MOST];
        self.guards = Guards::of(&self.model, self.state.mode);
        for (i, guard) in self.guards.as_slice().iter().enumerate() {
            if matches!(guard, Guard::Gap(..)) {
                heights[i] = guard.value(&self.model, &self.eval, self.state.mode, self.pivot());
            }
        }
        heights
    }

    /// Two-way contact: the end of a sole that the ice would have to hold down, and that may let go.
    fn released(&self, mode: Mode) -> Option<Guard> {
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            return None;
        }
        let guards = self.guards.as_slice().iter();
        guards.copied().find(|guard| {
            matches!(guard, Guard::Load(..))
                && guard.value(&self.model, &self.eval, mode, self.pivot()) < 0.0
        })
    }
}

/// The guard that would have ended `from` with `to`: the first difference between them.
fn change(from: Mode, to: Mode) -> Option<Guard> {
    let feet = [(from.support, to.support), (from.free, to.free)];
    for (which, (from, to)) in feet.into_iter().enumerate() {
        for (end, was, is) in [
            (End::Heel, from.touch.heel(), to.touch.heel()),
            (End::Toe, from.touch.toe(), to.touch.toe()),
        ] {
            match (was, is) {
                (false, true) => return Some(Guard::Gap(which, end)),
                (true, false) => return Some(Guard::Load(which, end)),
                _ => {}
            }
        }
        match to.grip {
            _ if from.grip == to.grip && from.pulled != to.pulled => {
                return Some(Guard::Pull(which));
            }
            grip if from.grip == grip => {}
            Grip::Stuck => return Some(Guard::Reversal(which)),
            Grip::Backward => return Some(Guard::ConeBackward(which)),
            Grip::Forward | Grip::Loose => return Some(Guard::ConeForward(which)),
        }
    }
    None
}
