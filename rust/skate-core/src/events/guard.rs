//! Guards: signed functions whose fall through zero ends a contact mode.

use crate::{
    contact::{
        equations::{Solution, Y, Z},
        loads::loads,
    },
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SUPPORT, SoleContact},
        friction::cone,
        lanes::ModelLanes,
    },
    numeric::scalar::Scalar,
    rhs::{Evaluation, sole_points::fall_margin},
};

/// A guard is positive while its mode lasts. Feet are `SUPPORT` or `FREE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guard {
    /// Height of an end of a sole above the ice [m].
    Gap(usize, End),
    /// Normal force at an end of a sole [N].
    Load(usize, End),
    /// Normal force of a sliding foot, times -1 if the foot is pulled [N]. A change of sign switches friction off
    /// or on.
    Pull(usize),
    /// Distance of the force on a sticking foot from the edge of the friction cone at which it starts to slide
    /// forward (backward) [N].
    ConeForward(usize),
    ConeBackward(usize),
    /// Speed of a sliding foot above the capture speed [m/s].
    Speed(usize),
    /// Velocity of a sliding foot in its direction [m/s]. A change of sign reverses friction.
    Reversal(usize),
    /// `WEDGE_LOAD` minus the normal force of a sliding foot [N]. Near Painleve's paradox friction increases the
    /// normal force without bound. Torques can increase it, too; `EventHandler` distinguishes the two.
    Wedge(usize),
    /// Height of the head above its limit, or of a knee or an ankle above the ice [m].
    Fall,
}

/// Gaps and speeds count as crossed this far below zero [m], [m/s], beyond rounding errors.
pub const GAP_TOLERANCE: f64 = 1e-11;
/// Normal forces and cones count as crossed this far below zero, relative to the robot's weight.
pub const FORCE_TOLERANCE: f64 = 2e-9;
/// Forces in a mode that is being selected may violate its conditions by this, relative to the weight.
pub const FORCE_SLACK: f64 = 1e-6;
/// A sliding foot with a normal force above this many weights may be wedged.
pub const WEDGE_LOAD: f64 = 100.0;

/// Normal force at an end of a sole, plus the tolerance [N].
#[inline(always)]
pub fn load_value<T: Scalar>(
    models: impl ModelLanes<T>,
    mode: ContactMode,
    (lever, forces): ([T; 2], &Solution<T>),
    (which, end): (usize, End),
) -> T {
    let loads = loads(lever, mode, forces);
    loads[which][end as usize] + models.number(|m| FORCE_TOLERANCE * m.weight())
}

impl Guard {
    /// Must this guard be positive from the start of a mode? The speed above that of a capture need not: a foot starts
    /// to slide from rest. In two-way contact a toe may be below the ice.
    pub fn binds_at_start(self, model: &Model) -> bool {
        match self {
            Self::Speed(_) => false,
            Self::Gap(..) => model.contact.is_push_only,
            _ => true,
        }
    }

    /// Does it depend on positions and velocities only, and not on forces?
    pub fn is_kinematic(self) -> bool {
        matches!(
            self,
            Self::Gap(..) | Self::Speed(_) | Self::Reversal(_) | Self::Fall
        )
    }

    /// Does a rise through zero count, too? In two-way contact without a contact of the toe alone, the toe may be
    /// below the ice and rise to it.
    pub fn counts_both_ways(self, model: &Model) -> bool {
        self == Self::Gap(FREE, End::Toe) && model.contact.free_toe_may_be_below
    }

    /// Value for the state of `eval`; `z0` and `vy` are height and velocity of the pivot.
    pub fn value<T: Scalar>(
        self,
        models: impl ModelLanes<T>,
        eval: &Evaluation<T>,
        mode: ContactMode,
        pivot: (T, T),
    ) -> T {
        self.value_in_lanes(models, eval, mode, pivot)
    }

