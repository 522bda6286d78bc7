//! The law of friction, resolved once.

use crate::{
    model::contact_mode::{Foot, FrictionMode},
    scene::Friction,
};

/// What a foot on the ice may do, and what that costs.
#[derive(Debug, Clone, Copy)]
pub struct FrictionLaw {
    /// Ways in which a foot on the ice may go on.
    pub friction_modes: &'static [FrictionMode],
    /// Dry coefficients against forward and backward sliding, read where there is dry friction.
    mu: [f64; 2],
    /// A sliding foot slower than this is caught if the force allows it [m/s].
    pub capture_speed: f64,
    /// Force per speed of the supporting foot [N s/m]; it acts as damping of y0.
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
    /// Feet may stick and slide.
    pub fn is_dry(&self) -> bool {
        self.friction_modes.len() > 1
    }

    /// Feet never slip.
    pub fn sticks(&self) -> bool {
        self.friction_modes == [FrictionMode::Stuck]
    }

    /// Dry coefficient of a foot that slides forward or backward (section 4.1).
    pub fn mu(&self, forward: bool) -> f64 {
        self.mu[usize::from(!forward)]
    }

    /// Grip of a foot at this speed; up to `rest` a foot sticks if it can [m/s].
    pub fn mode_at(&self, speed: f64, rest: f64) -> FrictionMode {
        match self.friction_modes {
            [only] => *only,
            _ => FrictionMode::of(speed, rest),
        }
    }

    /// mu sign(v) of a foot: the ratio of -f_y to f_z while dry friction acts.
    pub fn ratio(&self, foot: Foot) -> f64 {
        if !foot.friction_mode.has_dry_friction() || foot.pulled {
            return 0.0;
        }
        foot.friction_mode.sign() * self.mu(foot.friction_mode == FrictionMode::Forward)
    }

    /// Does the cone of a sticking foot hold this force, within `slack` [N]?
    pub fn holds(&self, f_y: f64, f_z: f64, slack: f64) -> bool {
        if !self.is_dry() {
            return true;
        }
        let normal = f_z.max(0.0);
        (-self.mu(true) * normal - slack..=self.mu(false) * normal + slack).contains(&f_y)
    }
}
