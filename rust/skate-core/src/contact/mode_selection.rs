//! Which contact mode is consistent with the laws of contact and friction?
//!
//! With at most four contact points the candidates are enumerated and checked by sign: Signorini's
//! conditions for every end of a sole (push-only), Coulomb's for every foot. The same conditions
//! serve accelerations with forces and, at an impact, velocities with impulses (Moreau 1988;
//! Glocker 2001, ch. 5); an inelastic impact that meets them cannot add energy. Several candidates
//! consistent: the one nearest to the present mode. None: `Jam`.

use crate::{
    contact::equations::{ContactProblem, PHI, Slip, Solution, Y, Z},
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, Foot, FrictionMode, SoleContact},
        lanes::ModelLanes,
    },
    numeric::scalar::{Mask, Scalar},
};
use nalgebra::Vector3;

/// What is known before the choice.
#[derive(Debug, Clone, Copy)]
pub struct ModeQuery {
    /// Ends of the soles that are on the ice. The problem's pivot is the support's toe unless only
    /// its heel is down, the free foot's point the heel unless only its toe is down.
    pub closed: [SoleContact; 2],
    /// Those of them that may carry: one that has just lost its load lets go.
    pub may_carry: [SoleContact; 2],
    /// Directions of sliding that are given: a foot that moves cannot choose.
    pub moving: [Option<FrictionMode>; 2],
    /// A foot that must come to rest on the ice.
    pub caught: Option<usize>,
    /// A foot that has come to the edge of its cone and may not stick.
    pub slips: Option<usize>,
    /// The mode to stay as close to as possible.
    pub near: ContactMode,
    /// A mode that has just come to its end.
    pub not: Option<ContactMode>,
    /// Force (or impulse) and acceleration (or velocity) that count as zero.
    pub tolerance: Tolerance,
}

/// See `ModeQuery::tolerance`.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    pub force: f64,
    pub motion: f64,
}

/// Normal forces at heel and toe of the supporting foot, from the forces at its pivot.
#[inline(always)]
pub fn support_loads<T: Scalar>(touch: SoleContact, f_z: T, couple: T, length: T) -> [T; 2] {
    let zero = T::zero();
    match touch {
        SoleContact::Air => [zero, zero],
        SoleContact::Heel => [f_z, zero],
        SoleContact::Toe => [zero, f_z],
        SoleContact::Flat => {
            let heel = -couple / length;
            [heel, f_z - heel]
        }
    }
}

/// Normal forces at heel and toe of the free foot, from the forces at its heel (toe if alone).
#[inline(always)]
pub fn free_loads<T: Scalar>(touch: SoleContact, f_z: T, couple: T, length: T) -> [T; 2] {
    match touch {
        SoleContact::Flat => {
            let toe = couple / length;
            [f_z - toe, toe]
        }
        _ => support_loads(touch, f_z, couple, length),
    }
}

/// Normal forces (heel, toe) of the supporting and the free foot [N].
pub fn loads(model: &Model, mode: ContactMode, forces: &Solution) -> [[f64; 2]; 2] {
    let length = model.sole.length();
    let (f, lam) = (&forces.f_root, &forces.lam);
    [
        support_loads(mode.support.touch, f[Z], f[PHI], length),
        free_loads(mode.free.touch, lam[Z], lam[PHI], length),
    ]
}

/// Signed friction coefficients of a mode.
pub fn slip(model: &Model, mode: ContactMode) -> Slip {
    Slip {
        support: model.friction.ratio(mode.support),
        free: model.friction.ratio(mode.free),
    }
}

/// The nearest consistent mode and its solution, or `Jam`.
pub fn select(
    model: &Model,
    problem: &ContactProblem,
    question: &ModeQuery,
) -> Result<(ContactMode, Solution), Termination> {
    let mut singular = false;
    for mode in by_distance(model, question) {
        match consistent(model, problem, question, mode) {
            Ok(Some(solution)) => return Ok((mode, solution)),
            Ok(None) => {}
            Err(Termination::Singular) => singular = true,
            Err(cause) => return Err(cause),
        }
    }
    Err(match singular {
        true => Termination::Singular,
        false => Termination::Jam,
    })
}

