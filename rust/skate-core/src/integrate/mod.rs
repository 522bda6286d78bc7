//! Time integration of an ordinary differential equation; the methods access it through `System`.

pub mod dop853;
pub mod dopri5;
pub mod rk4;
pub mod rosenbrock;
mod step;

pub use step::{Size, Start, Stiffness, TimeStep};

use crate::{
    error::Termination,
    numeric::{elementary, scalar::Scalar},
};
use serde::{Deserialize, Serialize};

/// Length of the first step after a jump of the torques, over the tolerance to the power 1 / order, and at most [s]. It
/// excites fast motions, with rates of 1,500 1/s and more; steps of 3 ms would be rejected.
const STEP_AFTER_JUMP: f64 = 5e-3;
const MAX_STEP_AFTER_JUMP: f64 = 2.5e-3;
/// Length of the first step after an event, which excites them less, at least [s].
const STEP_AFTER_EVENT: f64 = 1e-3;

/// How a motion is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum Method {
    /// Explicit, order 8.
    Dop853(Control),
    /// Explicit, order 5.
    Dopri5(Control),
    /// Explicit, order 4.
    Rk4(Fixed),
    /// Linearly implicit, order 3.
    Rosenbrock(Control),
}

/// Control of the step length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Control {
    Error(ErrorControl),
    Fixed(Fixed),
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorControl {
    /// Relative tolerance of the local error of each step.
    pub tolerance: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    /// Step length [s]. A step that reaches an event or a requested time is shorter.
    pub step: f64,
}

impl Method {
    /// Dormand-Prince of order 8 with error control.
    pub const fn dop853(tolerance: f64) -> Self {
        Self::Dop853(Control::Error(ErrorControl { tolerance }))
    }

    /// Dormand-Prince of order 5 with error control.
    pub const fn dopri5(tolerance: f64) -> Self {
        Self::Dopri5(Control::Error(ErrorControl { tolerance }))
    }

    /// Linearly implicit, order 3, with error control.
    pub const fn rosenbrock(tolerance: f64) -> Self {
        Self::Rosenbrock(Control::Error(ErrorControl { tolerance }))
    }

    /// Does the dense output take evaluations of its own?
    pub fn dense_output_evaluates(self) -> bool {
        matches!(self, Self::Dop853(_))
    }

    fn control(self) -> Control {
        match self {
            Self::Dop853(control) | Self::Dopri5(control) | Self::Rosenbrock(control) => control,
            Self::Rk4(fixed) => Control::Fixed(fixed),
        }
    }

    /// Step length [s], if it is fixed.
    pub fn step(self) -> Option<f64> {
        match self.control() {
            Control::Fixed(fixed) => Some(fixed.step),
            Control::Error(_) => None,
        }
    }

    /// Relative tolerance of a step, if its error is controlled.
    pub fn tolerance(self) -> Option<f64> {
        match self.control() {
            Control::Error(control) => Some(control.tolerance),
            Control::Fixed(_) => None,
        }
    }

    /// Does it call `System::factor`?
    pub fn is_implicit(self) -> bool {
        matches!(self, Self::Rosenbrock(_))
    }

    fn order(self) -> f64 {
        match self {
            Self::Dop853(_) => 8.0,
            Self::Dopri5(_) => 5.0,
            Self::Rk4(_) => 4.0,
            Self::Rosenbrock(_) => 3.0,
        }
    }

    /// Maximum length of the first step after a jump of the torques [s]; infinite if steps have a fixed length.
    pub fn max_step_after_jump(self) -> f64 {
        self.tolerance().map_or(f64::INFINITY, |tolerance| {
            let length = STEP_AFTER_JUMP * elementary::pow(tolerance, 1.0 / self.order());
            length.min(MAX_STEP_AFTER_JUMP)
        })
    }

    /// Maximum length of the first step after an event [s]; infinite if steps have a fixed length.
    pub fn max_step_after_event(self) -> f64 {
        self.max_step_after_jump().max(STEP_AFTER_EVENT)
    }
}

