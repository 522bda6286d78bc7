//! Variants of a contact problem: moved reference points, unit forces as loads.

use crate::{
    contact::equations::{ContactProblem, PHI, Slip, Z},
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, FREE, SUPPORT},
    },
};
use nalgebra::{Matrix3, Vector3};

impl ContactProblem {
    /// The same problem with the pivot moved by `dy` along a flat supporting foot.
    pub fn with_pivot_moved(&self, dy: f64) -> Self {
        // Motion at the old pivot from the motion at the new one: z decreases by dy times the rotation.
        let mut X = Matrix3::identity();
        X[(Z, PHI)] = -dy;
        Self {
            S: X.transpose() * self.S * X,
            b: X.transpose() * self.b,
            G: self.G * X,
            ..*self
        }
    }

    /// The same problem with the free foot's contact point moved by `dy` along its flat sole.
    pub fn with_free_point_moved(&self, dy: f64) -> Self {
        let mut X = Matrix3::identity();
        X[(Z, PHI)] = dy;
        Self {
            G: X * self.G,
            W: X * self.W * X.transpose(),
            alpha0: X * self.alpha0,
            ..*self
        }
    }

    /// The same problem with a unit force at one foot's contact point, along `component`, as its only load.
    pub fn with_unit_force(&self, which: usize, component: usize) -> Self {
        let mut problem = *self;
        if which == SUPPORT {
            problem.b = Vector3::zeros();
            problem.b[component] = 1.0;
            problem.alpha0 = Vector3::zeros();
        } else {
            problem.b = self.G.row(component).transpose();
            problem.alpha0 = self.W.column(component).into();
        }
        problem
    }

    /// Increase of the normal force on a sliding foot per unit of force that presses the foot onto the ice:
    /// 1 without friction, unbounded near Painleve's paradox, negative beyond it.
    ///
    /// # Errors
    /// As for `solve`.
    pub fn load_gain(
        &self,
        model: &Model,
        mode: ContactMode,
        which: usize,
    ) -> Result<f64, Termination> {
        let mut unpulled = mode;
        unpulled.support.pulled &= which != SUPPORT;
        unpulled.free.pulled &= which != FREE;
        let problem = self.with_unit_force(which, Z);
        let solution = problem.solve(unpulled, Slip::of(model, unpulled))?;
        // The unit force points up, away from the ice.
        Ok(if which == SUPPORT {
            -solution.f_root[Z]
        } else {
            -solution.lam[Z]
        })
    }
}