/// Most ways in which a foot may go on: in the air, or on one of three touches with one of three grips.
/// Grips that rub count twice in two-way contact, where the touch is given.
const WAYS: usize = 10;

/// All modes in which the feet may go on, the nearest first; of two that are equally far the one whose feet
/// come first among their ways.
fn by_distance(model: &Model, question: &ModeQuery) -> impl Iterator<Item = ContactMode> {
    let (supports, frees) = (Ways::of(model, question, 0), Ways::of(model, question, 1));
    let mut keys = [u32::MAX; WAYS * WAYS];
    for i in 0..supports.n {
        for j in 0..frees.n {
            let place = i * frees.n + j;
            keys[place] = (supports.far[i] + frees.far[j]) << 8 | place as u32;
        }
    }
    let not = question.not;
    let modes = std::iter::from_fn(move || {
        let keys = &mut keys[..supports.n * frees.n];
        let place = (*keys.iter().min()? & 0xff) as usize;
        // Whoever has had a turn comes after all others, and ends it.
        let had = std::mem::replace(keys.get_mut(place)?, u32::MAX) == u32::MAX;
        (!had).then(|| ContactMode {
            support: supports.feet[place / frees.n],
            free: frees.feet[place % frees.n],
        })
    });
    modes.filter(move |&mode| not != Some(mode))
}

/// Every way in which a foot may go on, and how far each is from the present one.
struct Ways {
    feet: [Foot; WAYS],
    far: [u32; WAYS],
    n: usize,
}

impl Ways {
    /// `which` is 0 for the supporting foot.
    fn of(model: &Model, question: &ModeQuery, which: usize) -> Self {
        let contact = model.contact;
        let (closed, may) = (question.closed[which], question.may_carry[which]);
        let near = [question.near.support, question.near.free][which];
        let mut ways = Self {
            feet: [Foot::AIR; WAYS],
            far: [0; WAYS],
            n: 0,
        };
        for touch in [
            SoleContact::Flat,
            SoleContact::Heel,
            SoleContact::Toe,
            SoleContact::Air,
        ] {
            let allowed = match contact.is_unilateral() {
                false => touch == closed,
                true => (may.heel() || !touch.heel()) && (may.toe() || !touch.toe()),
            };
            if !allowed {
                continue;
            }
            // In the air the grip is `Stuck` by convention.
            let friction_modes = match touch {
                SoleContact::Air => &[FrictionMode::Stuck],
                _ => model.friction.friction_modes,
            };
            for &friction_mode in friction_modes {
                let fits = match (touch, question.moving[which]) {
                    _ if question.caught == Some(which) => {
                        touch != SoleContact::Air && friction_mode == FrictionMode::Stuck
                    }
                    _ if question.slips == Some(which) && friction_mode == FrictionMode::Stuck => {
                        touch == SoleContact::Air
                    }
                    (SoleContact::Air, _) | (_, None) => true,
                    (_, Some(direction)) => friction_mode == direction,
                };
                if fits {
                    let foot = Foot::new(touch, friction_mode);
                    ways.add(foot, near);
                    if contact.friction_ends_when_pulled(which) && friction_mode.has_dry_friction()
                    {
                        let pulled = true;
                        ways.add(Foot { pulled, ..foot }, near);
                    }
                }
            }
        }
        ways
    }

    fn add(&mut self, foot: Foot, near: Foot) {
        self.feet[self.n] = foot;
        self.far[self.n] = foot_distance(foot, near);
        self.n += 1;
    }
}

fn foot_distance(a: Foot, b: Foot) -> u32 {
    let ends =
        u32::from(a.touch.heel() != b.touch.heel()) + u32::from(a.touch.toe() != b.touch.toe());
    let friction_mode = match (a.friction_mode, b.friction_mode) {
        (x, y) if x == y => 0,
        (FrictionMode::Forward, FrictionMode::Backward)
        | (FrictionMode::Backward, FrictionMode::Forward) => 2,
        _ => 1,
    };
    // An end of the sole weighs more than everything friction can change on both feet.
    8 * ends + 2 * friction_mode + u32::from(a.pulled != b.pulled)
}

