//! Laws that every motion must keep, checked while it runs, and the breaches found.
//!
//! `Simulation::check` starts a `LawChecker`, an observer of the motion. It computes energies, momenta, positions and
//! forces from the states it is shown, with evaluations of its own. Without it a motion computes nothing of this.

mod checker;
mod contact;
mod instant;
mod limits;
mod records;

pub use checker::LawChecker;

use crate::{model::contact_mode::ContactMode, sim::Simulation};

/// A law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Friction of the feet and of the joints takes energy in every time step. Not the friction of a pulled foot with
    /// `PulledFriction::Literal`, which drives the foot.
    FrictionDissipates,
    /// Kinetic and potential energy do not increase in an event, nor at a start. A kick is none.
    ImpactsDissipate,
    /// Energy changes in a step by the entries of the energy balance, if the scene has one.
    EnergyBalance,
    /// While no foot touches the ice, momenta change by gravity alone: the linear ones, and the angular one about the
    /// centre of mass. The latter counts as a velocity by the mass and a length of 1 m.
    MomentumInFlight,
    /// Normal forces have the sign of the contact mode: push-only ice pushes, a pulled foot is pulled.
    NormalForces,
    /// The force on a sticking foot lies in the friction cone.
    FrictionInCone,
    /// A sliding foot moves in the direction of its mode.
    SlidingDirection,
    /// No end of a sole that can land is below the ice, nor a knee or an ankle; the head is above its limit.
    AboveIce,
    /// Closed ends stay on the ice, a sticking free foot stays where it is.
    ClosedEndsStay,
    /// They have no velocity, nor has a sticking supporting foot.
    ClosedEndsRest,
    /// Where a normal force changes sign, friction of that foot switches. If that is consistent, forces do not jump.
    ForcesContinuous,
    /// No point of the robot moves in an event, nor where contacts close at a start.
    NoJump,
    /// Its velocity changes by impacts only.
    VelocitiesNeedImpacts,
    /// Joints and the supporting foot turn slower than a motion may that goes on.
    FiniteRates,
}

impl Law {
    /// In the order of their indices.
    pub const ALL: [Self; 14] = [
        Self::FrictionDissipates,
        Self::ImpactsDissipate,
        Self::EnergyBalance,
        Self::MomentumInFlight,
        Self::NormalForces,
        Self::FrictionInCone,
        Self::SlidingDirection,
        Self::AboveIce,
        Self::ClosedEndsStay,
        Self::ClosedEndsRest,
        Self::ForcesContinuous,
        Self::NoJump,
        Self::VelocitiesNeedImpacts,
        Self::FiniteRates,
    ];

    /// The name in Python and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::FrictionDissipates => "friction_dissipates",
            Self::ImpactsDissipate => "impacts_dissipate",
            Self::EnergyBalance => "energy_balance",
            Self::MomentumInFlight => "momentum_in_flight",
            Self::NormalForces => "normal_forces",
            Self::FrictionInCone => "friction_in_cone",
            Self::SlidingDirection => "sliding_direction",
            Self::AboveIce => "above_ice",
            Self::ClosedEndsStay => "closed_ends_stay",
            Self::ClosedEndsRest => "closed_ends_rest",
            Self::ForcesContinuous => "forces_continuous",
            Self::NoJump => "no_jump",
            Self::VelocitiesNeedImpacts => "velocities_need_impacts",
            Self::FiniteRates => "finite_rates",
        }
    }

    /// Unit of the amount by which it is broken.
    pub fn unit(self) -> &'static str {
        match self {
            Self::FrictionDissipates | Self::ImpactsDissipate | Self::EnergyBalance => "J",
            Self::NormalForces | Self::FrictionInCone | Self::ForcesContinuous => "N",
            Self::MomentumInFlight | Self::SlidingDirection | Self::VelocitiesNeedImpacts => "m/s",
            Self::AboveIce | Self::NoJump => "m",
            Self::ClosedEndsStay => "m or rad",
            Self::ClosedEndsRest => "m/s or rad/s",
            Self::FiniteRates => "rad/s",
        }
    }
}

/// One breach of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// [s]
    pub t: f64,
    /// In the law's unit.
    pub amount: f64,
    /// Contact mode at the time.
    pub mode: ContactMode,
    /// The event in which it happens; None within a time step.
    pub event: Option<&'static str>,
}

/// How a motion has kept a law.
#[derive(Debug, Clone, PartialEq)]
pub struct LawRecord {
    pub law: Law,
    /// Amount that counts as rounding and truncation, in the law's unit; infinite if the accuracy does not keep the law.
    pub limit: f64,
    /// Largest amount so far, also below the limit.
    pub largest: f64,
    /// Number of breaches.
    pub count: u64,
    /// The first of them, at most `FIRST`.
    pub first: Vec<Violation>,
}

/// Maximum number of breaches of a law that are kept.
pub const FIRST: usize = 8;

impl Simulation {
    /// Check the laws from now on, or no longer. What was found is forgotten. A copy of the simulation is checked, too.
    pub fn check(&mut self, on: bool) {
        let checker = on.then(|| LawChecker::new(&self.model));
        self.observer = checker.into();
    }

    /// How the motion has kept each law since `check`; empty without it.
    pub fn law_records(&self) -> &[LawRecord] {
        let checker = self.observer.get::<LawChecker>();
        checker.map_or(&[], LawChecker::records)
    }

    /// The laws that the motion has broken since `check`.
    pub fn broken_laws(&self) -> impl Iterator<Item = &LawRecord> {
        self.law_records().iter().filter(|record| record.count > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_in_the_order_of_indices_and_names_differ() {
        for (i, law) in Law::ALL.into_iter().enumerate() {
            assert_eq!(law as usize, i);
            let same = Law::ALL.iter().filter(|other| other.name() == law.name());
            assert_eq!(same.count(), 1);
        }
    }
}
