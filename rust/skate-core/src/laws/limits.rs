//! Amounts that count as rounding and truncation.

use crate::{
    integrate::Method,
    laws::Law,
    model::{Model, scheme::Scheme},
};

/// The limit of a law for a model, in the law's unit; infinite where the scheme does not keep the law.
pub fn limit(law: Law, model: &Model) -> f64 {
    let method = match model.scheme {
        Scheme::EventDriven(methods) => methods.usual,
        Scheme::TimeStepping { step } => return time_stepping(law, step),
    };
    // What is not controlled, as the energy balance, is less accurate with a method of lower order. Without error control
    // truncation has no bound.
    let truncation = match (method, method.tolerance()) {
        (Method::Dop853(_), Some(tolerance)) => tolerance,
        (_, Some(tolerance)) => 100.0 * tolerance,
        (_, None) => f64::INFINITY,
    };
    // Forces and velocities at an event come from the dense output.
    let dense = truncation.min(1e-3);
    match law {
        Law::FrictionDissipates => 1e-6 + 10.0 * truncation,
        Law::ImpactsDissipate => 1e-6 + 1e-2 * dense,
        Law::EnergyBalance => 1e-6 + 1e4 * truncation,
        Law::MomentumInFlight => 1e-8 + 20.0 * truncation,
        // More than the selection of a mode accepts.
        Law::NormalForces | Law::FrictionInCone => (1e-5 + 10.0 * dense) * model.weight(),
        Law::SlidingDirection => 1e-8,
        Law::AboveIce => 1e-9,
        Law::ClosedEndsStay => 1e-9,
        Law::ClosedEndsRest | Law::VelocitiesNeedImpacts => 1e-7 + 1e-2 * dense,
        Law::ForcesContinuous => 1e-3 * model.weight(),
        Law::NoJump => 1e-6,
        Law::FiniteRates => 1e3,
    }
}

/// Time stepping: forces are means over a step of this length, and events are not located in it.
fn time_stepping(law: Law, step: f64) -> f64 {
    match law {
        // Positions, and the velocities along which impulses act, have errors of this order.
        Law::FrictionDissipates => 1e-6 + 800.0 * step * step,
        // An end that lands below the ice is lifted.
        Law::ImpactsDissipate => 1e3 * step,
        Law::AboveIce | Law::NoJump => 2e-2,
        Law::MomentumInFlight => 1e-9,
        Law::ClosedEndsStay => 1e-5,
        Law::FiniteRates => 1e3,
        // A step in which contacts have opened keeps its mode, whatever the signs of its forces.
        Law::NormalForces | Law::FrictionInCone | Law::SlidingDirection => f64::INFINITY,
        // The balance has the method's order, velocities satisfy the constraints at the middle of a step, and events have
        // no instant.
        Law::EnergyBalance | Law::ClosedEndsRest => f64::INFINITY,
        Law::ForcesContinuous | Law::VelocitiesNeedImpacts => f64::INFINITY,
    }
}