/// The mode's solution, if every sign in it is admissible.
pub fn consistent(
    model: &Model,
    problem: &ContactProblem,
    question: &ModeQuery,
    mode: ContactMode,
) -> Result<Option<Solution>, Termination> {
    let contact = model.contact;
    let length = model.sole.length();
    let pivot_moves =
        question.closed[0] == SoleContact::Flat && mode.support.touch == SoleContact::Heel;
    let point_moves =
        question.closed[1] == SoleContact::Flat && mode.free.touch == SoleContact::Toe;
    let (turned, shifted);
    let mut problem = problem;
    if pivot_moves {
        turned = problem.with_pivot_moved(-length);
        problem = &turned;
    }
    if point_moves {
        shifted = problem.with_free_point_moved(length);
        problem = &shifted;
    }
    let solution = problem.solve(mode, slip(model, mode))?;
    let Solution {
        a_root,
        f_root,
        a_free,
        lam,
    } = solution;
    let tolerance = question.tolerance;
    let feet = [
        (
            mode.support,
            f_root,
            a_root,
            support_loads(mode.support.touch, f_root[Z], f_root[PHI], length),
        ),
        (
            mode.free,
            lam,
            a_free,
            free_loads(mode.free.touch, lam[Z], lam[PHI], length),
        ),
    ];
    for (which, (foot, force, motion, loads)) in feet.into_iter().enumerate() {
        if contact.is_unilateral() {
            // Where the reference point is the toe, the heel is `length` behind it, and vice versa.
            let at_toe = match which {
                0 => foot.touch != SoleContact::Heel && question.closed[0] != SoleContact::Heel,
                _ => point_moves || question.closed[1] == SoleContact::Toe,
            };
            let (heel, toe) = if at_toe {
                (motion[Z] - length * motion[PHI], motion[Z])
            } else {
                (motion[Z], motion[Z] + length * motion[PHI])
            };
            let closed = question.closed[which];
            let holds = |is_closed: bool, active: bool, load: f64, gap: f64| {
                if active {
                    load >= -tolerance.force
                } else {
                    !is_closed || gap >= -tolerance.motion
                }
            };
            if !holds(closed.heel(), foot.touch.heel(), loads[0], heel)
                || !holds(closed.toe(), foot.touch.toe(), loads[1], toe)
            {
                return Ok(None);
            }
        }
        if foot.touch == SoleContact::Air {
            continue;
        }
        if foot.friction_mode.has_dry_friction() {
            if question.moving[which].is_none() {
                let start = foot.friction_mode.sign() * motion[Y];
                let doubtful = start.abs() <= tolerance.motion;
                if start < -tolerance.motion || doubtful && !yields(problem, model, mode, which)? {
                    return Ok(None);
                }
            }
            if contact.friction_ends_when_pulled(which) {
                let load = if foot.pulled { -force[Z] } else { force[Z] };
                let doubtful = load.abs() <= tolerance.force;
                if load < -tolerance.force || doubtful && !bears(problem, model, mode, which)? {
                    return Ok(None);
                }
            }
        } else if !foot.slides() && !model.friction.holds(force[Y], force[Z], tolerance.force) {
            return Ok(None);
        }
    }
    Ok(Some(solution))
}

/// What the signs in a solution say of its mode, without a further look at how a foot would go on.
#[derive(Debug, Clone, Copy)]
pub struct Admissibility<M> {
    /// It is consistent, beyond doubt: so says `consistent`, if all of the mode's ends are closed and no direction
    /// is given.
    pub holds: M,
    /// It is not, beyond doubt.
    pub fails: M,
}

