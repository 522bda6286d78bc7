//! Normal forces at the ends of the soles.

use crate::{
    contact::equations::{PHI, Solution, Z},
    model::contact_mode::{ContactMode, SoleContact},
    numeric::scalar::Scalar,
};

/// Normal forces at heel and toe of the supporting foot from the force `f_z` and the couple at its pivot [N].
#[inline(always)]
pub fn support_loads<T: Scalar>(touch: SoleContact, f_z: T, couple: T, lever: T) -> [T; 2] {
    let zero = T::zero();
    match touch {
        SoleContact::Air => [zero, zero],
        SoleContact::Heel => [f_z, zero],
        SoleContact::Toe => [zero, f_z],
        SoleContact::Flat => {
            let heel = -couple / lever;
            [heel, f_z - heel]
        }
    }
}

/// Normal forces at heel and toe of the free foot from the force `f_z` and the couple at its contact point [N].
#[inline(always)]
pub fn free_loads<T: Scalar>(touch: SoleContact, f_z: T, couple: T, lever: T) -> [T; 2] {
    match touch {
        SoleContact::Flat => {
            let toe = couple / lever;
            [f_z - toe, toe]
        }
        _ => support_loads(touch, f_z, couple, lever),
    }
}

/// Normal forces (heel, toe) of the supporting and the free foot [N], with the levers of `ContactProblem` [m].
#[inline(always)]
pub fn loads<T: Scalar>(lever: [T; 2], mode: ContactMode, forces: &Solution<T>) -> [[T; 2]; 2] {
    let (f, lam) = (&forces.f_root, &forces.lam);
    [
        support_loads(mode.support.touch, f[Z], f[PHI], lever[0]),
        free_loads(mode.free.touch, lam[Z], lam[PHI], lever[1]),
    ]
}
