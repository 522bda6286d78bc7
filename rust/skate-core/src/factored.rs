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
    springs: Option<Springs>,
}

/// Forces that answer to motion, -kappa J times it, eliminated as well.
#[derive(Debug, Clone)]
struct Springs {
    /// J^T, reduced along the tree; the root's part of it.
    columns: [[f64; NV]; 3],
    B: Matrix3<f64>,
    /// What a unit of force moves at the free foot's point, and -N times what it moves at all is the force.
    w: Matrix3<f64>,
    N: Matrix3<f64>,
    /// J times the motion that loads cause with the root held.
    at_rest: Vector3<f64>,
}

/// How many of the free foot's y, z, rotation its contact can hold: a point does not keep it from turning.
fn rows(free: Touch) -> usize {
    match free {
        Touch::Air => 0,
        Touch::Heel | Touch::Toe => 2,
        Touch::Flat => 3,
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
        self.springs = None;
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

    /// Add forces -kappa J x on the motion x, J given by the torques of unit forces (rows of `J`): M
    /// becomes M + J^T kappa J.
    ///
    /// # Errors
    /// `Singular`, which positive `kappa` cannot be.
    pub fn stiffen(
        &mut self,
        model: &Model,
        free: Touch,
        J: &[[f64; NV]; 3],
        kappa: Vector3<f64>,
    ) -> Result<(), EndCause> {
        let mut columns = *J;
        for column in &mut columns {
            self.tree.reduce(model, &mut Forces::default(), column);
        }
        let B = Matrix3::from_fn(|i, j| columns[j][i]);
        let mut flexible = columns;
        for column in &mut flexible {
            for c in ROOT..model.n.min(NV) {
                column[c] *= self.tree.inverse(model, c);
            }
        }
        let held = ROOT..model.n.min(NV);
        let W = Matrix3::from_fn(|i, j| dot(&columns[i][held.clone()], &flexible[j][held.clone()]));
        let N = (Matrix3::identity() + Matrix3::from_diagonal(&kappa) * W).try_inverse();
        let N = N.ok_or(EndCause::Singular)? * Matrix3::from_diagonal(&kappa);
        let mut w = Matrix3::zeros();
        for i in 0..rows(free) {
            for j in 0..3 {
                w[(i, j)] = dot(&self.columns[i][ROOT..], &flexible[j][ROOT..LEG]);
            }
        }
        let problem = &mut self.problem;
        problem.S += B * N * B.transpose();
        if free != Touch::Air {
            problem.G -= w * N * B.transpose();
            problem.W -= w * N * w.transpose();
        }
        self.springs = Some(Springs {
            columns,
            B,
            w,
            N,
            at_rest: Vector3::zeros(),
        });
        Ok(())
    }

    /// Set b and alpha0 from reduced forces, and from what the free foot's point does without any.
    pub fn load(
        &mut self,
        model: &Model,
        free: Touch,
        reduced: &[f64; NV],
        point: impl FnOnce() -> Vector3<f64>,
    ) {
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
        if let Some(springs) = &mut self.springs {
            let mut flexible = *reduced;
            for c in ROOT..model.n.min(NV) {
                flexible[c] *= self.tree.inverse(model, c);
            }
            let held = ROOT..model.n.min(NV);
            springs.at_rest = Vector3::from_fn(|i, _| {
                dot(&springs.columns[i][held.clone()], &flexible[held.clone()])
            });
            let force = springs.N * springs.at_rest;
            self.problem.b -= springs.B * force;
            self.problem.alpha0 -= springs.w * force;
        }
    }

    /// Take all loads away: what moves afterwards answers to the root's motion and to impulses alone.
    pub fn unload(&mut self) {
        if let Some(springs) = &mut self.springs {
            springs.at_rest = Vector3::zeros();
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
        if let Some(springs) = &self.springs {
            let moved = springs.B.transpose() * root + springs.w.transpose() * lam;
            let force = springs.N * (moved + springs.at_rest);
            for (column, force) in springs.columns.iter().zip(&force) {
                for c in ROOT..model.n.min(NV) {
                    x[c] -= column[c] * force;
                }
            }
        }
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
        self.load(model, free, x, Vector3::zeros);
        let solution = self.problem.solve(mode, slip)?;
        self.spread(model, free, (&solution.a_root, &solution.lam), x);
        Ok(())
    }
}
