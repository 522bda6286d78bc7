//! Amounts that count as rounding and truncation.

use crate::{
    laws::Law,
    model::{Model, scheme::Scheme},
};

/// The limit of a law for a model, in the law's unit; infinite where the scheme does not keep the law.
pub fn limit(law: Law, model: &Model) -> f64 {
    let tolerance = match model.scheme {
        Scheme::EventDriven(methods) => methods.usual.tolerance(),
        Scheme::TimeStepping { step } => return time_stepping(law, model, step),
    };
    // Without error control truncation has no bound.
    let truncation = |per_tolerance: f64| match tolerance {
        Some(tolerance) => per_tolerance * tolerance,
        None => f64::INFINITY,
    };
    match law {
        Law::FrictionDissipates => 1e-6 + truncation(10.0),
        Law::ImpactsDissipate => 1e-6,
        Law::EnergyBalance => 1e-6 + truncation(1e4),
        Law::MomentumInFlight => 1e-9 + truncation(1.0),
        // Ten times what the selection of a mode accepts.
        Law::NormalForces | Law::FrictionInCone => 1e-5 * model.weight(),
        Law::SlidingDirection => 1e-8,
        Law::AboveIce => 1e-9,
        Law::ClosedEndsStay => 1e-9,
        Law::ClosedEndsRest => 1e-8,
        Law::ForcesContinuous => 1e-3 * model.weight(),
        Law::NoJump => 1e-6,
        Law::VelocitiesNeedImpacts => 1e-7,
        Law::FiniteRates => 1e3,
    }
}

/// Time stepping: forces are means over a step of this length, and events are not located in it.
fn time_stepping(law: Law, model: &Model, step: f64) -> f64 {
    match law {
        // A foot that stops within a step counts as stopped with half its velocity.
        Law::FrictionDissipates => 2e3 * step,
        // An end that lands below the ice is lifted.
        Law::ImpactsDissipate => 1e3 * step,
        Law::AboveIce => 2e-2,
        Law::NoJump => 5e-3,
        Law::MomentumInFlight => 1e-3,
        Law::NormalForces | Law::FrictionInCone => 1e-5 * model.weight(),
        Law::SlidingDirection => 1e-3,
        Law::ClosedEndsStay => 1e-9,
        Law::FiniteRates => 1e3,
        // The balance has the method's order, velocities satisfy the constraints at the middle of a step, and events have
        // no instant.
        Law::EnergyBalance | Law::ClosedEndsRest => f64::INFINITY,
        Law::ForcesContinuous | Law::VelocitiesNeedImpacts => f64::INFINITY,
    }
}
