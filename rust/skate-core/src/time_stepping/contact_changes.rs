//! Changes of the contact mode between and during steps.

use crate::{
    error::Termination,
    events::{EventHandler, REST, guard::Guard},
    model::{
        contact_mode::{ContactMode, End, SoleContact, touches},
        friction::FrictionMode,
        state::State,
    },
    sim::Simulation,
};

/// Maximum height above the ice of an end that is on it [m].
const CLOSED_GAP: f64 = 1e-9;

impl Simulation {
    /// In push-only contact, close all ends that are on the ice and stay on it for half a step. An open end that rises
    /// stays open: in its first step after a release it may rise by less than rounding.
    pub(super) fn close_ends(&mut self, h: f64) -> Result<(), Termination> {
        let mode = self.state.mode;
        let ends = |most: f64| {
            self.sole_points.closed_ends(&self.model, |gap, rise| {
                gap.max(gap + 0.5 * h * rise) <= CLOSED_GAP && rise <= most
            })
        };
        let (staying, resting) = (ends(f64::INFINITY), ends(REST));
        let of = |before: SoleContact, stays: SoleContact, rests: SoleContact| {
            let [heel, toe] = [End::Heel, End::Toe]
                .map(|end| rests.has(end) || stays.has(end) && before.has(end));
            SoleContact::of(heel, toe)
        };
        let closed = (
            of(mode.support.touch, staying.0, resting.0),
            of(mode.free.touch, staying.1, resting.1),
        );
        if closed != touches(mode) {
            let before = self.state;
            self.apply_event(&before, |handler| handler.close_ends(mode, closed))?;
        }
        Ok(())
    }

    /// Apply a landing, or a release in two-way contact, at the present state.
    pub(super) fn land(&mut self, guard: Guard) -> Result<(), Termination> {
        let (before, sole_points) = (self.state, self.sole_points);
        self.apply_event(&before, |handler| handler.land(guard, &sole_points))
    }

    /// Apply an event, update the sole points and record the change since the state `before`.
    pub(super) fn apply_event(
        &mut self,
        before: &State,
        event: impl FnOnce(&mut EventHandler<'_>) -> Result<(), Termination>,
    ) -> Result<(), Termination> {
        let mut handler = self.event_handler();
        event(&mut handler)?;
        self.sole_points = handler.sole_points_after();
        self.record_mode_change(before)
    }

    /// Count and log a change of the contact mode since the state `before`.
    pub(super) fn record_mode_change(&mut self, before: &State) -> Result<(), Termination> {
        if before.mode == self.state.mode {
            return Ok(());
        }
        if let Some(guard) = guard_between(before.mode, self.state.mode) {
            self.stats.events += 1;
            self.charge()?;
            self.record_change(guard.describe(), before.mode, before.support_leg);
        }
        Ok(())
    }
}

/// The guard whose event leads from one mode to another, by the first difference between them.
fn guard_between(from: ContactMode, to: ContactMode) -> Option<Guard> {
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
        match to.friction_mode {
            _ if from.friction_mode == to.friction_mode && from.pulled != to.pulled => {
                return Some(Guard::Pull(which));
            }
            friction_mode if from.friction_mode == friction_mode => {}
            FrictionMode::Stuck => return Some(Guard::Reversal(which)),
            FrictionMode::Backward => return Some(Guard::ConeBackward(which)),
            FrictionMode::Forward | FrictionMode::Frictionless => {
                return Some(Guard::ConeForward(which));
            }
        }
    }
    None
}
