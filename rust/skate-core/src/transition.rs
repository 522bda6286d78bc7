//! From one contact mode to the next: Fig. 3 for the paper's contact, the laws themselves for ice
//! that can only push.

use crate::{
    contact::{
        Foot, Grip, Mode, Slip, Solution, Touch, Y,
        select::{Question, Tolerance, consistent, select, slip},
    },
    control::{
        Clock,
        feedforward::{self, Phase},
    },
    error::EndCause,
    evaluate::{Evaluation, Frozen},
    guards::{End, FORCE_SLACK, FREE, GAP_TOLERANCE, Guard, SUPPORT},
    model::{FREE_FOOT, Model, NV, ROOT},
    project::project_positions,
    relabel,
    scene::ContactLaw,
    state::State,
};
use nalgebra::Vector3;

/// One arrow of Fig. 3 between the touches of the feet; sliding and sticking, which any foot on the
/// ice may change, complete it to the arrows between the 20 states.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub guard: Guard,
    /// Touches (support, free) before and after.
    pub from: (Touch, Touch),
    pub to: (Touch, Touch),
    /// The feet exchange their names; `to` is what follows under the new names.
    pub swap: bool,
}

const fn edge(guard: Guard, from: (Touch, Touch), to: (Touch, Touch)) -> Edge {
    Edge {
        guard,
        from,
        to,
        swap: false,
    }
}

/// The arrows of two-way contact. The free toe alone has no state in Table 2. The supporting foot
/// lets go only while the free foot is flat; a flat free foot never lets go.
pub const EDGES: [Edge; 11] = {
    use Touch::{Air, Flat, Heel, Toe};
    [
        edge(Guard::Gap(FREE, End::Heel), (Flat, Air), (Flat, Heel)),
        edge(Guard::Gap(FREE, End::Heel), (Toe, Air), (Toe, Heel)),
        edge(Guard::Gap(FREE, End::Toe), (Flat, Heel), (Flat, Flat)),
        edge(Guard::Gap(FREE, End::Toe), (Toe, Heel), (Toe, Flat)),
        edge(Guard::Load(FREE, End::Heel), (Flat, Heel), (Flat, Air)),
        edge(Guard::Load(FREE, End::Heel), (Toe, Heel), (Toe, Air)),
        edge(Guard::Load(SUPPORT, End::Heel), (Flat, Flat), (Toe, Flat)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Air), (Flat, Air)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Heel), (Flat, Heel)),
        edge(Guard::Gap(SUPPORT, End::Heel), (Toe, Flat), (Flat, Flat)),
        Edge {
            guard: Guard::Load(SUPPORT, End::Toe),
            from: (Toe, Flat),
            to: (Flat, Air),
            swap: true,
        },
    ]
};

/// An end that lands counts others this close to the ice as landing with it [m].
const CLOSE: f64 = 1e-9;
/// Slower than this an end of a sole is at rest [m/s].
const REST: f64 = 1e-9;
/// A landing slower than this brings all ends on the ice to rest [m/s]. A hard sole would go on
/// rattling from end to end, each landing kicking the other end up, a million times a second.
const SLOW_LANDING: f64 = 1e-3;

/// Make a state and its workspace pass an event.
pub struct Passage<'a> {
    pub model: &'a Model,
    pub eval: &'a mut Evaluation,
    pub state: &'a mut State,
    /// Held joint torques; the joints' names change with the legs'.
    pub residual: &'a mut [f64; NV],
}

