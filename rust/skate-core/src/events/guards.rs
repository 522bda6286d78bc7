//! Signed functions whose fall through zero ends a contact mode.

use crate::{
    contact::{
        equations::{Solution, Y, Z},
        mode_selection::loads,
    },
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact, touches},
    },
    rhs::Evaluation,
};

/// All guards are positive while the mode may go on. Feet are `SUPPORT` or `FREE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guard {
    /// Height of an end of a sole above the ice [m].
    Gap(usize, End),
    /// Normal force at an end of a sole [N].
    Load(usize, End),
    /// Sign of the normal force of a sliding foot, which decides whether friction acts [N].
    Pull(usize),
    /// Distance of the force on a sticking foot from the edge of the cone where it starts to slide
    /// forward (backward) [N].
    ConeForward(usize),
    ConeBackward(usize),
    /// Speed of a sliding foot above the capture speed [m/s].
    Speed(usize),
    /// Speed of a sliding foot in its direction [m/s].
    Reversal(usize),
    /// Distance of the normal force of a sliding foot from `WEDGE_LOAD` [N]: friction drives it up
    /// without bound where Painleve's paradox is near. So may torques, which is no event.
    Wedge(usize),
    /// Height of the head above its limit, or of a knee or an ankle above the ice [m].
    Fall,
}

/// Gaps and speeds count as crossed this far below zero [m], [m/s]: rounding stays above it.
pub const GAP_TOLERANCE: f64 = 1e-11;
/// Normal forces and cones count as crossed at this share of the robot's weight.
pub const FORCE_TOLERANCE: f64 = 2e-9;

/// A guard that starts this far below zero, in shares of the weight, is not yet passed: locating and
/// projecting a state moves its forces by about 1e-8. If it goes on falling it fires in the next step.
pub const FORCE_SLACK: f64 = 1e-6;

/// A sliding foot pressed into the ice by more than this many weights may be wedged.
pub const WEDGE_LOAD: f64 = 100.0;

/// Most guards that a mode can have.
pub const MOST: usize = 16;

/// The guards of one mode.
#[derive(Debug, Clone, Copy)]
pub struct Guards {
    list: [Guard; MOST],
    len: usize,
}

impl Guards {
    pub fn of(model: &Model, mode: ContactMode) -> Self {
        let mut guards = Self::none();
        if model.scene.fall.is_some() {
            guards.push(Guard::Fall);
        }
        guards.contacts(model, touches(mode));
        guards.friction(model, SUPPORT, mode.support);
        guards.friction(model, FREE, mode.free);
        guards
    }

    /// Those of the ends of the soles alone, where the supporting and the free foot touch the ice as told.
    pub fn of_ends(model: &Model, touches: (SoleContact, SoleContact)) -> Self {
        let mut guards = Self::none();
        guards.contacts(model, touches);
        guards
    }

    fn none() -> Self {
        Self {
            list: [Guard::Fall; MOST],
            len: 0,
        }
    }

    fn contacts(&mut self, model: &Model, (support, free): (SoleContact, SoleContact)) {
        if !model.contact.is_unilateral() {
            return self.two_way(model, (support, free));
        }
        self.ends(model, SUPPORT, support);
        if model.contact.free_foot_touches() {
            self.ends(model, FREE, free);
        }
    }

    /// Every guard that some mode of the model has.
    pub fn all(model: &Model) -> Vec<Guard> {
        let mut all: Vec<Guard> = Vec::new();
        for mode in model.modes() {
            let guards = Self::of(model, mode);
            for &guard in guards.as_slice() {
                if !all.contains(&guard) {
                    all.push(guard);
                }
            }
        }
        all
    }

    pub fn as_slice(&self) -> &[Guard] {
        &self.list[..self.len]
    }

    fn push(&mut self, guard: Guard) {
        self.list[self.len] = guard;
        self.len += 1;
    }

    /// Push-only ice: an end in contact may lose its load, an end in the air may land.
    fn ends(&mut self, model: &Model, foot: usize, touch: SoleContact) {
        for (end, down) in [(End::Heel, touch.heel()), (End::Toe, touch.toe())] {
            if down {
                self.push(Guard::Load(foot, end));
            } else {
                self.land(model, foot, end);
            }
        }
    }

    fn land(&mut self, model: &Model, foot: usize, end: End) {
        if model.contact.ends_land() {
            self.push(Guard::Gap(foot, end));
        }
    }

