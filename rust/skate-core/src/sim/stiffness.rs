//! The method of the next step. Where stability bounds the steps of the explicit method, `balanced`, `reference` and
//! tolerances continue with a linearly implicit one until the contact mode changes.

use crate::{error::Termination, integrate::Method, numeric::elementary, sim::Simulation};

/// Rate from which on a motion is stiff, times the cube root of the implicit method's tolerance [1/s]. Damped motions
/// with that rate take a quarter of the explicit method's time. At a lower rate more springs would count as stiff, whose
/// oscillations the implicit method, of order 3, resolves at a higher cost.
const STIFF: f64 = 350.0;
/// Least product h rho of a step whose length may be bounded by stability.
const BOUNDED: f64 = 2.5;

impl Simulation {
    /// The method of the next step between events.
    pub(crate) fn method(&self) -> Method {
        self.model.scheme.methods().of(self.state.is_stiff)
    }

    /// Continue after a whole step of the length `h`, with the implicit method if the motion is stiff.
    pub(super) fn detect_stiffness(&mut self, method: Method, h: f64) -> Result<(), Termination> {
        let h_rho_squared = self.step.stiffness.h_rho_squared;
        if method.is_implicit() || h_rho_squared < BOUNDED * BOUNDED {
            return Ok(());
        }
        let stiff = self.model.scheme.methods().stiff;
        let Some(tolerance) = stiff.and_then(Method::tolerance) else {
            return Ok(());
        };
        let rate = STIFF * elementary::pow(tolerance, -1.0 / 3.0);
        self.state.is_stiff = h_rho_squared.sqrt() > h * rate;
        // The implicit method takes its matrix from the last evaluation, which must be at the present state.
        if self.state.is_stiff {
            self.complete_evaluation()?;
            self.begin_mode()?;
        }
        Ok(())
    }
}
