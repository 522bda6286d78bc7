//! M (or M + g D) with its joints eliminated, and what the contacts feel of it.

use crate::{
    contact::equations::{ContactProblem, Slip},
    dynamics::{
        aba::{ArticulatedBodies, Forces},
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

/// See the module's documentation.
#[derive(Debug, Clone, Default)]
pub struct Factored<T: Scalar = f64> {
    pub tree: ArticulatedBodies<T>,
    /// S, G and W; b and alpha0 come with the loads.
    pub problem: ContactProblem<T>,
    /// How many of the free foot's y, z, rotation its contact can hold.
    rows: usize,
    /// Their reduced columns.
    columns: [[T; LEG]; 3],
    /// Whether there are springs.
    sprung: bool,
    springs: Springs<T>,
}

/// Forces that answer to motion, -kappa J times it, eliminated as well.
#[derive(Debug, Clone)]
struct Springs<T: Scalar> {
    /// J^T, reduced along the tree; the root's part of it. Other coordinates than `Model::head_path` do
    /// not feel them.
    columns: [[T; NV]; 3],
    B: Matrix3<T>,
    /// What a unit of force moves at the free foot's point, and -N times what it moves at all is the force.
    w: Matrix3<T>,
    N: Matrix3<T>,
    /// J times the motion that loads cause with the root held.
    at_rest: Vector3<T>,
}

impl<T: Scalar> Default for Springs<T> {
    fn default() -> Self {
        Self {
            columns: [[T::zero(); NV]; 3],
            B: vec3::zeros(),
            w: vec3::zeros(),
            N: vec3::zeros(),
            at_rest: vec3::zero(),
        }
    }
}

/// How many of the free foot's y, z, rotation its contact can hold: a point does not keep it from turning.
pub fn rows(free: SoleContact) -> usize {
    match free {
        SoleContact::Air => 0,
        SoleContact::Heel | SoleContact::Toe => 2,
        SoleContact::Flat => 3,
    }
}

impl<T: Scalar> Factored<T> {
    /// Factor M + g D (None: M) and set up S, and for a free foot that touches at `point`, `rows` of whose
    /// motion can be held, G and W.
    #[inline(always)]
    pub fn factor(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        (rows, point): (usize, PlanarPoint<T>),
        g: Option<T>,
    ) {
        self.sprung = false;
        self.rows = rows.min(3);
        self.tree.factor(models, kin, g);
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

    /// How many of the free foot's y, z, rotation its contact can hold.
    #[inline(always)]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Add forces -kappa J x on the motion x, J given by the torques of unit forces (rows of `J`), which
    /// only the coordinates of `Model::head_path` feel: M becomes M + J^T kappa J. False where that has no
    /// inverse, which positive `kappa` cannot make.
    #[inline(always)]
    pub fn stiffen(
        &mut self,
        models: impl ModelLanes<T>,
        J: &[[T; NV]; 3],
        kappa: Vector3<T>,
    ) -> T::Mask {
        let model = models.shape();
        let springs = &mut self.springs;
        let (mut B, mut W, mut w) = (vec3::zeros(), vec3::zeros(), vec3::zeros());
        for i in 0..3 {
            let column = &mut springs.columns[i];
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
                let flexible = springs.columns[j][c] * inverse;
                for i in 0..3 {
                    W[(i, j)] += springs.columns[i][c] * flexible;
                }
                // The leg that carries the head.
                if c < ROOT + 3 {
                    for i in 0..self.rows {
                        w[(i, j)] += self.columns[i][c] * flexible;
                    }
                }
            }
        }
        let zero = T::zero();
        let diagonal = Matrix3::new(
            kappa.x, zero, zero, zero, kappa.y, zero, zero, zero, kappa.z,
        );
        let mut stiff = vec3::product(&diagonal, &W);
        for i in 0..3 {
            stiff[(i, i)] = T::one() + stiff[(i, i)];
        }
        let (N, regular) = inverse(&stiff);
        let N = vec3::product(&N, &diagonal);
        let problem = &mut self.problem;
        let BN = vec3::product(&B, &N);
        vec3::add_assign(&mut problem.S, &vec3::product_transposed(&BN, &B));
        if self.rows > 0 {
            let wN = vec3::product(&w, &N);
            vec3::sub_assign(&mut problem.G, &vec3::product_transposed(&wN, &B));
            vec3::sub_assign(&mut problem.W, &vec3::product_transposed(&wN, &w));
        }
        (springs.B, springs.w, springs.N) = (B, w, N);
        springs.at_rest = vec3::zero();
        self.sprung = true;
        regular
    }

    /// Set b and alpha0 from reduced forces, and from what the free foot's point does without any.
    #[inline(always)]
    pub fn load(&mut self, model: &Model, reduced: &[T; NV], point: Vector3<T>) {
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
        if self.sprung {
            let springs = &mut self.springs;
            let none = T::of(-0.0);
            let mut at_rest = Vector3::new(none, none, none);
            for &c in &model.head_path {
                let flexible = reduced[c] * self.tree.inverse(model, c);
                for i in 0..3 {
                    at_rest[i] += springs.columns[i][c] * flexible;
                }
            }
            springs.at_rest = at_rest;
            let force = vec3::apply(&springs.N, &springs.at_rest);
            let problem = &mut self.problem;
            problem.b = vec3::sub(&problem.b, &vec3::apply(&springs.B, &force));
            problem.alpha0 = vec3::sub(&problem.alpha0, &vec3::apply(&springs.w, &force));
        }
    }

    /// Take all loads away: what moves afterwards answers to the root's motion and to impulses alone.
    #[inline(always)]
    pub fn unload(&mut self) {
        self.springs.at_rest = vec3::zero();
    }

    /// Back-substitution: `x` holds reduced joint forces on entry, motion of all coordinates after.
    #[inline(always)]
    pub fn spread(
        &mut self,
        models: impl ModelLanes<T>,
        (root, lam): (&Vector3<T>, &Vector3<T>),
        x: &mut [T; NV],
    ) {
        if self.sprung {
            let springs = &self.springs;
            let from_root = vec3::apply_transposed(&springs.B, root);
            let moved = vec3::add(&from_root, &vec3::apply_transposed(&springs.w, lam));
            let force = vec3::apply(&springs.N, &vec3::add(&moved, &springs.at_rest));
            for i in 0..3 {
                for &c in &models.shape().head_path {
                    x[c] -= springs.columns[i][c] * force[i];
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

impl Factored {
    /// From generalised forces to the accelerations that they alone cause in a contact mode, in place.
    pub fn respond(
        &mut self,
        model: &Model,
        (mode, slip): (ContactMode, Slip),
        x: &mut [f64; NV],
    ) -> Result<(), Termination> {
        self.tree.reduce(model, &mut Forces::default(), x);
        self.load(model, x, Vector3::zeros());
        let solution = self.problem.solve(mode, slip)?;
        self.spread(model, (&solution.a_root, &solution.lam), x);
        Ok(())
    }
}

/// By cofactors; false where the determinant is zero.
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
