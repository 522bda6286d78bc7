//! Multibody dynamics: kinematics, inertia matrix, bias forces, articulated bodies, Delassus matrix.

pub mod aba;
pub mod aba_trunk;
pub mod bias_forces;
pub mod centre_of_mass;
pub mod crba_rnea;
pub mod delassus;
pub mod kinematics;
pub mod rnea_derivatives;
pub mod spin;
mod velocities;
