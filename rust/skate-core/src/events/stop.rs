//! Feet that stop sliding: capture below the capture speed, and wedging by friction.

use crate::{
    contact::{
        conditions::Tolerance,
        equations::{Slip, Y},
        mode_query::ModeQuery,
        mode_selection::consistent,
    },
    error::Termination,
    events::{EventHandler, REST, SLOW_LANDING, sliding_mode},
    model::{
        contact_mode::{ContactMode, FREE, SUPPORT},
        friction::FrictionMode,
    },
};

impl EventHandler<'_> {
    /// A foot no longer slides in its direction: it stops, or an impact of the other foot has turned it. Returns the
    /// directions in which the feet slide on. They may stop at the same instant.
    pub(super) fn reverse(
        &mut self,
        which: usize,
    ) -> Result<[Option<FrictionMode>; 2], Termination> {
        let mode = self.state.mode;
        self.update_frame(mode);
        if self.speed(which).abs() <= REST {
            self.state.energy_balance.impacts += self.apply_impact(mode.with_stuck(which))?;
            self.update_frame(mode);
        }
        Ok([SUPPORT, FREE].map(|which| {
            let direction = sliding_mode(mode.foot(which))?;
            if !direction.has_dry_friction() {
                return Some(direction);
            }
            let speed = self.speed(which);
            let forward = FrictionMode::of(speed, REST);
            (forward != FrictionMode::Stuck).then_some(forward)
        }))
    }

    /// Stop a slow foot if the friction cone holds the force on it; returns whether it stopped.
    pub(super) fn capture(&mut self, which: usize) -> Result<bool, Termination> {
        let mode = self.state.mode.with_stuck(which);
        let mut sliding = [sliding_mode(mode.support), sliding_mode(mode.free)];
        sliding[which] = None;
        let closed = [mode.support.touch, mode.free.touch];
        let exact = Tolerance {
            force: 0.0,
            motion: 0.0,
        };
        let query = ModeQuery::new(closed, sliding, mode, exact);
        if consistent(self.model, &self.eval.factored.problem, &query, mode)?.is_none() {
            return Ok(false);
        }
        let lost = self.apply_impact(mode)?;
        self.state.energy_balance.capture += lost;
        self.set_mode(mode);
        Ok(true)
    }

    /// Where sliding has no consistent force (Painleve 1895), a sliding foot, the first of `feet` that can, stops in a
    /// tangential impact, the limit of a stiff contact (Genot and Brogliato 1999). A foot that has stopped at this
    /// instant is held.
    pub(super) fn stop_wedged_foot(
        &mut self,
        mode: ContactMode,
        sliding: [Option<FrictionMode>; 2],
        feet: &[usize],
    ) -> Result<(), Termination> {
        for &which in feet {
            if !sliding[which].is_some_and(FrictionMode::has_dry_friction) {
                continue;
            }
            let mut sliding = sliding;
            sliding[which] = None;
            let stopped = [SUPPORT, FREE]
                .into_iter()
                .filter(|&foot| sliding[foot].is_none());
            let stuck = stopped.fold(mode, ContactMode::with_stuck);
            if self.model.contact.is_push_only {
                if self.speed(which).abs() < SLOW_LANDING {
                    // An impact this slow would only lift the other ends.
                    let lost = self.apply_impact_with(stuck, Slip::default())?;
                    self.state.energy_balance.impacts += lost;
                    self.set_mode(stuck);
                    return self.select_mode(stuck, sliding, None);
                }
                match self.impact(mode, stuck, Some(which)) {
                    Err(Termination::Jam) => continue,
                    result => result?,
                };
                return self.select_mode_after_impact(mode);
            }
            self.state.energy_balance.impacts += self.apply_impact(stuck)?;
            self.set_mode(stuck);
            return self.select_mode(stuck, sliding, None);
        }
        Err(Termination::Jam)
    }

    /// Velocity along the ice of a foot on it, from the velocities in `eval` [m/s].
    fn speed(&self, which: usize) -> f64 {
        match which {
            SUPPORT => self.state.v[0],
            _ => self.eval.point_velocity[Y],
        }
    }
}
