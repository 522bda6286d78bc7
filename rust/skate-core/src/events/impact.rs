//! Velocities that change at an instant: landings, feet that are caught, feet that stop.

use crate::{
    contact::{
        equations::{Slip, Solution, Y, Z},
        mode_selection::{ModeQuery, Tolerance, consistent, select, slip},
    },
    dynamics::bias_forces::energy,
    error::Termination,
    events::{EventHandler, REST, SLOW_LANDING, guards::Guard, landed, moving, stuck},
    model::{
        contact_mode::{ContactMode, FREE, Foot, FrictionMode, SUPPORT, SoleContact, touches},
        layout::ROOT,
    },
    rhs::{
        projection::{is_on_ice, project_positions},
        sole_points::SolePoints,
    },
};
use nalgebra::Vector3;

impl EventHandler<'_> {
    /// The first mode of a motion: like a landing of all ends that are down.
    pub fn begin(&mut self, near: ContactMode) -> Result<(), Termination> {
        if !self.model.contact.is_unilateral() {
            let mode = self.impact(self.state.mode, near, None)?;
            return self.choose(mode, [moving(mode.support), moving(mode.free)], None);
        }
        let before = self.state.mode;
        self.touch_down(near)?;
        if self.approach(near) < SLOW_LANDING {
            self.settle_down(before, near)?;
        } else {
            self.impact(before, near, None)?;
        }
        self.go_on(near)
    }

    /// A landing between two time steps, where the ends of the soles are at `sole_points`: impulses settle what
    /// follows from it.
    pub fn land(&mut self, guard: Guard, sole_points: &SolePoints) -> Result<(), Termination> {
        if !self.model.contact.is_unilateral() {
            return self.through(guard);
        }
        let before = self.state.mode;
        let mut near = before;
        (near.support.touch, near.free.touch) = landed(touches(before), guard);
        let near = self.with_close_ends(near, sole_points);
        self.touch_down(near)?;
        if self.approach(near) < SLOW_LANDING {
            self.settle_down(before, near)?;
        }
        self.close_from(before, touches(near))
    }

    /// Push-only, between two time steps: put these ends on the ice, and stop them there if they are
    /// fast.
    pub fn close(&mut self, closed: (SoleContact, SoleContact)) -> Result<(), Termination> {
        self.close_from(self.state.mode, closed)
    }

    /// The same after the mode `before`; the state's names by now the frame in which it is told.
    fn close_from(
        &mut self,
        before: ContactMode,
        (support, free): (SoleContact, SoleContact),
    ) -> Result<(), Termination> {
        let near = ContactMode {
            support: Foot::new(support, before.support.friction_mode),
            free: Foot::new(free, before.free.friction_mode),
        };
        self.touch_down(near)?;
        if self.approach(near) >= SLOW_LANDING {
            self.impact(before, near, None)?;
        }
        self.enter_frame(near);
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

    /// Push-only: the ends of `near` that a strike left at rest are on the ice, with or without force.
    fn go_on(&mut self, near: ContactMode) -> Result<(), Termination> {
        let resting = ContactMode {
            support: self.at_rest(SUPPORT, near.support),
            free: self.at_rest(FREE, near.free),
        };
        self.choose(
            resting,
            [moving(resting.support), moving(resting.free)],
            None,
        )
    }

    /// Put the closed ends exactly on the ice, from which some may leave at once.
    fn touch_down(&mut self, closed: ContactMode) -> Result<(), Termination> {
        let slide = |foot: Foot| Foot::new(foot.touch, FrictionMode::Forward);
        self.enter_frame(closed);
        let (start, entered) = (self.state.q, self.state.mode);
        if closed.support.touch != SoleContact::Air {
            self.state.q[1] = 0.0;
            if closed.support.touch == SoleContact::Flat {
                self.state.q[2] = 0.0;
            }
        }
        let on_ice = closed.free.touch == SoleContact::Air || {
            self.state.mode = ContactMode {
                support: slide(closed.support),
                free: slide(closed.free),
            };
            is_on_ice(self.eval, self.state)
        };
        if on_ice && self.state.q == start {
            self.state.mode = entered;
            return Ok(());
        }
        // The bodies are still where they were.
        let before = self.energy(start[1]);
        if !on_ice {
            self.factor();
            project_positions(self.model, self.eval, self.state)?;
        }
        self.state.mode = entered;
        self.enter_frame(closed);
        self.state.energy_balance.impacts += before - self.energy(self.state.q[1]);
        Ok(())
    }

    /// Speed at which the fastest of the closed ends runs into the ice [m/s].
    fn approach(&mut self, closed: ContactMode) -> f64 {
        self.enter_frame(closed);
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

    /// Stop what is left of the closed ends' vertical motion; feet that did not stick go on without
    /// friction.
    fn settle_down(&mut self, before: ContactMode, closed: ContactMode) -> Result<(), Termination> {
        let friction_mode = |foot: Foot| match foot.touch {
            SoleContact::Air => self.model.friction.mode_at(1.0, 0.0),
            _ => foot.friction_mode,
        };
        let mode = ContactMode {
            support: Foot::new(closed.support.touch, friction_mode(before.support)),
            free: Foot::new(closed.free.touch, friction_mode(before.free)),
        };
        self.state.energy_balance.impacts += self.strike_with(mode, Slip::default())?;
        Ok(())
    }

    /// Which of a foot's closed ends do not move away, and the direction in which it slides. `eval`
    /// knows the velocities after the impact.
    fn at_rest(&self, which: usize, closed: Foot) -> Foot {
        let [heel, toe] = self.sole_points().speeds[which];
        let stays = |end: [f64; 2]| end[Z] <= REST;
        let touch = SoleContact::of(
            closed.touch.heel() && stays(heel),
            closed.touch.toe() && stays(toe),
        );
        let along = if touch.heel() { heel[Y] } else { toe[Y] };
        Foot::new(touch, self.model.friction.mode_at(along, REST))
    }

    /// Where sliding has no consistent force (Painleve), a foot that slides is caught: it stops in a
    /// tangential impact, as in the limit of a stiff contact (Genot and Brogliato 1999). In two-way
    /// contact a foot that sticks at the edge of its cone stays where it is.
    pub(super) fn wedge(
        &mut self,
        near: ContactMode,
        moving: [Option<FrictionMode>; 2],
    ) -> Result<(), Termination> {
        for which in [SUPPORT, FREE] {
            if !moving[which].is_some_and(FrictionMode::has_dry_friction) {
                continue;
            }
            let mode = stuck(near, which);
            let mut caught = moving;
            caught[which] = None;
            if self.model.contact.is_unilateral() {
                if self.speed(which).abs() < SLOW_LANDING {
                    // Too slow for a blow, which would only make the other ends hop.
                    self.state.energy_balance.impacts += self.strike_with(mode, Slip::default())?;
                    self.adopt(mode);
                    return self.choose(mode, caught, None);
                }
                match self.impact(near, mode, Some(which)) {
                    Err(Termination::Jam) => continue,
                    struck => struck?,
                };
                return self.go_on(near);
            }
            self.state.energy_balance.impacts += self.strike(mode)?;
            self.adopt(mode);
            return self.choose(mode, caught, None);
        }
        if self.model.contact.is_unilateral() {
            return Err(Termination::Jam);
        }
        self.adopt(near);
        Ok(())
    }

    /// Speed along the ice of a foot on it [m/s]; `eval` knows the velocities.
    fn speed(&self, which: usize) -> f64 {
        match which {
            SUPPORT => self.state.v[0],
            _ => self.eval.point_velocity[Y],
        }
    }

    /// Inelastic impact of the feet that `near` says touch, one of which may be made to stop; returns
    /// the mode after it.
    fn impact(
        &mut self,
        before: ContactMode,
        near: ContactMode,
        caught: Option<usize>,
    ) -> Result<ContactMode, Termination> {
        self.enter_frame(near);
        self.momentum_problem(near.free.touch);
        let friction = &self.model.friction;
        let mut friction_modes = near;
        if near.free.touch != SoleContact::Air && before.free.touch == SoleContact::Air {
            friction_modes.free.friction_mode = friction.mode_at(self.eval.point_velocity[Y], 0.0);
        }
        if near.support.touch != SoleContact::Air && before.support.touch == SoleContact::Air {
            friction_modes.support.friction_mode = friction.mode_at(self.state.v[0], 0.0);
        }
        let question = ModeQuery {
            closed: [near.support.touch, near.free.touch],
            may_carry: [near.support.touch, near.free.touch],
            moving: [None, None],
            caught,
            slips: None,
            near: friction_modes,
            not: None,
            tolerance: Tolerance {
                force: 1e-9,
                motion: 1e-11,
            },
        };
        let (mode, _) = select(self.model, &self.eval.factored.problem, &question)?;
        let taken = self.strike(mode)?;
        self.state.energy_balance.impacts += taken;
        Ok(mode)
    }

    /// Set up the contact problem for velocities and impulses instead of accelerations and forces.
    fn momentum_problem(&mut self, free: SoleContact) {
        self.factor();
        let problem = &mut self.eval.factored.problem;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        problem.b = problem.S * root;
        if free != SoleContact::Air {
            problem.alpha0 = Vector3::from(self.eval.point_velocity) - problem.G * root;
        }
    }

    /// Give the state the velocities that `mode` allows; returns the energy taken.
    pub(super) fn strike(&mut self, mode: ContactMode) -> Result<f64, Termination> {
        self.strike_with(mode, slip(self.model, mode))
    }

    fn strike_with(&mut self, mode: ContactMode, slip: Slip) -> Result<f64, Termination> {
        self.enter_frame(mode);
        self.momentum_problem(mode.free.touch);
        let Solution {
            a_root,
            f_root,
            a_free,
            lam,
        } = self.eval.factored.problem.solve(mode, slip)?;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        let mut taken = 0.0;
        if self.model.scene.energy_balance {
            // Impulses do work along the means of old and new velocities.
            taken -= 0.5 * f_root.dot(&(root + a_root));
            if mode.free.touch != SoleContact::Air {
                let point = Vector3::from(self.eval.point_velocity);
                taken -= 0.5 * lam.dot(&(point + a_free));
            }
        }
        let change = self.eval.response(self.model, &(a_root - root), &lam);
        for c in 0..self.model.n {
            self.state.v[c] = if c < ROOT {
                a_root[c]
            } else {
                self.state.v[c] + change[c]
            };
        }
        self.eval.kin.planar_velocities(self.model, &self.state.v);
        Ok(taken)
    }

    /// Kinetic and potential [J] with the pivot at the height `z0`, for the ledger; 0 without one. `eval` knows
    /// where the bodies are.
    fn energy(&self, z0: f64) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        let (kinetic, potential) = energy(self.model, &self.eval.kin, &self.state.v, z0);
        kinetic + potential
    }

    /// Would the foot stick? Then take its remaining speed away.
    pub(super) fn capture(&mut self, which: usize) -> Result<bool, Termination> {
        let mode = stuck(self.state.mode, which);
        let mut decided = [moving(mode.support), moving(mode.free)];
        decided[which] = None;
        let question = ModeQuery {
            closed: [mode.support.touch, mode.free.touch],
            may_carry: [mode.support.touch, mode.free.touch],
            moving: decided,
            caught: None,
            slips: None,
            near: mode,
            not: None,
            tolerance: Tolerance {
                force: 0.0,
                motion: 0.0,
            },
        };
        if consistent(self.model, &self.eval.factored.problem, &question, mode)?.is_none() {
            return Ok(false);
        }
        let taken = self.strike(mode)?;
        self.state.energy_balance.capture += taken;
        self.adopt(mode);
        Ok(true)
    }
}