/// Look at the signs in solutions for a mode.
#[inline(always)]
pub fn admissibility<T: Scalar>(
    models: impl ModelLanes<T>,
    solution: &Solution<T>,
    mode: ContactMode,
    tolerance: Tolerance,
) -> Admissibility<T::Mask> {
    let contact = models.shape().contact;
    let length = models.number(|m| m.sole.length());
    let [force, motion] = [tolerance.force, tolerance.motion].map(T::of);
    let (f, lam) = (&solution.f_root, &solution.lam);
    let feet = [
        (
            mode.support,
            f,
            solution.a_root[Y],
            support_loads(mode.support.touch, f[Z], f[PHI], length),
        ),
        (
            mode.free,
            lam,
            solution.a_free[Y],
            free_loads(mode.free.touch, lam[Z], lam[PHI], length),
        ),
    ];
    let mut admissibility = Admissibility {
        holds: T::Mask::of(true),
        fails: T::Mask::of(false),
    };
    // A sign that is as it must be, or is not: beyond doubt.
    let mut see = |right: T::Mask, wrong: T::Mask| {
        admissibility.holds = admissibility.holds & right;
        admissibility.fails = admissibility.fails | wrong;
    };
    for (which, (foot, f, along, [heel, toe])) in feet.into_iter().enumerate() {
        if foot.touch == SoleContact::Air {
            continue;
        }
        if contact.is_unilateral() {
            if foot.touch.heel() {
                see(heel.ge(-force), heel.lt(-force));
            }
            if foot.touch.toe() {
                see(toe.ge(-force), toe.lt(-force));
            }
        }
        if foot.friction_mode.has_dry_friction() {
            let start = T::of(foot.friction_mode.sign()) * along;
            see(motion.lt(start), start.lt(-motion));
            if contact.friction_ends_when_pulled(which) {
                let load = if foot.pulled { -f[Z] } else { f[Z] };
                see(force.lt(load), load.lt(-force));
            }
        } else if !foot.slides() && models.shape().friction.is_dry() {
            let normal = f[Z].simd_max(T::zero());
            let [forward, backward] =
                [true, false].map(|forward| models.number(|m| m.friction.mu(forward)));
            let (low, high) = (-forward * normal - force, backward * normal + force);
            see(low.le(f[Y]) & f[Y].le(high), f[Y].lt(low) | high.lt(f[Y]));
        }
    }
    admissibility
}

/// Does a sliding foot that starts from rest follow a push along the ice? Where friction is high
/// enough, the normal force it brings along turns the answer round (Painleve 1895; Genot and
/// Brogliato 1999), and a foot at the edge of its cone has nowhere to slide.
fn yields(
    problem: &ContactProblem,
    model: &Model,
    mode: ContactMode,
    which: usize,
) -> Result<bool, Termination> {
    let solution = pushed(problem, which, Y).solve(mode, slip(model, mode))?;
    Ok(if which == 0 {
        solution.a_root[Y]
    } else {
        solution.a_free[Y]
    } > 0.0)
}

/// Does the normal force of a sliding foot grow when it is pushed into the ice? If not, there is no
/// force on the far side of N = 0, with friction or without.
fn bears(
    problem: &ContactProblem,
    model: &Model,
    mode: ContactMode,
    which: usize,
) -> Result<bool, Termination> {
    Ok(amplification(problem, model, mode, which)? > 0.0)
}

/// By how much the normal force of a sliding foot grows for a unit of force that pushes the foot into the
/// ice: 1 without friction, without bound where sliding comes to Painleve's paradox, negative beyond.
pub fn amplification(
    problem: &ContactProblem,
    model: &Model,
    mode: ContactMode,
    which: usize,
) -> Result<f64, Termination> {
    let mut rubbing = mode;
    rubbing.support.pulled &= which != 0;
    rubbing.free.pulled &= which != 1;
    let solution = pushed(problem, which, Z).solve(rubbing, slip(model, rubbing))?;
    // The unit push points up, away from the ice.
    Ok(if which == 0 {
        -solution.f_root[Z]
    } else {
        -solution.lam[Z]
    })
}

/// The problem with a unit force at one foot's contact point as its only load.
fn pushed(problem: &ContactProblem, which: usize, along: usize) -> ContactProblem {
    let mut pushed = *problem;
    if which == 0 {
        pushed.b = Vector3::zeros();
        pushed.b[along] = 1.0;
        pushed.alpha0 = Vector3::zeros();
    } else {
        pushed.b = problem.G.row(along).transpose();
        pushed.alpha0 = problem.W.column(along).into();
    }
    pushed
}
