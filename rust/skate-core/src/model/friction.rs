//! The friction law (section 4.1, Eq. 11), resolved once: coefficients by the direction of sliding, and
//! the sign of the friction force. The guards `Speed`, `Reversal` and `Pull` locate the instants at which
//! that sign changes.

use crate::{numeric::scalar::Scalar, scene::Friction};
use serde::{Deserialize, Serialize};

/// Motion of a foot along the ice. A foot in the air is `Stuck` by convention.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum FrictionMode {
    Stuck,
    /// The foot slides under dry friction.
    Forward,
    Backward,
    /// The foot slides in either direction, without dry friction.
    Frictionless,
}

impl FrictionMode {
    /// Mode of a foot at this speed under dry friction; up to `rest` it does not slide [m/s].
    pub fn of(speed: f64, rest: f64) -> Self {
        if speed.abs() <= rest {
            Self::Stuck
        } else if speed > 0.0 {
            Self::Forward
        } else {
            Self::Backward
        }
    }

    /// Does dry friction act?
    pub fn has_dry_friction(self) -> bool {
        matches!(self, Self::Forward | Self::Backward)
    }

    /// Sign of the sliding velocity, 0 without dry friction.
    pub fn sign(self) -> f64 {
        match self {
            Self::Stuck | Self::Frictionless => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// Coefficients and admissible friction modes.
#[derive(Debug, Clone, Copy)]
pub struct FrictionLaw {
    /// Friction modes that a foot on the ice may have.
    pub friction_modes: &'static [FrictionMode],
    /// Dry coefficients of a foot that slides forward and backward (section 4.1).
    pub mu: [f64; 2],
    /// Speed below which a sliding foot sticks if the friction cone holds the force [m/s].
    pub capture_speed: f64,
    /// Viscous friction of the supporting foot [N s/m]; it acts as damping of y0.
    pub drag: f64,
}

const DRY: &[FrictionMode] = &[
    FrictionMode::Stuck,
    FrictionMode::Forward,
    FrictionMode::Backward,
];

impl From<Friction> for FrictionLaw {
    fn from(friction: Friction) -> Self {
        let law = |friction_modes, mu, capture_speed, drag| Self {
            friction_modes,
            mu,
            capture_speed,
            drag,
        };
        match friction {
            Friction::Sticking {} => law(&[FrictionMode::Stuck], [0.0; 2], 0.0, 0.0),
            Friction::Directional {
                mu_forward,
                mu_backward,
                capture_speed,
            } => law(DRY, [mu_forward, mu_backward], capture_speed, 0.0),
            Friction::Coulomb { mu, capture_speed } => law(DRY, [mu; 2], capture_speed, 0.0),
            Friction::Viscous { coefficient } => {
                law(&[FrictionMode::Frictionless], [0.0; 2], 0.0, coefficient)
            }
            Friction::None {} => law(&[FrictionMode::Frictionless], [0.0; 2], 0.0, 0.0),
        }
    }
}

impl FrictionLaw {
    /// May feet both stick and slide?
    pub fn is_dry(&self) -> bool {
        self.friction_modes.len() > 1
    }

    /// Do feet never slide?
    pub fn sticks(&self) -> bool {
        self.friction_modes == [FrictionMode::Stuck]
    }

    /// Friction mode of a foot at this speed; up to `rest` a foot sticks if it can [m/s].
    pub fn mode_at(&self, speed: f64, rest: f64) -> FrictionMode {
        match self.friction_modes {
            [only] => *only,
            _ => FrictionMode::of(speed, rest),
        }
    }

    /// Ratio mu sign(v_y) of -f_y to f_z in Eq. 11; 0 where dry friction does not act.
    pub fn ratio(&self, friction_mode: FrictionMode, pulled: bool) -> f64 {
        match friction_mode {
            FrictionMode::Forward if !pulled => self.mu[0],
            FrictionMode::Backward if !pulled => -self.mu[1],
            _ => 0.0,
        }
    }
}

/// Least and largest friction force of a sticking foot under the normal force `f_z` [N], for the coefficients
/// `mu` of forward and backward sliding.
#[inline(always)]
pub fn cone<T: Scalar>(mu: [T; 2], f_z: T) -> [T; 2] {
    let normal = f_z.simd_max(T::zero());
    [-mu[0] * normal, mu[1] * normal]
}
