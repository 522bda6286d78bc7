//! The inequalities that a solution of the contact equations must satisfy in its mode: Signorini's for the
//! loads (push-only contact), Coulomb's for the friction of each foot.

use crate::{
    contact::{
        equations::{Solution, Y, Z},
        loads::loads,
    },
    model::{
        contact_mode::{ContactMode, FREE, SUPPORT, SoleContact},
        friction::cone,
        lanes::ModelLanes,
    },
    numeric::scalar::{Mask, Scalar},
};

/// Force (or impulse) and acceleration (or velocity) that count as zero.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    pub force: f64,
    pub motion: f64,
}

/// One inequality; the number is the foot's index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// A closed end of a sole is not pulled.
    Load(usize),
    /// A sliding foot moves in its direction.
    Direction(usize),
    /// The sign of a sliding foot's normal force is that of its mode.
    NormalForce(usize),
    /// The force on a sticking foot lies in the friction cone.
    Cone(usize),
}

/// Call `visit(condition, holds, fails)` for every inequality of the mode. Where neither mask is set the
/// value is zero within the tolerance and decides nothing.
#[inline(always)]
pub fn visit_conditions<T: Scalar>(
    models: impl ModelLanes<T>,
    (lever, solution): ([T; 2], &Solution<T>),
    mode: ContactMode,
    tolerance: Tolerance,
    mut visit: impl FnMut(Condition, T::Mask, T::Mask),
) {
    let model = models.shape();
    let contact = model.contact;
    let [force, motion] = [tolerance.force, tolerance.motion].map(T::of);
    let loads = loads(lever, mode, solution);
    let feet = [
        (SUPPORT, mode.support, &solution.f_root, solution.a_root[Y]),
        (FREE, mode.free, &solution.lam, solution.a_free[Y]),
    ];
    for (which, foot, f, acceleration) in feet {
        if foot.touch == SoleContact::Air {
            continue;
        }
        if contact.is_push_only {
            let [heel, toe] = loads[which];
            if foot.touch.heel() {
                visit(Condition::Load(which), heel.ge(-force), heel.lt(-force));
            }
            if foot.touch.toe() {
                visit(Condition::Load(which), toe.ge(-force), toe.lt(-force));
            }
        }
        if foot.friction_mode.has_dry_friction() {
            let along = T::of(foot.friction_mode.sign()) * acceleration;
            visit(
                Condition::Direction(which),
                motion.lt(along),
                along.lt(-motion),
            );
            if contact.ends_friction_when_pulled(which, foot) || foot.pulled {
                let normal = if foot.pulled { -f[Z] } else { f[Z] };
                visit(
                    Condition::NormalForce(which),
                    force.lt(normal),
                    normal.lt(-force),
                );
            }
        } else if !foot.slides() && model.friction.is_dry() {
            let mu = [0, 1].map(|i| models.number(|m| m.friction.mu[i]));
            let [low, high] = cone(mu, f[Z]);
            let (low, high) = (low - force, high + force);
            visit(
                Condition::Cone(which),
                low.le(f[Y]) & f[Y].le(high),
                f[Y].lt(low) | high.lt(f[Y]),
            );
        }
    }
}

/// Result of all conditions of a mode, per lane.
#[derive(Debug, Clone, Copy)]
pub struct Admissibility<M> {
    /// Every condition holds.
    pub holds: M,
    /// Some condition fails.
    pub fails: M,
}

/// Evaluate all conditions of the mode.
#[inline(always)]
pub fn admissibility<T: Scalar>(
    models: impl ModelLanes<T>,
    (lever, solution): ([T; 2], &Solution<T>),
    mode: ContactMode,
    tolerance: Tolerance,
) -> Admissibility<T::Mask> {
    let mut admissibility = Admissibility {
        holds: T::Mask::of(true),
        fails: T::Mask::of(false),
    };
    visit_conditions(
        models,
        (lever, solution),
        mode,
        tolerance,
        #[inline(always)]
        |_, holds, fails| {
            admissibility.holds = admissibility.holds & holds;
            admissibility.fails = admissibility.fails | fails;
        },
    );
    admissibility
}
