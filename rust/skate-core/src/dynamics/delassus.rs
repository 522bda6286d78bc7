//! Factorisation of M (or M + g D) and the operational-space quantities of the contacts: S, G, W (the
//! Delassus matrix of the free foot), b and alpha0.

use crate::{
    contact::equations::{ContactProblem, Slip},
    dynamics::{
        aba::{ArticulatedBodies, Forces, ImplicitTerms},
        kinematics::{Kinematics, PlanarPoint},
    },
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, SoleContact},
        lanes::ModelLanes,
        layout::{LEG, NV, ROOT},
    },
    numeric::{scalar::Scalar, vec3},
};
use nalgebra::{Matrix3, Vector3};

/// Factored dynamics with the contact problem built on it.
#[derive(Debug, Clone, Default)]
pub struct FactoredDynamics<T: Scalar = f64> {
    pub tree: ArticulatedBodies<T>,
    /// `factor` sets S, G and W; `set_loads` sets b and alpha0.
    pub problem: ContactProblem<T>,
    /// Constrained directions of the free foot (y, z, rotation): the first `rows` of them.
    rows: usize,
    /// Their reduced columns.
    columns: [[T; LEG]; 3],
    /// Whether `add_stiffness` has been called.
    has_feedback: bool,
    feedback: HeadFeedback<T>,
}

/// Linear forces -kappa J x on the motion x, eliminated by the Woodbury identity.
#[derive(Debug, Clone, Default)]
struct HeadFeedback<T: Scalar> {
    /// J^T reduced along the tree, and B, its root part. Coordinates outside `Model::head_path` have zero
    /// entries.
    columns: [[T; NV]; 3],
    B: Matrix3<T>,
    /// `w`: motion of the free foot's contact point per unit force. The force is -N times the motion.
    w: Matrix3<T>,
    N: Matrix3<T>,
    /// J times the motion that the loads cause with the root fixed.
    root_held: Vector3<T>,
}

/// Number of directions that the free foot's contact constrains: y, z and, for a flat foot, rotation.
pub fn rows(free: SoleContact) -> usize {
    match free {
        SoleContact::Air => 0,
        SoleContact::Heel | SoleContact::Toe => 2,
        SoleContact::Flat => 3,
    }
}

impl<T: Scalar> FactoredDynamics<T> {
    /// Factor M, or with `implicit` the matrix of an implicit step, and set S. For a free foot in contact at `point`
    /// with `rows` constrained directions, also set G and W.
    #[inline(always)]
    pub fn factor(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        rows: usize,
        point: PlanarPoint<T>,
        implicit: Option<ImplicitTerms<'_, T>>,
    ) {
        self.has_feedback = false;
        self.rows = rows.min(3);
        self.tree.factor(models, kin, implicit);
        self.problem.S = self.tree.root();
        if rows == 0 {
            return;
        }
        let columns = &mut self.columns[..self.rows];
        self.tree.reduce_unit_forces([point.y, point.z], columns);
        let (mut G, mut W) = (vec3::zeros(), vec3::zeros());
        for i in 0..self.rows {
            for j in 0..3 {
                G[(i, j)] = self.columns[i][j];
            }
            for j in 0..=i {
                let mut sum = T::of(-0.0);
                for c in ROOT..LEG {
                    sum += self.columns[i][c] * self.columns[j][c] * self.tree.inverse_d(c);
                }
                W[(i, j)] = sum;
                W[(j, i)] = sum;
            }
        }
        (self.problem.G, self.problem.W) = (G, W);
    }

    /// Number of constrained directions of the free foot.
    #[inline(always)]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Add forces -kappa J x on the motion x. The rows of `J` are the torques of unit forces and are
    /// nonzero on `Model::head_path` only. M becomes M + J^T kappa J. Returns false where this matrix is
    /// singular, which cannot occur for positive `kappa`.
    #[inline(always)]
    pub fn add_stiffness(
        &mut self,
        models: impl ModelLanes<T>,
        J: &[[T; NV]; 3],
        kappa: Vector3<T>,
    ) -> T::Mask {
        let model = models.shape();
        let feedback = &mut self.feedback;
        let (mut B, mut W, mut w) = (vec3::zeros(), vec3::zeros(), vec3::zeros());
        for i in 0..3 {
            let column = &mut feedback.columns[i];
            column[..ROOT].copy_from_slice(&J[i][..ROOT]);
            for &c in &model.head_path {
                column[c] = J[i][c];
            }
            self.tree.reduce_on_head_path(models, column);
            for j in 0..3 {
                B[(j, i)] = column[j];
                W[(i, j)] = T::of(-0.0);
                if i < self.rows {
                    w[(i, j)] = T::of(-0.0);
                }
            }
        }
        for &c in &model.head_path {
            let inverse = self.tree.inverse(model, c);
            for j in 0..3 {
                let compliance = feedback.columns[j][c] * inverse;
                for i in 0..3 {
                    W[(i, j)] += feedback.columns[i][c] * compliance;
                }
                // The leg on the path to the head.
                if c < ROOT + 3 {
                    for i in 0..self.rows {
                        w[(i, j)] += self.columns[i][c] * compliance;
                    }
                }
            }
        }
        let zero = T::zero();
        let diagonal = Matrix3::new(
            kappa.x, zero, zero, zero, kappa.y, zero, zero, zero, kappa.z,
        );
        let mut I_plus_KW = vec3::product(&diagonal, &W);
        for i in 0..3 {
            I_plus_KW[(i, i)] = T::one() + I_plus_KW[(i, i)];
        }
        let (N, regular) = inverse(&I_plus_KW);
        let N = vec3::product(&N, &diagonal);
        let problem = &mut self.problem;
        let BN = vec3::product(&B, &N);
        vec3::add_assign(&mut problem.S, &vec3::product_transposed(&BN, &B));
        if self.rows > 0 {
            let wN = vec3::product(&w, &N);
            vec3::sub_assign(&mut problem.G, &vec3::product_transposed(&wN, &B));
            vec3::sub_assign(&mut problem.W, &vec3::product_transposed(&wN, &w));
        }
        (feedback.B, feedback.w, feedback.N) = (B, w, N);
        feedback.root_held = vec3::zero();
        self.has_feedback = true;
        regular
    }

