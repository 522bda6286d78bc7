//! Velocities that change at an instant: landings, feet that are caught, feet that stop.

use crate::{
    contact::{
        equations::{Slip, Solution, Y, Z},
        mode_selection::{Question, Tolerance, consistent, select, slip},
    },
    dynamics::bias_forces::energy,
    error::EndCause,
    events::{Passage, REST, SLOW_LANDING, guards::Guard, landed, moving, stuck},
    model::{
        contact_mode::{FREE, Foot, Grip, Mode, SUPPORT, Touch, touches},
        layout::ROOT,
    },
    rhs::{
        projection::{is_on_ice, project_positions},
        sole_points::Marks,
    },
    scene::ContactLaw,
};
use nalgebra::Vector3;

impl Passage<'_> {
    /// The first mode of a motion: like a landing of all ends that are down.
    pub fn begin(&mut self, near: Mode) -> Result<(), EndCause> {
        if self.model.scene.contact.law == ContactLaw::TwoWay {
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

    /// A landing between two time steps, where the ends of the soles are at `marks`: impulses settle what
    /// follows from it.
    pub fn land(&mut self, guard: Guard, marks: &Marks) -> Result<(), EndCause> {
        if self.model.scene.contact.law == ContactLaw::TwoWay {
            return self.through(guard);
        }
        let before = self.state.mode;
        let mut near = before;
        (near.support.touch, near.free.touch) = landed(touches(before), guard);
        let near = self.with_close_ends(near, marks);
        self.touch_down(near)?;
        if self.approach(near) < SLOW_LANDING {
            self.settle_down(before, near)?;
        }
        self.close_from(before, touches(near))
    }

    /// Push-only, between two time steps: put these ends on the ice, and stop them there if they are
    /// fast.
    pub fn close(&mut self, closed: (Touch, Touch)) -> Result<(), EndCause> {
        self.close_from(self.state.mode, closed)
    }

    /// The same after the mode `before`; the state's names by now the frame in which it is told.
    fn close_from(
        &mut self,
        before: Mode,
        (support, free): (Touch, Touch),
    ) -> Result<(), EndCause> {
        let near = Mode {
            support: Foot::new(support, before.support.grip),
            free: Foot::new(free, before.free.grip),
        };
        self.touch_down(near)?;
        if self.approach(near) >= SLOW_LANDING {
            self.impact(before, near, None)?;
        }
        self.enter_frame(near);
        let grip = |old: Foot, speed: f64| match old.touch {
            Touch::Air => self.model.friction.grip(speed, REST),
            _ => old.grip,
        };
        let grips = [
            grip(before.support, self.state.v[0]),
            grip(before.free, self.eval.point_velocity[Y]),
        ];
        self.state.mode = Mode {
            support: Foot::new(support, grips[0]),
            free: Foot::new(free, grips[1]),
        };
        if support == Touch::Air && free != Touch::Air {
            self.swap(self.state.mode.free);
        } else if !self.state.mode.free.slides() && self.state.mode.free != before.free {
            self.set_anchor();
        }
        Ok(())
    }

    /// Push-only: the ends of `near` that a strike left at rest are on the ice, with or without force.
    fn go_on(&mut self, near: Mode) -> Result<(), EndCause> {
        let resting = Mode {
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
    fn touch_down(&mut self, closed: Mode) -> Result<(), EndCause> {
        let slide = |foot: Foot| Foot::new(foot.touch, Grip::Forward);
        self.enter_frame(closed);
        let (start, entered) = (self.state.q, self.state.mode);
        if closed.support.touch != Touch::Air {
            self.state.q[1] = 0.0;
            if closed.support.touch == Touch::Flat {
                self.state.q[2] = 0.0;
            }
        }
        let on_ice = closed.free.touch == Touch::Air || {
            self.state.mode = Mode {
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
        self.state.ledger.impacts += before - self.energy(self.state.q[1]);
        Ok(())
    }

    /// Speed at which the fastest of the closed ends runs into the ice [m/s].
    fn approach(&mut self, closed: Mode) -> f64 {
        self.enter_frame(closed);
        let feet = [closed.support.touch, closed.free.touch];
        let mut fastest = 0.0_f64;
        for (touch, [heel, toe]) in feet.into_iter().zip(self.marks().speeds) {
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
    fn settle_down(&mut self, before: Mode, closed: Mode) -> Result<(), EndCause> {
        let grip = |foot: Foot| match foot.touch {
            Touch::Air => self.model.friction.grip(1.0, 0.0),
            _ => foot.grip,
        };
        let mode = Mode {
            support: Foot::new(closed.support.touch, grip(before.support)),
            free: Foot::new(closed.free.touch, grip(before.free)),
        };
        self.state.ledger.impacts += self.strike_with(mode, Slip::default())?;
        Ok(())
    }

    /// Which of a foot's closed ends do not move away, and the direction in which it slides. `eval`
    /// knows the velocities after the impact.
    fn at_rest(&self, which: usize, closed: Foot) -> Foot {
        let [heel, toe] = self.marks().speeds[which];
        let stays = |end: [f64; 2]| end[Z] <= REST;
        let touch = Touch::of(
            closed.touch.heel() && stays(heel),
            closed.touch.toe() && stays(toe),
        );
        let along = if touch.heel() { heel[Y] } else { toe[Y] };
        Foot::new(touch, self.model.friction.grip(along, REST))
    }

    /// Where sliding has no consistent force (Painleve), a foot that slides is caught: it stops in a
    /// tangential impact, as in the limit of a stiff contact (Genot and Brogliato 1999). In two-way
    /// contact a foot that sticks at the edge of its cone stays where it is.
    pub(super) fn wedge(&mut self, near: Mode, moving: [Option<Grip>; 2]) -> Result<(), EndCause> {
        for which in [SUPPORT, FREE] {
            if !moving[which].is_some_and(Grip::rubs) {
                continue;
            }
            let mode = stuck(near, which);
            let mut caught = moving;
            caught[which] = None;
            if self.model.scene.contact.law == ContactLaw::PushOnly {
                if self.speed(which).abs() < SLOW_LANDING {
                    // Too slow for a blow, which would only make the other ends hop.
                    self.state.ledger.impacts += self.strike_with(mode, Slip::default())?;
                    self.adopt(mode);
                    return self.choose(mode, caught, None);
                }
                match self.impact(near, mode, Some(which)) {
                    Err(EndCause::Jam) => continue,
                    struck => struck?,
                };
                return self.go_on(near);
            }
            self.state.ledger.impacts += self.strike(mode)?;
            self.adopt(mode);
            return self.choose(mode, caught, None);
        }
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            return Err(EndCause::Jam);
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
        before: Mode,
        near: Mode,
        caught: Option<usize>,
    ) -> Result<Mode, EndCause> {
        self.enter_frame(near);
        self.momentum_problem(near.free.touch);
        let friction = &self.model.friction;
        let mut grips = near;
        if near.free.touch != Touch::Air && before.free.touch == Touch::Air {
            grips.free.grip = friction.grip(self.eval.point_velocity[Y], 0.0);
        }
        if near.support.touch != Touch::Air && before.support.touch == Touch::Air {
            grips.support.grip = friction.grip(self.state.v[0], 0.0);
        }
        let question = Question {
            closed: [near.support.touch, near.free.touch],
            may_carry: [near.support.touch, near.free.touch],
            moving: [None, None],
            caught,
            slips: None,
            near: grips,
            not: None,
            tolerance: Tolerance {
                force: 1e-9,
                motion: 1e-11,
            },
        };
        let (mode, _) = select(self.model, &self.eval.factored.problem, &question)?;
        let taken = self.strike(mode)?;
        self.state.ledger.impacts += taken;
        Ok(mode)
    }

    /// Set up the contact problem for velocities and impulses instead of accelerations and forces.
    fn momentum_problem(&mut self, free: Touch) {
        self.factor();
        let problem = &mut self.eval.factored.problem;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        problem.b = problem.S * root;
        if free != Touch::Air {
            problem.alpha0 = Vector3::from(self.eval.point_velocity) - problem.G * root;
        }
    }

    /// Give the state the velocities that `mode` allows; returns the energy taken.
    pub(super) fn strike(&mut self, mode: Mode) -> Result<f64, EndCause> {
        self.strike_with(mode, slip(self.model, mode))
    }

    fn strike_with(&mut self, mode: Mode, slip: Slip) -> Result<f64, EndCause> {
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
        if self.model.scene.ledger {
            // Impulses do work along the means of old and new velocities.
            taken -= 0.5 * f_root.dot(&(root + a_root));
            if mode.free.touch != Touch::Air {
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
        if !self.model.scene.ledger {
            return 0.0;
        }
        let (kinetic, potential) = energy(self.model, &self.eval.kin, &self.state.v, z0);
        kinetic + potential
    }

    /// Would the foot stick? Then take its remaining speed away.
    pub(super) fn capture(&mut self, which: usize) -> Result<bool, EndCause> {
        let mode = stuck(self.state.mode, which);
        let mut decided = [moving(mode.support), moving(mode.free)];
        decided[which] = None;
        let question = Question {
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
        self.state.ledger.capture += taken;
        self.adopt(mode);
        Ok(true)
    }
}
