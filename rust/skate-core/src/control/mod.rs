//! The baseline controller: feedforward, visual lifting, and the helpers that a scene names.

use serde::{Deserialize, Serialize};
pub mod feedforward;
mod helpers;
pub mod lifting;

use crate::{
    angles::sin_cos_of,
    articulated::LEG,
    contact::{Mode, Touch},
    kinematics::Kinematics,
    model::{FREE_FOOT, Model, NV, ROOT, Robots, coordinate},
    real::{MOST_LANES, Mask, Real},
    relabel::reverse_legs,
    scene::{
        Feedforward, HeadDamping, KneeStop, Leg, Lifting, ProportionalDerivative as Pd, Scene,
    },
    state::State,
};
use feedforward::{Phase, Turning};

/// Instants that the feedforward counts from, and what it samples with its own period: which law
/// applies, and the switch of Eq. 21. In continuous time both can chatter without end, because a law
/// may push the robot back into the state whose law pushes it out again.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// Swap of the legs [s].
    pub t0: f64,
    /// The free foot touched: state 3 -> 7 [s].
    pub t1: f64,
    /// The supporting foot began to rotate: state 7 -> 15/16 [s].
    pub t2: f64,
    /// The law in force, as last sampled.
    pub phase: Option<Phase>,
    /// The leg it takes for the supporting one. On ice that only pushes, two feet can take turns a
    /// million times a second.
    pub leg: Leg,
    /// A foot was on the ice at the last sample; in flight there is no supporting ankle to lift the
    /// head from.
    pub supported: bool,
    /// tau7 of Eq. 21 as last sampled [N m].
    pub tau7: f64,
}

/// Ticks of the controller's clock are this exact [s]: rounding of t after an hour.
pub const TICK_ROUNDING: f64 = 1e-12;

/// One term of the controller. A scene's terms are listed in `Model::controller`; what it leaves out is
/// not there to be asked.
#[derive(Debug, Clone)]
pub enum Term {
    Feedforward(Feedforward),
    /// tau8, Eq. 22, on the coordinate of q8.
    ArmSwing {
        amplitude: f64,
        yaw: usize,
    },
    Lifting(Lifting),
    HeadDamping(HeadDamping),
    HipPd(Pd),
    FreeKneePd(Pd),
    KneeStop(KneeStop),
}

/// The terms that a scene names; `yaw` is the coordinate of q8, if it moves.
pub fn terms(scene: &Scene, yaw: Option<usize>) -> Vec<Term> {
    let (control, helpers) = (&scene.control, &scene.helpers);
    let swing = control.arm_swing.as_ref().zip(yaw);
    let swing = swing.map(|(swing, yaw)| Term::ArmSwing {
        amplitude: swing.amplitude,
        yaw,
    });
    let all = [
        control.feedforward.clone().map(Term::Feedforward),
        swing,
        control.lifting.clone().map(Term::Lifting),
        helpers.head_damping.clone().map(Term::HeadDamping),
        helpers.hip_pd.clone().map(Term::HipPd),
        helpers.free_knee_pd.clone().map(Term::FreeKneePd),
        helpers.knee_stop.clone().map(Term::KneeStop),
    ];
    all.into_iter().flatten().collect()
}

/// The clock after a sample of the laws in force, and of the switch of Eq. 21 for the free foot's angle
/// to the ice [rad].
pub fn sampled(model: &Model, state: &State, angle: f64) -> Clock {
    let mut clock = state.clock;
    let now = (state.t, state.support_leg, state.mode);
    sample(model, now, angle, &mut clock);
    clock
}

/// Set a clock to what `sampled` tells at a time, on a leg, in a contact state.
#[inline(always)]
pub fn sample(model: &Model, (t, leg, mode): (f64, Leg, Mode), angle: f64, clock: &mut Clock) {
    if clock.leg != leg {
        (clock.leg, clock.t0) = (leg, t);
    }
    for term in &model.controller {
        match term {
            Term::Feedforward(law) => {
                clock.phase = Phase::of(mode);
                clock.tau7 = feedforward::switch(law, clock.phase, angle);
            }
            Term::FreeKneePd(_) => clock.phase = Phase::of(mode),
            Term::Lifting(_) | Term::HeadDamping(_) => {
                clock.supported = mode.support.touch != Touch::Air;
            }
            Term::ArmSwing { .. } | Term::HipPd(_) | Term::KneeStop(_) => {}
        }
    }
}

/// What the controller sees besides positions and velocities.
#[derive(Debug, Clone, Copy)]
pub struct Situation {
    pub t: f64,
    pub clock: Clock,
    /// The controller still counts the joints from the foot that is now the free one.
    pub mirrored: bool,
}

impl Situation {
    /// What it sees of a state.
    pub fn of(state: &State) -> Self {
        Self {
            t: state.t,
            clock: state.clock,
            mirrored: state.clock.leg != state.support_leg,
        }
    }
}