    /// `value` for code in lanes, which must be inlined.
    #[inline(always)]
    pub fn value_in_lanes<T: Scalar>(
        self,
        models: impl ModelLanes<T>,
        eval: &Evaluation<T>,
        mode: ContactMode,
        (z0, vy): (T, T),
    ) -> T {
        let tolerance = models.number(|m| FORCE_TOLERANCE * m.weight());
        let cone = |normal: T| {
            let mu = [0, 1].map(|i| models.number(|m| m.friction.mu[i]));
            cone(mu, normal)
        };
        let force = |which: usize| {
            if which == SUPPORT {
                eval.solution.f_root
            } else {
                eval.solution.lam
            }
        };
        // Velocity in the direction of sliding.
        let sliding_speed = |which: usize| {
            let velocity = if which == SUPPORT {
                vy
            } else {
                eval.point_velocity[Y]
            };
            T::of(mode.foot(which).friction_mode.sign()) * velocity
        };
        match self {
            Self::Gap(which, end) => {
                eval.gap(models, mode.support.touch, z0, (which, end)) + T::of(GAP_TOLERANCE)
            }
            Self::Load(which, end) => load_value(
                models,
                mode,
                (eval.levers(models), &eval.solution),
                (which, end),
            ),
            Self::Pull(which) => {
                let sign = if mode.foot(which).pulled { -1.0 } else { 1.0 };
                T::of(sign) * force(which)[Z] + tolerance
            }
            Self::ConeForward(which) => {
                let f = force(which);
                let [least, _] = cone(f[Z]);
                f[Y] - least + tolerance
            }
            Self::ConeBackward(which) => {
                let f = force(which);
                let [_, largest] = cone(f[Z]);
                largest - f[Y] + tolerance
            }
            Self::Speed(which) => {
                sliding_speed(which) - models.number(|m| m.friction.capture_speed)
            }
            Self::Reversal(which) => sliding_speed(which) + T::of(GAP_TOLERANCE),
            Self::Wedge(which) => {
                models.number(|m| WEDGE_LOAD * m.weight()) - force(which)[Z].abs()
            }
            Self::Fall => fall_margin(models, &eval.kin, eval.kin.head(models).z, z0),
        }
    }

    /// Does this guard start at zero after the event of `passed`, by construction? It watches for the way back.
    pub fn is_reverse_of(self, passed: Self) -> bool {
        match (self, passed) {
            (Self::Pull(a), Self::Pull(b)) => a == b,
            (Self::Gap(a, end), Self::Load(b, other)) => (a, end) == (b, other),
            _ => false,
        }
    }

    /// The contacts after this guard's end has landed; unchanged for other guards.
    pub fn landed(self, (support, free): (SoleContact, SoleContact)) -> (SoleContact, SoleContact) {
        match self {
            Self::Gap(SUPPORT, end) => (support.with(end, true), free),
            Self::Gap(_, end) => (support, free.with(end, true)),
            _ => (support, free),
        }
    }

    /// Name of the event, unique among the guards of a mode.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Gap(SUPPORT, End::Heel) => "supporting heel lands",
            Self::Gap(SUPPORT, End::Toe) => "supporting toe lands",
            Self::Gap(_, End::Heel) => "free heel lands",
            Self::Gap(_, End::Toe) => "free toe lands",
            Self::Load(SUPPORT, End::Heel) => "supporting heel lifts",
            Self::Load(SUPPORT, End::Toe) => "supporting toe lifts",
            Self::Load(_, End::Heel) => "free heel lifts",
            Self::Load(_, End::Toe) => "free toe lifts",
            Self::Pull(SUPPORT) => "supporting foot's normal force changes sign",
            Self::Pull(_) => "free foot's normal force changes sign",
            Self::ConeForward(SUPPORT) => "supporting foot slips forward",
            Self::ConeForward(_) => "free foot slips forward",
            Self::ConeBackward(SUPPORT) => "supporting foot slips backward",
            Self::ConeBackward(_) => "free foot slips backward",
            Self::Speed(SUPPORT) => "supporting foot slows down",
            Self::Speed(_) => "free foot slows down",
            Self::Reversal(SUPPORT) => "supporting foot stops",
            Self::Reversal(_) => "free foot stops",
            Self::Wedge(SUPPORT) => "supporting foot is wedged",
            Self::Wedge(_) => "free foot is wedged",
            Self::Fall => "fall",
        }
    }
}