impl<const N: usize> TimeStep<N> {
    /// Advance by `h` from `start`. If the method is implicit, the last evaluation before the call must be at the
    /// start. The last evaluation of the call is at the end of the step.
    ///
    /// # Errors
    /// Those of the system.
    pub fn attempt(
        &mut self,
        method: Method,
        system: &mut impl System<N>,
        start: Start<'_, N>,
        h: f64,
    ) -> Result<(), Termination> {
        match method {
            Method::Rosenbrock(_) => self.rosenbrock(system, start, h),
            explicit => self.attempt_explicit(explicit, system, start, h),
        }
    }

    /// Local error as a multiple of the tolerance; 0 if the step length is fixed.
    pub fn error(&mut self, method: Method) -> f64 {
        self.stiffness = Stiffness::default();
        let Some(tolerance) = method.tolerance() else {
            return 0.0;
        };
        match method {
            Method::Dop853(_) => {
                self.stiffness = self.dop853_stiffness();
                dop853::error(self.dop853_squares(tolerance), self.stiffness, tolerance)
            }
            Method::Dopri5(_) => self.dopri5_error(tolerance),
            Method::Rosenbrock(_) => self.rosenbrock_error(tolerance),
            Method::Rk4(_) => 0.0,
        }
    }

    /// Factor on the step length after a step of this error (1 = tolerance): safety factor 0.9, limits 0.2 and 5, and
    /// that of stability.
    pub fn factor(&self, method: Method, error: f64) -> f64 {
        let by_error = 0.9 * elementary::pow(error.max(1e-10), -1.0 / method.order());
        by_error.clamp(0.2, 5.0).min(self.stiffness.factor())
    }
}

impl<const N: usize, T: Scalar> TimeStep<N, T> {
    /// `attempt` for the explicit methods; an implicit one is refused with `NotFinite`.
    ///
    /// # Errors
    /// Those of the system.
    #[inline(always)]
    pub fn attempt_explicit(
        &mut self,
        method: Method,
        system: &mut impl System<N, T>,
        start: Start<'_, N, T>,
        h: T,
    ) -> Result<(), Termination> {
        match method {
            Method::Dop853(_) => self.dop853(system, start, h),
            Method::Dopri5(_) => self.dopri5(system, start, h),
            Method::Rk4(_) => self.rk4(system, start, h),
            Method::Rosenbrock(_) => Err(Termination::NotFinite),
        }
    }

    /// Prepare the method's dense output, `at`.
    ///
    /// # Errors
    /// Those of the system.
    #[inline(always)]
    pub fn make_dense(
        &mut self,
        method: Method,
        system: &mut impl System<N, T>,
    ) -> Result<(), Termination> {
        match method {
            Method::Dop853(_) => self.dop853_dense(system)?,
            Method::Dopri5(_) => self.dopri5_dense(),
            Method::Rk4(_) | Method::Rosenbrock(_) => self.cubic(0..self.live()),
        }
        self.is_dense = true;
        Ok(())
    }
}

/// Smooth motion between events, dy/dt = f(t, y) on at most `N` components.
pub trait System<const N: usize, T = f64> {
    /// dy := f(t, y).
    ///
    /// # Errors
    /// The right-hand side does not exist at (t, y).
    fn rhs(&mut self, t: T, y: &[T; N], dy: &mut [T; N]) -> Result<(), Termination>;

    /// Factorise the matrix I - g A for `solve`. A approximates the stiff part of df/dy at `y`, the state of the
    /// last call of `rhs`. Explicit methods do not call it.
    ///
    /// # Errors
    /// The matrix is singular.
    fn factor(&mut self, _y: &[T; N], _g: T) -> Result<(), Termination> {
        Err(Termination::Singular)
    }

    /// x := (I - g A)^-1 x.
    ///
    /// # Errors
    /// As for `factor`.
    fn solve(&mut self, _x: &mut [T; N]) -> Result<(), Termination> {
        Err(Termination::Singular)
    }
}