/// All torques of the baseline; needs `Kinematics::frames` and `planar_velocities`. [N m], [N] on y0,
/// z0.
pub fn baseline(
    model: &Model,
    kin: &mut Kinematics,
    v: &[f64; NV],
    q: &[f64; NV],
    now: &Situation,
) -> [f64; NV] {
    let now = std::slice::from_ref(now);
    let mut tau = printed(model, now);
    add_feedback(model, kin, (q, v), now, &mut tau);
    tau
}

/// To the printed torques, which come first, add those that depend on how the robot moves. There is a
/// situation for every lane; all of them are mirrored, or none.
#[inline(always)]
pub fn add_feedback<T: Real>(
    robots: impl Robots<T>,
    kin: &mut Kinematics<T>,
    (q, v): (&[T; NV], &[T; NV]),
    now: &[Situation],
    tau: &mut [T; NV],
) {
    // Counted from the foot that the controller takes for the supporting one.
    for (i, term) in robots.shape().controller.iter().enumerate() {
        match term {
            Term::Feedforward(_) | Term::ArmSwing { .. } => {}
            Term::Lifting(_) => lifting::lift(robots, kin, i, q[1], now, tau),
            Term::HeadDamping(_) => lifting::damp(robots, kin, i, v, now, tau),
            Term::HipPd(_) => helpers::hip_pd(robots, i, kin, tau),
            Term::FreeKneePd(_) => helpers::free_knee_pd(robots, i, (q, v), now, tau),
            Term::KneeStop(_) => helpers::knee_stop(robots, i, (q, v), now, tau),
        }
    }
    if now[0].mirrored {
        recount(tau);
    }
}

/// The printed torques, Eqs. 16 to 22, which depend on nothing but time, counted as the controller does.
#[inline(always)]
pub fn printed<T: Real>(robots: impl Robots<T>, now: &[Situation]) -> [T; NV] {
    let terms = &robots.shape().controller;
    let mut cos = T::zero();
    if terms.iter().any(|t| matches!(t, Term::Feedforward(_))) {
        let phases = T::from_lanes(|i| feedforward::phase(now[i].t, &now[i].clock));
        cos = sin_cos_of(phases).1;
    }
    if T::LANES == 1 {
        let mut own = [0.0; NV];
        add_printed(robots.lane(0), &now[0], cos.lane(0), &mut own);
        return own.map(T::of);
    }
    let mut own = [[0.0; NV]; MOST_LANES];
    for (i, tau) in own[..T::LANES].iter_mut().enumerate() {
        add_printed(robots.lane(i), &now[i], cos.lane(i), tau);
    }
    let mut tau = [T::zero(); NV];
    T::from_rows(&own.each_ref(), &mut tau);
    tau
}

/// `cos` is that of `feedforward::phase`.
#[inline(never)]
fn add_printed(model: &Model, now: &Situation, cos: f64, tau: &mut [f64; NV]) {
    for term in &model.controller {
        match term {
            Term::Feedforward(law) => feedforward::add(law, &now.clock, cos, tau),
            Term::ArmSwing { amplitude, yaw } => feedforward::tau8(*amplitude, now, &mut tau[*yaw]),
            _ => {}
        }
    }
}

/// To the printed torques of a time step, add what the controller's samples in it change.
#[inline(always)]
pub fn add_samples<T: Real>(
    robots: impl Robots<T>,
    now: &[Situation],
    turning: &Turning<T>,
    tau: &mut [T; NV],
) {
    let terms = &robots.shape().controller;
    let law = terms.iter().position(|t| matches!(t, Term::Feedforward(_)));
    let Some(law) = law.filter(|_| !now[0].mirrored) else {
        return;
    };
    let near = turning.near_switch();
    let tau7 = &mut tau[coordinate(FREE_FOOT)];
    for i in 0..T::LANES {
        let model = robots.lane(i);
        if near.lane(i)
            && let Term::Feedforward(law) = &model.controller[law]
        {
            let change = feedforward::sampled_within(model, law, &now[i], &turning.lane(i));
            tau7.set_lane(i, tau7.lane(i) + change);
        }
    }
}

/// Torques counted from the free foot, counted from the supporting one.
fn recount<T: Real>(tau: &mut [T; NV]) {
    reverse_legs(tau);
    // tau1 turns the free foot, and with it every joint on the way there counts.
    let couple = tau[2];
    tau[ROOT..LEG].iter_mut().for_each(|tau| *tau += couple);
}

/// The printed torques alone, Eqs. 16 to 22, at a state [N m], with sine and cosine of the phase that the
/// printed cosines have.
pub fn feedforward_torque(model: &Model, state: &State) -> ([f64; NV], [f64; 2]) {
    let now = Situation::of(state);
    let (sin, cos) = sin_cos_of(feedforward::phase(now.t, &now.clock));
    let mut tau = [0.0; NV];
    add_printed(model, &now, cos, &mut tau);
    if now.mirrored {
        recount(&mut tau);
    }
    (tau, [sin, cos])
}