impl Passage<'_> {
    /// Carry out what follows when `guard` has fallen through zero.
    ///
    /// # Errors
    /// `Fall`; `Jam` or `Singular` where no next mode is consistent.
    pub fn through(&mut self, guard: Guard) -> Result<(), EndCause> {
        let phase = Phase::of(self.state.mode);
        self.pass(guard)?;
        let next = Phase::of(self.state.mode);
        let clock = &mut self.state.clock;
        if next != phase {
            match next {
                Some(Phase::Touched) => clock.t1 = self.state.t,
                Some(Phase::PushOff) => clock.t2 = self.state.t,
                _ => {}
            }
        }
        Ok(())
    }

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

    /// Push-only: the ends of `near` that a strike left at rest are on the ice, with or without force.
    fn go_on(&mut self, near: Mode) -> Result<(), EndCause> {
        let (support, free) = (
            self.at_rest(0, near.support),
            self.at_rest(FREE_FOOT, near.free),
        );
        let resting = Mode {
            support: support.0,
            free: free.0,
        };
        self.choose(resting, [support.1, free.1], None)
    }

    /// Put the closed ends exactly on the ice, from which some may leave at once.
    fn touch_down(&mut self, closed: Mode) -> Result<(), EndCause> {
        let slide = |foot: Foot| Foot::new(foot.touch, Grip::Forward);
        self.enter_frame(closed);
        let entered = self.state.mode;
        if closed.support.touch != Touch::Air {
            self.state.q[1] = 0.0;
            if closed.support.touch == Touch::Flat {
                self.state.q[2] = 0.0;
            }
        }
        if closed.free.touch != Touch::Air {
            self.state.mode = Mode {
                support: slide(closed.support),
                free: slide(closed.free),
            };
            project_positions(self.model, self.eval, self.state)?;
            self.state.mode = entered;
        }
        Ok(())
    }

    /// Speed at which the fastest of the closed ends runs into the ice [m/s].
    fn approach(&mut self, closed: Mode) -> f64 {
        self.enter_frame(closed);
        let feet = [(0, closed.support.touch), (FREE_FOOT, closed.free.touch)];
        let mut fastest = 0.0_f64;
        for (body, touch) in feet {
            let [heel, toe] = self.end_velocities(body);
            if touch.heel() {
                fastest = fastest.max(-heel.z);
            }
            if touch.toe() {
                fastest = fastest.max(-toe.z);
            }
        }
        fastest
    }

    /// Velocities of heel and toe of a foot [m/s]; `eval` knows the velocities.
    fn end_velocities(&self, body: usize) -> [Vector3<f64>; 2] {
        let kin = &self.eval.kin;
        [self.model.sole.heel, self.model.sole.toe].map(|along| {
            let at = kin.sole_point_of(self.model, body, along);
            kin.point_velocity(body, &Vector3::new(0.0, at.y, at.z))
        })
    }

    /// Stop what is left of the closed ends' vertical motion; feet that did not stick go on without
    /// friction.
    fn settle_down(&mut self, before: Mode, closed: Mode) -> Result<(), EndCause> {
        let grip = |foot: Foot| match foot.touch {
            Touch::Air => Grip::Forward,
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
    fn at_rest(&self, body: usize, closed: Foot) -> (Foot, Option<Grip>) {
        let [heel, toe] = self.end_velocities(body);
        let stays = |end: Vector3<f64>| end.z <= REST;
        let touch = Touch::of(
            closed.touch.heel() && stays(heel),
            closed.touch.toe() && stays(toe),
        );
        let along = if touch.heel() { heel.y } else { toe.y };
        let grip = if along.abs() <= REST {
            Grip::Stuck
        } else if along > 0.0 {
            Grip::Forward
        } else {
            Grip::Backward
        };
        let foot = Foot::new(touch, grip);
        (foot, moving(foot))
    }

    fn pass(&mut self, guard: Guard) -> Result<(), EndCause> {
        let before = self.state.mode;
        let mut near = before;
        let mut decided = [moving(before.support), moving(before.free)];
        match guard {
            Guard::Fall => return Err(EndCause::Fall),
            Guard::Gap(which, end) => {
                let foot = if which == SUPPORT {
                    &mut near.support
                } else {
                    &mut near.free
                };
                let (heel, toe) = (foot.touch.heel(), foot.touch.toe());
                foot.touch = match end {
                    End::Heel => Touch::of(true, toe),
                    End::Toe => Touch::of(heel, true),
                };
                if self.model.scene.contact.law == ContactLaw::PushOnly {
                    near = self.with_close_ends(near);
                }
                return self.begin(near);
            }
            Guard::Load(..) if self.model.scene.contact.law == ContactLaw::TwoWay => {
                let from = (before.support.touch, before.free.touch);
                let edge = EDGES.iter().find(|e| e.guard == guard && e.from == from);
                let edge = edge.ok_or(EndCause::Jam)?;
                if edge.swap {
                    self.swap(before.free);
                    self.settle();
                    (near, decided) = (self.state.mode, [decided[FREE], None]);
                } else {
                    near.support.touch = edge.to.0;
                    near.free = if edge.to.1 == Touch::Air {
                        Foot::AIR
                    } else {
                        before.free
                    };
                }
            }
            Guard::Load(..) | Guard::Pull(_) => {}
            Guard::ConeForward(which) | Guard::ConeBackward(which) => decided[which] = None,
            Guard::Wedge(which) => {
                decided[1 - which] = None;
                return self.wedge(before, decided);
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
        self.choose(near, decided, Some(before))
    }

    /// Ends that are about to land at the same instant land together; one by one they would rattle.
    fn with_close_ends(&self, near: Mode) -> Mode {
        let gaps = self
            .eval
            .gaps(self.model, self.state.mode.support.touch, self.state.q[1]);
        let close = |foot: Foot, [heel, toe]: [f64; 2]| {
            let touch = foot.touch;
            Touch::of(touch.heel() || heel <= CLOSE, touch.toe() || toe <= CLOSE)
        };
        let mut mode = near;
        mode.support.touch = close(near.support, gaps[SUPPORT]);
        mode.free.touch = close(near.free, gaps[FREE]);
        mode
    }

    /// Find the mode in which the motion goes on, given which feet move already, and take it over.
    pub fn choose(
        &mut self,
        near: Mode,
        moving: [Option<Grip>; 2],
        not: Option<Mode>,
    ) -> Result<(), EndCause> {
        self.enter_frame(near);
        let frozen = Frozen::of(self.state, self.residual);
        let (q, v) = (self.state.q, self.state.v);
        self.eval.load(self.model, near.free.touch, &q, &v, &frozen);
        let force = FORCE_SLACK * self.model.weight();
        let question = Question {
            closed: [near.support.touch, near.free.touch],
            moving,
            caught: None,
            near,
            not,
            tolerance: Tolerance {
                force,
                motion: 10.0 * force / self.model.mass(),
            },
        };
        match select(self.model, &self.eval.problem, &question) {
            Ok((mode, _)) => self.adopt(mode),
            Err(EndCause::Jam) => self.wedge(near, moving)?,
            Err(cause) => return Err(cause),
        }
        Ok(())
    }

    /// Where sliding has no consistent force (Painleve), a foot that slides is caught: it stops in a
    /// tangential impact, as in the limit of a stiff contact (Genot and Brogliato 1999). In two-way
    /// contact a foot that sticks at the edge of its cone stays where it is.
    fn wedge(&mut self, near: Mode, moving: [Option<Grip>; 2]) -> Result<(), EndCause> {
        for which in [SUPPORT, FREE] {
            if moving[which].is_none() {
                continue;
            }
            let mode = stuck(near, which);
            if self.model.scene.contact.law == ContactLaw::PushOnly {
                match self.impact(near, mode, Some(which)) {
                    Err(EndCause::Jam) => continue,
                    struck => struck?,
                };
                return self.go_on(near);
            }
            let mut caught = moving;
            caught[which] = None;
            self.state.ledger.impacts += self.strike(mode)?;
            self.state.mode = mode;
            return self.choose(mode, caught, None);
        }
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            return Err(EndCause::Jam);
        }
        self.adopt(near);
        Ok(())
    }

    /// Take over a mode: the pivot moves, a free foot that carries the robot alone takes its name.
    fn adopt(&mut self, mode: Mode) {
        let before = self.state.mode.free;
        relabel::move_pivot(self.model, self.state, mode.support.touch);
        self.state.mode = mode;
        if mode.support.touch == Touch::Air && mode.free.touch != Touch::Air {
            self.swap(mode.free);
        }
        self.settle();
        if !mode.free.slides() && mode.free != before {
            self.set_anchor();
        }
    }

    /// The free foot becomes the supporting one. A held torque stays on the joint it was put on.
    fn swap(&mut self, support: Foot) {
        relabel::swap(self.model, self.eval, self.state, support, Foot::AIR);
        relabel::reverse_legs(self.residual);
    }

    /// Move the state and the workspace to the frame in which `mode`'s contacts are closed.
    fn enter_frame(&mut self, mode: Mode) {
        relabel::move_pivot(self.model, self.state, mode.support.touch);
        let (q, v) = (self.state.q, self.state.v);
        self.eval.move_to(self.model, mode.support.touch, &q, &v);
        self.eval.assemble(self.model, mode.free.touch);
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
        let mut grips = near;
        if near.free.touch != Touch::Air && before.free.touch == Touch::Air {
            let speed = self.eval.point_velocity[Y];
            grips.free.grip = if speed < 0.0 {
                Grip::Backward
            } else {
                Grip::Forward
            };
        }
        if near.support.touch != Touch::Air && before.support.touch == Touch::Air {
            grips.support.grip = if self.state.v[0] < 0.0 {
                Grip::Backward
            } else {
                Grip::Forward
            };
        }
        let question = Question {
            closed: [near.support.touch, near.free.touch],
            moving: [None, None],
            caught,
            near: grips,
            not: None,
            tolerance: Tolerance {
                force: 1e-9,
                motion: 1e-11,
            },
        };
        let (mode, _) = select(self.model, &self.eval.problem, &question)?;
        let taken = self.strike(mode)?;
        self.state.ledger.impacts += taken;
        Ok(mode)
    }

    /// Set up the contact problem for velocities and impulses instead of accelerations and forces.
    fn momentum_problem(&mut self, free: Touch) {
        let problem = &mut self.eval.problem;
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        problem.b = problem.S * root;
        if free != Touch::Air {
            problem.alpha0 = Vector3::from(self.eval.point_velocity) - problem.G * root;
        }
    }

    /// Give the state the velocities that `mode` allows; returns the kinetic energy taken.
    fn strike(&mut self, mode: Mode) -> Result<f64, EndCause> {
        self.strike_with(mode, slip(self.model, mode))
    }

    fn strike_with(&mut self, mode: Mode, slip: Slip) -> Result<f64, EndCause> {
        self.enter_frame(mode);
        self.momentum_problem(mode.free.touch);
        let Solution { a_root, lam, .. } = self.eval.problem.solve(mode, slip)?;
        self.eval.inertias.update(self.model, &self.eval.kin);
        let (before, _) = self.eval.inertias.energy(self.model, &self.eval.kin, 0.0);
        let root = Vector3::new(self.state.v[0], self.state.v[1], self.state.v[2]);
        let change = self
            .eval
            .response(self.model, mode.free.touch, &(a_root - root), &lam);
        for c in 0..self.model.n {
            self.state.v[c] = if c < ROOT {
                a_root[c]
            } else {
                self.state.v[c] + change[c]
            };
        }
        self.eval.kin.velocities(self.model, &self.state.v);
        let (after, _) = self.eval.inertias.energy(self.model, &self.eval.kin, 0.0);
        Ok(before - after)
    }

    /// Would the foot stick? Then take its remaining speed away.
    fn capture(&mut self, which: usize) -> Result<bool, EndCause> {
        let mode = stuck(self.state.mode, which);
        let mut decided = [moving(mode.support), moving(mode.free)];
        decided[which] = None;
        let question = Question {
            closed: [mode.support.touch, mode.free.touch],
            moving: decided,
            caught: None,
            near: mode,
            not: None,
            tolerance: Tolerance {
                force: 0.0,
                motion: 0.0,
            },
        };
        if consistent(self.model, &self.eval.problem, &question, mode)?.is_none() {
            return Ok(false);
        }
        let taken = self.strike(mode)?;
        self.state.ledger.capture += taken;
        self.adopt(mode);
        Ok(true)
    }

    /// Set exactly what the mode fixes on the supporting foot.
    fn settle(&mut self) {
        let State { q, v, mode, .. } = self.state;
        if mode.support.touch == Touch::Air {
            return;
        }
        (q[1], v[1]) = (0.0, 0.0);
        if mode.support.touch == Touch::Flat {
            (q[2], v[2]) = (0.0, 0.0);
        }
        if !mode.support.slides() {
            v[0] = 0.0;
        }
    }

    /// Remember where the free foot sticks.
    fn set_anchor(&mut self) {
        let (q, v) = (self.state.q, self.state.v);
        self.eval
            .move_to(self.model, self.state.mode.support.touch, &q, &v);
        let sole = &self.model.sole;
        let along = if self.state.mode.free.touch == Touch::Toe {
            sole.toe
        } else {
            sole.heel
        };
        self.state.anchor = q[0] + self.eval.kin.sole_point(self.model, along).y;
    }
}

/// The direction of a foot that already slides.
fn moving(foot: Foot) -> Option<Grip> {
    foot.slides().then_some(foot.grip)
}

/// The mode with one foot stuck.
fn stuck(mut mode: Mode, which: usize) -> Mode {
    let foot = if which == SUPPORT {
        &mut mode.support
    } else {
        &mut mode.free
    };
    *foot = Foot::new(foot.touch, Grip::Stuck);
    mode
}

/// Sample the laws in force, and the switch of Eq. 21 for the free foot's angle to the ice [rad].
pub fn sample(model: &Model, state: &mut State, angle: f64) {
    state.clock = sampled(model, state, angle);
}

/// The clock after a sample.
pub fn sampled(model: &Model, state: &State, angle: f64) -> Clock {
    let mut clock = state.clock;
    clock.supported = state.mode.support.touch != Touch::Air;
    if clock.leg != state.support_leg {
        (clock.leg, clock.t0) = (state.support_leg, state.t);
    }
    if let Some(feedforward) = &model.scene.control.feedforward {
        clock.phase = Phase::of(state.mode);
        clock.tau7 = feedforward.tau7_scale * feedforward::tau7(clock.phase, angle);
    }
    clock
}

/// Ends of the soles on the ice in a state, within the tolerance.
pub fn closed_ends(gaps: [[f64; 2]; 2]) -> [Touch; 2] {
    gaps.map(|[heel, toe]| Touch::of(heel <= GAP_TOLERANCE, toe <= GAP_TOLERANCE))
}