    /// Set b and alpha0 from reduced forces, and from the acceleration of the free foot's contact point
    /// without them.
    #[inline(always)]
    pub fn set_loads(&mut self, model: &Model, reduced: &[T; NV], point: Vector3<T>) {
        self.problem.b = Vector3::new(reduced[0], reduced[1], reduced[2]);
        if self.rows > 0 {
            self.problem.alpha0 = point;
            for i in 0..self.rows {
                for c in ROOT..LEG {
                    self.problem.alpha0[i] +=
                        self.columns[i][c] * self.tree.inverse_d(c) * reduced[c];
                }
            }
        }
        if self.has_feedback {
            let feedback = &mut self.feedback;
            let none = T::of(-0.0);
            let mut root_held = Vector3::new(none, none, none);
            for &c in &model.head_path {
                let compliance = reduced[c] * self.tree.inverse(model, c);
                for i in 0..3 {
                    root_held[i] += feedback.columns[i][c] * compliance;
                }
            }
            feedback.root_held = root_held;
            let force = vec3::apply(&feedback.N, &feedback.root_held);
            let problem = &mut self.problem;
            problem.b = vec3::sub(&problem.b, &vec3::apply(&feedback.B, &force));
            problem.alpha0 = vec3::sub(&problem.alpha0, &vec3::apply(&feedback.w, &force));
        }
    }

    /// Clear the loads, so that back-substitution gives the response to the root's motion and to impulses
    /// alone.
    #[inline(always)]
    pub fn clear_loads(&mut self) {
        self.feedback.root_held = vec3::zero();
    }

    /// Back-substitution: `x` holds the reduced joint forces on entry and the motion of all coordinates on
    /// return.
    #[inline(always)]
    pub fn back_substitute(
        &mut self,
        models: impl ModelLanes<T>,
        (root, lam): (&Vector3<T>, &Vector3<T>),
        x: &mut [T; NV],
    ) {
        if self.has_feedback {
            let feedback = &self.feedback;
            let from_root = vec3::apply_transposed(&feedback.B, root);
            let moved = vec3::add(&from_root, &vec3::apply_transposed(&feedback.w, lam));
            let force = vec3::apply(&feedback.N, &vec3::add(&moved, &feedback.root_held));
            for i in 0..3 {
                for &c in &models.shape().head_path {
                    x[c] -= feedback.columns[i][c] * force[i];
                }
            }
        }
        for i in 0..ROOT {
            x[i] = root[i];
        }
        for i in 0..self.rows {
            for c in ROOT..LEG {
                x[c] += self.columns[i][c] * lam[i];
            }
        }
        self.tree.expand(models, x);
    }
}

impl FactoredDynamics {
    /// Set every lane of `to` to this, without loads.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(&self, model: &Model, to: &mut FactoredDynamics<T>) {
        self.tree.broadcast(model, &mut to.tree);
        to.has_feedback = false;
        to.rows = self.rows;
        for (to, column) in to.columns.iter_mut().zip(&self.columns[..self.rows]) {
            for (to, x) in to.iter_mut().zip(column) {
                *to = T::of(*x);
            }
        }
        let (from, to) = (&self.problem, &mut to.problem);
        to.lever = from.lever.map(T::of);
        for i in 0..3 {
            for j in 0..3 {
                to.S[(i, j)] = T::of(from.S[(i, j)]);
                to.G[(i, j)] = T::of(from.G[(i, j)]);
                to.W[(i, j)] = T::of(from.W[(i, j)]);
            }
        }
    }

    /// Replace generalised forces by the accelerations that they cause in a contact mode, without other
    /// loads.
    pub fn apply_inverse(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        x: &mut [f64; NV],
    ) -> Result<(), Termination> {
        self.tree.reduce(model, &mut Forces::default(), x);
        self.set_loads(model, x, Vector3::zeros());
        let solution = self.problem.solve(mode, slip)?;
        self.back_substitute(model, (&solution.a_root, &solution.lam), x);
        Ok(())
    }
}

/// Inverse by cofactors; false where the determinant is zero.
#[inline(always)]
fn inverse<T: Scalar>(m: &Matrix3<T>) -> (Matrix3<T>, T::Mask) {
    macro_rules! minor {
        ($i:literal, $j:literal, $k:literal, $l:literal) => {
            m[($i, $j)] * m[($k, $l)] - m[($k, $j)] * m[($i, $l)]
        };
    }
    let (a, b, c) = (minor!(1, 1, 2, 2), minor!(1, 0, 2, 2), minor!(1, 0, 2, 1));
    let d = m[(0, 0)] * a - m[(0, 1)] * b + m[(0, 2)] * c;
    let inverse = Matrix3::new(
        a / d,
        (minor!(0, 2, 2, 1)) / d,
        (minor!(0, 1, 1, 2)) / d,
        -b / d,
        (minor!(0, 0, 2, 2)) / d,
        (minor!(0, 2, 1, 0)) / d,
        c / d,
        (minor!(0, 1, 2, 0)) / d,
        (minor!(0, 0, 1, 1)) / d,
    );
    (inverse, !(d.le(T::zero()) & d.ge(T::zero())))
}