    /// Two-way contact: the guards of the rules in `EDGES`; a test compares the two.
    fn two_way(&mut self, model: &Model, (support, free): (SoleContact, SoleContact)) {
        let contact = model.contact;
        match free {
            SoleContact::Air => {
                if contact.free_foot_touches() {
                    self.land(model, FREE, End::Heel);
                }
                if contact.free_toe_touches_alone() {
                    self.land(model, FREE, End::Toe);
                }
            }
            SoleContact::Flat => match support {
                SoleContact::Flat if contact.support_rotates() => {
                    self.push(Guard::Load(SUPPORT, End::Heel))
                }
                SoleContact::Flat => {}
                _ => self.push(Guard::Load(SUPPORT, End::Toe)),
            },
            touch => {
                let (end, other) = match touch {
                    SoleContact::Heel => (End::Heel, End::Toe),
                    _ => (End::Toe, End::Heel),
                };
                self.land(model, FREE, other);
                if contact.free_edge_lifts() {
                    self.push(Guard::Load(FREE, end));
                }
            }
        }
        if support == SoleContact::Toe {
            self.land(model, SUPPORT, End::Heel);
        }
    }

    fn friction(&mut self, model: &Model, which: usize, foot: Foot) {
        if foot.touch == SoleContact::Air || !model.friction.is_dry() {
            return;
        }
        if !foot.slides() {
            self.push(Guard::ConeForward(which));
            self.push(Guard::ConeBackward(which));
            return;
        }
        self.push(Guard::Speed(which));
        self.push(Guard::Reversal(which));
        self.push(Guard::Wedge(which));
        if model.contact.friction_ends_when_pulled(which) {
            self.push(Guard::Pull(which));
        }
    }
}

/// The normal force at an end of a foot's sole, on the safe side of rounding [N].
pub fn carried(
    model: &Model,
    mode: ContactMode,
    forces: &Solution,
    (which, end): (usize, End),
) -> f64 {
    loads(model, mode, forces)[which][end as usize] + FORCE_TOLERANCE * model.weight()
}

impl Guard {
    /// Must this guard be positive from the first instant of a mode? Speeds need not: a foot starts
    /// to slide from rest; torques may press it from the start; and in two-way contact a toe may already
    /// be below the ice.
    pub fn binds_at_start(self, model: &Model) -> bool {
        match self {
            Self::Speed(_) | Self::Reversal(_) | Self::Wedge(_) => false,
            Self::Gap(..) => model.contact.is_unilateral(),
            _ => true,
        }
    }

    /// In two-way contact the free sole becomes flat from either side: with no contact of the toe
    /// alone the toe may come up through the ice.
    pub fn counts_both_ways(self, model: &Model) -> bool {
        self == Self::Gap(FREE, End::Toe) && model.contact.free_toe_may_be_below()
    }

    /// Its value for the state that `eval` was made for; `z0` and `vy` are those of the pivot.
    pub fn value(
        self,
        model: &Model,
        eval: &Evaluation,
        mode: ContactMode,
        (z0, vy): (f64, f64),
    ) -> f64 {
        let tolerance = FORCE_TOLERANCE * model.weight();
        let force = |which: usize| {
            if which == SUPPORT {
                eval.solution.f_root
            } else {
                eval.solution.lam
            }
        };
        let foot = |which: usize| {
            if which == SUPPORT {
                mode.support
            } else {
                mode.free
            }
        };
        let speed = |which: usize| {
            if which == SUPPORT {
                vy
            } else {
                eval.point_velocity[Y]
            }
        };
        match self {
            Self::Gap(which, end) => {
                eval.gap(model, mode.support.touch, z0, (which, end)) + GAP_TOLERANCE
            }
            Self::Load(which, end) => carried(model, mode, &eval.solution, (which, end)),
            Self::Pull(which) => {
                let sign = if foot(which).pulled { -1.0 } else { 1.0 };
                sign * force(which)[Z] + tolerance
            }
            Self::ConeForward(which) => {
                let f = force(which);
                f[Y] + model.friction.mu(true) * f[Z].max(0.0) + tolerance
            }
            Self::ConeBackward(which) => {
                let f = force(which);
                model.friction.mu(false) * f[Z].max(0.0) - f[Y] + tolerance
            }
            Self::Speed(which) => {
                foot(which).friction_mode.sign() * speed(which) - model.friction.capture_speed
            }
            Self::Reversal(which) => {
                foot(which).friction_mode.sign() * speed(which) + GAP_TOLERANCE
            }
            Self::Wedge(which) => WEDGE_LOAD * model.weight() - force(which)[Z].abs(),
            Self::Fall => {
                let head = z0 + eval.kin.head(model).z - model.fall_height;
                let joints = model.fall_joints.iter().map(|&b| eval.kin.p[b].z);
                head.min(z0 + joints.fold(f64::INFINITY, f64::min))
            }
        }
    }

    /// What people are told; no two guards of a mode are told alike.
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
