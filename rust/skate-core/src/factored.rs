//! M (or M + g D) with its joints eliminated, and what the contacts feel of it.

use crate::{
    articulated::{Articulated, Forces, LEG},
    contact::{ContactProblem, Mode, Slip, Touch},
    error::EndCause,
    kinematics::{Kinematics, PlanarPoint},
    model::{Model, NV, ROOT},
};
use nalgebra::{Matrix3, Vector3};

/// See the module's documentation.
#[derive(Debug, Clone, Default)]
pub struct Factored {
    pub tree: Articulated,
    /// S, G and W; b and alpha0 come with the loads.
    pub problem: ContactProblem,
    /// Reduced columns of the free foot's y, z, rotation, as many as it needs.
    columns: [[f64; LEG]; 3],
}

/// How many of the free foot's y, z, rotation its contact can hold: a point does not keep it from turning.
fn rows(free: Touch) -> usize {
    match free {
        Touch::Air => 0,
        Touch::Heel | Touch::Toe => 2,
        Touch::Flat => 3,
    }
}

impl Factored {
    /// Factor M + g D and set up S, and for a free foot that touches at `point` G and W.
    pub fn factor(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        (free, point): (Touch, PlanarPoint),
        g: f64,
    ) {
        self.tree.factor(model, kin, g);
        self.problem.S = self.tree.root();
        if free == Touch::Air {
            return;
        }
        let columns = &mut self.columns[..rows(free)];
        self.tree.reduce_unit_forces([point.y, point.z], columns);
        let (mut G, mut W) = (Matrix3::zeros(), Matrix3::zeros());
        for i in 0..rows(free) {
            for j in 0..3 {
                G[(i, j)] = self.columns[i][j];
            }
            for j in 0..=i {
                let sum: f64 = (ROOT..LEG)
                    .map(|c| self.columns[i][c] * self.columns[j][c] * self.tree.inverse_d(c))
                    .sum();
                W[(i, j)] = sum;
                W[(j, i)] = sum;
            }
        }
        (self.problem.G, self.problem.W) = (G, W);
    }

    /// Set b and alpha0 from reduced forces, and from what the free foot's point does without any.
    pub fn load(&mut self, free: Touch, reduced: &[f64; NV], point: impl FnOnce() -> Vector3<f64>) {
        self.problem.b = Vector3::new(reduced[0], reduced[1], reduced[2]);
        if free != Touch::Air {
            self.problem.alpha0 = point();
            for i in 0..rows(free) {
                for c in ROOT..LEG {
                    self.problem.alpha0[i] +=
                        self.columns[i][c] * self.tree.inverse_d(c) * reduced[c];
                }
            }
        }
    }

    /// Back-substitution: `x` holds reduced joint forces on entry, motion of all coordinates after.
    pub fn spread(
        &mut self,
        model: &Model,
        free: Touch,
        (root, lam): (&Vector3<f64>, &Vector3<f64>),
        x: &mut [f64; NV],
    ) {
        for i in 0..ROOT {
            x[i] = root[i];
        }
        for i in 0..rows(free) {
            for c in ROOT..LEG {
                x[c] += self.columns[i][c] * lam[i];
            }
        }
        self.tree.expand(model, x);
    }

    /// From generalised forces to the accelerations that they alone cause in a contact mode, in place.
    pub fn respond(
        &mut self,
        model: &Model,
        (mode, slip): (Mode, Slip),
        x: &mut [f64; NV],
    ) -> Result<(), EndCause> {
        let free = mode.free.touch;
        self.tree.reduce(model, &mut Forces::default(), x);
        self.load(free, x, Vector3::zeros);
        let solution = self.problem.solve(mode, slip)?;
        self.spread(model, free, (&solution.a_root, &solution.lam), x);
        Ok(())
    }
}
