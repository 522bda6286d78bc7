//! Impacts: landings and the inelastic impact law.

use crate::{
    contact::{
        conditions::Tolerance,
        equations::{Slip, Solution, Y, Z},
        mode_query::ModeQuery,
        mode_selection::select,
    },
    dynamics::bias_forces::energy,
    error::Termination,
    events::{EventHandler, REST, SLOW_LANDING, guard::Guard, observer::Operation, sliding_mode},
    model::{
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact, touches},
        friction::FrictionMode,
        layout::ROOT,
    },
    numeric::trig::nearest_half_turn,
    rhs::{
        projection::{is_on_ice, project_positions, violation},
        sole_points::SolePoints,
    },
};
use nalgebra::Vector3;

/// Impulses and velocities that count as zero [N s], [m/s].
const IMPULSE_TOLERANCE: Tolerance = Tolerance {
    force: 1e-9,
    motion: 1e-11,
};

/// Energy that friction may add in an impact: rounding errors [J].
const MOST_GAINED: f64 = 1e-12;

/// Most movement of a coordinate where an end moves onto the ice [m, rad]: this, and this times the gap.
const MOST_MOVED: f64 = 5e-7;
const MOST_RATIO: f64 = 100.0;

/// An inelastic impact: new velocities and impulses of the feet, and the energy lost [J].
struct Impact {
    mode: ContactMode,
    slip: Slip,
    solution: Solution,
    lost: f64,
}

impl EventHandler<'_> {
    /// Close the ends of `closed`, at a landing or at the start of a motion, and select the next mode. If they cannot all
    /// be moved onto the ice, only those of `landed` are closed.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn close_contacts(
        &mut self,
        mut closed: ContactMode,
        landed: ContactMode,
    ) -> Result<(), Termination> {
        if !self.model.contact.is_push_only {
            let mode = self.impact(self.state.mode, closed, None)?;
            let sliding = [sliding_mode(mode.support), sliding_mode(mode.free)];
            return self.select_mode(mode, sliding, None);
        }
        let before = self.state.mode;
        if !self.close_gaps(closed)? && closed != landed {
            closed = landed;
            self.close_gaps(closed)?;
        }
        if self.approach_speed(closed) < SLOW_LANDING {
            self.stop_slow_landing(before, closed)?;
        } else {
            self.impact(before, closed, None)?;
        }
        self.select_mode_after_impact(closed)
    }

    /// A landing between two time steps, the ends of the soles being at `sole_points`. The next time step
    /// determines the mode from its impulses.
    ///
    /// # Errors
    /// As for `handle`.
    pub fn land(&mut self, guard: Guard, sole_points: &SolePoints) -> Result<(), Termination> {
        if !self.model.contact.is_push_only {
            return self.handle(guard);
        }
        let before = self.state.mode;
        let mut closed = before;
        (closed.support.touch, closed.free.touch) = guard.landed(touches(before));
        // The end lands a little above the ice, or below it.
        let height = match guard {
            Guard::Gap(which, end) => sole_points.gap(which, end),
            _ => 0.0,
        };
        let closed = self.with_close_ends(closed, sole_points, height);
        self.close_gaps(closed)?;
        if self.approach_speed(closed) < SLOW_LANDING {
            self.stop_slow_landing(before, closed)?;
        }
        self.close_ends(before, touches(closed))
    }

    /// Push-only contact, between two time steps, after the mode `before`: close these ends, with an impact if they are
    /// fast.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn close_ends(
        &mut self,
        before: ContactMode,
        (support, free): (SoleContact, SoleContact),
    ) -> Result<(), Termination> {
        let closed = ContactMode {
            support: Foot::new(support, before.support.friction_mode),
            free: Foot::new(free, before.free.friction_mode),
        };
        self.close_gaps(closed)?;
        if self.approach_speed(closed) >= SLOW_LANDING {
            self.impact(before, closed, None)?;
        }
        self.update_frame(closed);
        let friction_mode = |old: Foot, speed: f64| match old.touch {
            SoleContact::Air => self.model.friction.mode_at(speed, REST),
            _ => old.friction_mode,
        };
        let friction_modes = [
            friction_mode(before.support, self.state.v[0]),
            friction_mode(before.free, self.eval.point_velocity[Y]),
        ];
        self.state.mode = ContactMode {
            support: Foot::new(support, friction_modes[0]),
            free: Foot::new(free, friction_modes[1]),
        };
        if support == SoleContact::Air && free != SoleContact::Air {
            self.swap(self.state.mode.free);
        } else if !self.state.mode.free.slides() && self.state.mode.free != before.free {
            self.set_anchor();
        }
        Ok(())
    }

    /// Push-only contact: select the mode among the ends of `closed` that the impact left at rest.
    pub(super) fn select_mode_after_impact(
        &mut self,
        closed: ContactMode,
    ) -> Result<(), Termination> {
        let resting = ContactMode {
            support: self.resting_foot(SUPPORT, closed.support),
            free: self.resting_foot(FREE, closed.free),
        };
        let sliding = [sliding_mode(resting.support), sliding_mode(resting.free)];
        self.select_mode(resting, sliding, None)
    }

    /// Move the closed ends exactly onto the ice. Returns false, and moves nothing, where an almost straight leg would
    /// have to move far.
    pub fn close_gaps(&mut self, closed: ContactMode) -> Result<bool, Termination> {
        let slide = |foot: Foot| Foot::new(foot.touch, FrictionMode::Forward);
        self.update_frame(closed);
        let (start, mode) = (self.state.q, self.state.mode);
        if closed.support.touch != SoleContact::Air {
            self.state.q[1] = 0.0;
            if closed.support.touch == SoleContact::Flat {
                self.state.q[2] = nearest_half_turn(self.state.q[2]);
            }
        }
        let on_ice = closed.free.touch == SoleContact::Air || {
            self.state.mode = ContactMode {
                support: slide(closed.support),
                free: slide(closed.free),
            };
            is_on_ice(self.eval, self.state)
        };
        self.observe(Operation::CloseGaps {
            closed,
            projects: !on_ice,
        });
        if on_ice && self.state.q == start {
            self.state.mode = mode;
            return Ok(true);
        }
        // `eval` still contains the old positions.
        let before = self.energy(start[1]);
        if !on_ice {
            self.factor();
            let most = MOST_MOVED + MOST_RATIO * violation(self.eval, self.state).0.amax();
            project_positions(self.model, self.eval, self.state)?;
            let is_far = |(new, old): (&f64, &f64)| (new - old).abs() > most;
            if self.model.scheme.locates_events() && self.state.q.iter().zip(&start).any(is_far) {
                (self.state.q, self.state.mode, self.frame) = (start, mode, None);
                return Ok(false);
            }
        }
        self.state.mode = mode;
        self.update_frame(closed);
        // Between time steps of fixed length gaps are errors of the positions.
        if self.model.scheme.locates_events() {
            self.state.energy_balance.impacts += before - self.energy(self.state.q[1]);
        }
        Ok(true)
    }

    /// Largest downward speed of the closed ends [m/s].
    fn approach_speed(&mut self, closed: ContactMode) -> f64 {
        self.update_frame(closed);
        let feet = [closed.support.touch, closed.free.touch];
        let mut fastest = 0.0_f64;
        for (touch, [heel, toe]) in feet.into_iter().zip(self.sole_points().speeds) {
            if touch.heel() {
                fastest = fastest.max(-heel[Z]);
            }
            if touch.toe() {
                fastest = fastest.max(-toe[Z]);
            }
        }
        fastest
    }

    /// Stop the remaining vertical motion of the closed ends, without frictional impulses on sliding feet.
    fn stop_slow_landing(
        &mut self,
        before: ContactMode,
        closed: ContactMode,
    ) -> Result<(), Termination> {
        let friction_mode = |foot: Foot| match foot.touch {
            SoleContact::Air => self.model.friction.mode_at(1.0, 0.0),
            _ => foot.friction_mode,
        };
        let mode = ContactMode {
            support: Foot::new(closed.support.touch, friction_mode(before.support)),
            free: Foot::new(closed.free.touch, friction_mode(before.free)),
        };
        self.state.energy_balance.impacts += self.apply_impact_with(mode, Slip::default())?;
        Ok(())
    }

    /// The foot with those of its closed ends that do not rise, and its direction of sliding, from the velocities
    /// after the impact in `eval`.
    fn resting_foot(&self, which: usize, closed: Foot) -> Foot {
        let [heel, toe] = self.sole_points().speeds[which];
        let stays = |end: [f64; 2]| end[Z] <= REST;
        let touch = SoleContact::of(
            closed.touch.heel() && stays(heel),
            closed.touch.toe() && stays(toe),
        );
        let along = if touch.heel() { heel[Y] } else { toe[Y] };
        Foot::new(touch, self.model.friction.mode_at(along, REST))
    }

    /// Inelastic impact with the ends of `closed`, after the mode `before`; one foot may be made to stick. Returns
    /// the mode of the impulses.
    pub(super) fn impact(
        &mut self,
        before: ContactMode,
        closed: ContactMode,
        must_stick: Option<usize>,
    ) -> Result<ContactMode, Termination> {
        self.update_frame(closed);
        self.assemble_impact_problem(closed.free.touch);
        let friction = &self.model.friction;
        let mut reference = closed;
        if closed.free.touch != SoleContact::Air && before.free.touch == SoleContact::Air {
            reference.free.friction_mode = friction.mode_at(self.eval.point_velocity[Y], 0.0);
        }
        if closed.support.touch != SoleContact::Air && before.support.touch == SoleContact::Air {
            reference.support.friction_mode = friction.mode_at(self.state.v[0], 0.0);
        }
        let query = ModeQuery {
            must_stick,
            ..ModeQuery::new(
                [closed.support.touch, closed.free.touch],
                [None; 2],
                reference,
                IMPULSE_TOLERANCE,
            )
        };
        let (mode, _) = select(self.model, &self.eval.factored.problem, &query)?;
        let lost = self.apply_impact(mode)?;
        self.state.energy_balance.impacts += lost;
        Ok(mode)
    }

    /// Set up the contact problem for velocities and impulses instead of accelerations and forces.
    fn assemble_impact_problem(&mut self, free: SoleContact) {
        self.factor();
        let problem = &mut self.eval.factored.problem;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        problem.b = problem.S * root;
        if free != SoleContact::Air {
            problem.alpha0 = Vector3::from(self.eval.point_velocity) - problem.G * root;
        }
    }

    /// Change the velocities to those that `mode` allows; returns the energy lost, 0 without an energy balance [J].
    ///
    /// Friction would add energy where the impulse pulls its foot or where the sliding reverses, which impulses that are
    /// consistent with `mode` do not. Without friction the velocities are projected, which adds none.
    pub(super) fn apply_impact(&mut self, mode: ContactMode) -> Result<f64, Termination> {
        self.update_frame(mode);
        let slip = Slip::of(self.model, mode);
        let impact = self.solve_impact(mode, slip)?;
        if impact.lost < -MOST_GAINED {
            return self.apply_impact_with(mode, Slip::default());
        }
        Ok(self.change_velocities(&impact))
    }

    /// The same with given friction coefficients.
    pub fn apply_impact_with(&mut self, mode: ContactMode, slip: Slip) -> Result<f64, Termination> {
        self.update_frame(mode);
        let impact = self.solve_impact(mode, slip)?;
        Ok(self.change_velocities(&impact))
    }

    fn change_velocities(&mut self, impact: &Impact) -> f64 {
        let Impact { mode, slip, .. } = *impact;
        let has_friction = slip.support != 0.0 || slip.free != 0.0;
        self.observe(Operation::Impact { mode, has_friction });
        let Solution { a_root, lam, .. } = impact.solution;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        let change = self.eval.response(self.model, &(a_root - root), &lam);
        for c in 0..self.model.n {
            self.state.v[c] = if c < ROOT {
                a_root[c]
            } else {
                self.state.v[c] + change[c]
            };
        }
        self.eval.kin.planar_velocities(self.model, &self.state.v);
        match self.model.scene.energy_balance {
            true => impact.lost,
            false => 0.0,
        }
    }

    /// New velocities and impulses of the feet for `mode`, in whose frame `eval` is.
    fn solve_impact(&mut self, mode: ContactMode, slip: Slip) -> Result<Impact, Termination> {
        self.assemble_impact_problem(mode.free.touch);
        let solution = self.eval.factored.problem.solve(mode, slip)?;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        // The work of an impulse is its product with the mean of old and new velocity.
        let mut lost = -0.5 * solution.f_root.dot(&(root + solution.a_root));
        if mode.free.touch != SoleContact::Air {
            let point = Vector3::from(self.eval.point_velocity);
            lost -= 0.5 * solution.lam.dot(&(point + solution.a_free));
        }
        Ok(Impact {
            mode,
            slip,
            solution,
            lost,
        })
    }

    /// Kinetic and potential energy for the positions in `eval`, the pivot being at the height `z0`; 0 without an
    /// energy balance [J].
    pub(super) fn energy(&self, z0: f64) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        let (kinetic, potential) = energy(self.model, &self.eval.kin, &self.state.v, z0);
        kinetic + potential
    }
}
