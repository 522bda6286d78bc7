//! Articulated-body algorithm: the joints are eliminated from the leaves to the supporting foot (inward
//! pass), then the accelerations are recovered from there (outward pass; Featherstone 2008, section 7.3).
//!
//! All hinges except the trunk's three rotate about the x axis of their carrier. A limb therefore needs
//! three of the six components: in the frame of the carrier its joints transmit forces along y and z and
//! moments about x only, for any motion of the carrier. The legs are such a chain in world axes about the
//! pivot O; the arms and the head are such chains in the frame of the trunk. Only the trunk's own joints
//! need 6 x 6 matrices; see `aba_trunk`.

use crate::{
    dynamics::{aba_trunk::Trunk, kinematics::Kinematics},
    model::{
        Model,
        lanes::ModelLanes,
        layout::{FREE_FOOT, LEG, NB, NV, ROOT, TRUNK, WAIST, coordinate},
    },
    numeric::{
        planar::{Hinge, Planar, PlanarInertia},
        scalar::Scalar,
        spatial::{LateralInertia, SpatialForce, SpatialInertia},
    },
};
use nalgebra::Matrix3;

/// Bias forces per body: inertial forces for q'' = 0 and gravity.
#[derive(Debug, Clone, Default)]
pub struct Forces<T: Scalar = f64> {
    pub planar: [Planar<T>; NB],
    pub trunk: [SpatialForce<T>; TRUNK],
}

/// What an implicit step adds to the diagonal of M.
#[derive(Debug, Clone, Copy)]
pub struct ImplicitTerms<'a, T = f64> {
    /// Factor of the joint damping D.
    pub g: T,
    /// Slopes of the stabilizers at the leg joints; zero at the others.
    pub legs: &'a [T; NV],
}

/// Factorisation of M.
#[derive(Debug, Clone, Default)]
pub struct ArticulatedBodies<T: Scalar = f64> {
    hinges: [Hinge<T>; NB],
    trunk: Trunk<T>,
    root: PlanarInertia<T>,
    /// Workspace for the planar bodies.
    inertia: [PlanarInertia<T>; NB],
    motion: [Planar<T>; NB],
}

impl<T: Scalar> ArticulatedBodies<T> {
    /// Factor M, or with `implicit` the matrix of an implicit step, by eliminating all joints. Needs
    /// `Kinematics::frames`.
    #[inline(always)]
    pub fn factor(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        implicit: Option<ImplicitTerms<'_, T>>,
    ) {
        match implicit {
            None => self.eliminate(models, kin, |_| T::zero(), &[T::zero(); NV]),
            Some(ImplicitTerms { g, legs }) => {
                let damping = |c: usize| g * models.number(|m| m.damping[c]);
                self.eliminate(models, kin, damping, legs);
            }
        }
    }

    /// `own(c)`, and `legs[c]` for the planar bodies, is added to the diagonal of M at coordinate `c`.
    #[inline(always)]
    fn eliminate(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        own: impl Fn(usize) -> T,
        legs: &[T; NV],
    ) {
        let inertia = &mut self.inertia;
        let model = models.shape();
        let n_planar = model.n_planar.min(NB);
        for b in 0..n_planar {
            let body = models.body(b);
            inertia[b] = PlanarInertia::rigid(body.mass, kin.c[b], body.across);
        }
        if let Some(carrier) = model.carrier {
            let mut carried = SpatialInertia::default();
            let (mut lateral, mut outer) = (LateralInertia::default(), PlanarInertia::default());
            for &b in &model.limbs {
                let body = models.body(b);
                lateral.add(
                    body.mass,
                    [body.across, body.along],
                    kin.c[b],
                    kin.sin_cos[b],
                );
                outer += PlanarInertia::rigid(body.mass, kin.c[b], body.across);
                (self.hinges[b], outer) = outer.eliminate(kin.joint[b], own(coordinate(b)));
                if model.parent[b] == carrier {
                    carried.add_limb(&outer, &lateral, body.side);
                    (lateral, outer) = (LateralInertia::default(), PlanarInertia::default());
                }
            }
            inertia[model.parent[n_planar]] += self.trunk.factor(models, kin, &own, carried);
        }
        // Inertia passed from the previous body, kept in registers as in `Kinematics::frames`.
        let mut last = PlanarInertia::default();
        for b in (1..n_planar).rev() {
            let mut body = inertia[b];
            body += last;
            let c = coordinate(b);
            (self.hinges[b], last) = body.eliminate(kin.joint[b], own(c) + legs[c]);
            if model.parent[b] + 1 != b {
                inertia[model.parent[b]] += last;
                last = PlanarInertia::default();
            }
        }
        self.root = inertia[0];
        self.root += last;
        self.root.yy += own(0);
        self.root.nn += own(coordinate(0));
    }

    /// Articulated inertia of the whole robot at O, order y0, z0, q1.
    #[inline(always)]
    pub fn root(&self) -> Matrix3<T> {
        let r = &self.root;
        Matrix3::new(r.yy, r.yz, r.yn, r.yz, r.zz, r.zn, r.yn, r.zn, r.nn)
    }

    /// 1 / D of a leg joint.
    #[inline(always)]
    pub fn inverse_d(&self, c: usize) -> T {
        self.hinges[c - 2].inverse
    }

    /// 1 / D of any joint.
    #[inline(always)]
    pub fn inverse(&self, model: &Model, c: usize) -> T {
        let b = c - 2;
        match model.carrier {
            Some(carrier) if (model.n_planar..=carrier).contains(&b) => {
                self.trunk.inverse(b - model.n_planar)
            }
            _ => self.hinges[b].inverse,
        }
    }

    /// Inward pass: carry generalised forces `x` and the forces on the bodies to the root. On return `x`
    /// holds the reduced joint torques and the force on S at the root.
    #[inline(always)]
    pub fn reduce(&self, models: impl ModelLanes<T>, forces: &mut Forces<T>, x: &mut [T; NV]) {
        let model = models.shape();
        let side = |b: usize| models.number(|m| m.numbers[b].side);
        let n_planar = model.n_planar.min(NB);
        let planar = &mut forces.planar;
        if let Some(carrier) = model.carrier {
            let top = (model.n_trunk - 1).min(TRUNK - 1);
            let mut carried = SpatialForce([T::zero(); 6]);
            let mut outer = Planar::default();
            for &b in &model.limbs {
                outer += planar[b];
                outer = self.hinges[b].reduce(&mut x[coordinate(b)], outer);
                if model.parent[b] == carrier {
                    carried.add_at(side(b), &outer);
                    outer = Planar::default();
                }
            }
            for (sum, force) in forces.trunk[top].0.iter_mut().zip(carried.0) {
                *sum += force;
            }
            planar[model.parent[n_planar]] += self.trunk.reduce(model, &forces.trunk, x);
        }
        let mut last = Planar::default();
        for b in (1..n_planar).rev() {
            let mut own = planar[b];
            own += last;
            last = self.hinges[b].reduce(&mut x[coordinate(b)], own);
            if model.parent[b] + 1 != b {
                planar[model.parent[b]] += last;
                last = Planar::default();
            }
        }
        last += planar[0];
        x[0] -= last.y;
        x[1] -= last.z;
        x[2] -= last.n;
    }

    /// `reduce` without forces on the bodies.
    #[inline(always)]
    pub fn reduce_torques(&self, models: impl ModelLanes<T>, x: &mut [T; NV]) {
        let model = models.shape();
        // The waist carries everything but the legs.
        let mut waist = Planar::default();
        if let Some(carrier) = model.carrier {
            let mut trunk = [SpatialForce([T::zero(); 6]); TRUNK];
            let top = &mut trunk[(model.n_trunk - 1).min(TRUNK - 1)];
            let mut outer = Planar::default();
            for &b in &model.limbs {
                outer = self.hinges[b].reduce(&mut x[coordinate(b)], outer);
                if model.parent[b] == carrier {
                    top.add_at(models.number(|m| m.numbers[b].side), &outer);
                    outer = Planar::default();
                }
            }
            waist = self.trunk.reduce(model, &trunk, x);
        }
        let mut last = Planar::default();
        for b in (1..model.n_planar.min(NB)).rev() {
            if b == WAIST {
                last += waist;
            }
            last = self.hinges[b].reduce(&mut x[coordinate(b)], last);
            if model.parent[b] + 1 != b {
                waist += last;
                last = Planar::default();
            }
        }
        x[0] -= last.y;
        x[1] -= last.z;
        x[2] -= last.n;
    }

    /// `reduce` for torques along the path from the head to the ice through the supporting leg only; the
    /// other joints are unaffected.
    #[inline(always)]
    pub fn reduce_on_head_path(&self, models: impl ModelLanes<T>, x: &mut [T; NV]) {
        let model = models.shape();
        let mut force = Planar::default();
        if let Some(carrier) = model.carrier {
            let mut trunk = [SpatialForce([T::zero(); 6]); TRUNK];
            let (head, _) = model.head;
            if head > carrier {
                let outer = self.hinges[head].reduce(&mut x[coordinate(head)], force);
                let side = models.number(|m| m.numbers[head].side);
                trunk[(model.n_trunk - 1).min(TRUNK - 1)].add_at(side, &outer);
            }
            force = self.trunk.reduce(model, &trunk, x);
        }
        for &c in model.head_path.iter().rev() {
            if c - 2 < model.n_planar {
                force = self.hinges[c - 2].reduce(&mut x[c], force);
            }
        }
        x[0] -= force.y;
        x[1] -= force.z;
        x[2] -= force.n;
    }

    /// Outward pass, in place: from reduced joint torques and the root's acceleration to all accelerations.
    #[inline(always)]
    pub fn expand(&mut self, models: impl ModelLanes<T>, x: &mut [T; NV]) {
        let model = models.shape();
        let n_planar = model.n_planar.min(NB);
        let motion = &mut self.motion;
        let mut last = Planar {
            y: x[0],
            z: x[1],
            n: x[2],
        };
        motion[0] = last;
        for b in 1..n_planar {
            let up = model.parent[b];
            let up = if up + 1 == b { last } else { motion[up] };
            last = self.hinges[b].expand(&mut x[coordinate(b)], up);
            motion[b] = last;
        }
        let Some(carrier) = model.carrier else {
            return;
        };
        let base = motion[model.parent[n_planar]];
        let carried = self.trunk.expand(model, base, x);
        let mut inner = Planar::default();
        for b in carrier + 1..model.bodies.len().min(NB) {
            if model.parent[b] == carrier {
                inner = carried.planar_at(models.number(|m| m.numbers[b].side));
            }
            inner = self.hinges[b].expand(&mut x[coordinate(b)], inner);
        }
    }

    /// `reduce` for unit forces along y and z and a unit couple on the free foot at `point`, one per entry
    /// of `columns`. On return each column holds the reduced joint torques, and in its first three entries
    /// the force on the root.
    #[inline(always)]
    pub fn reduce_unit_forces(&self, point: [T; 2], columns: &mut [[T; LEG]]) {
        let [y, z] = point;
        let (zero, one) = (T::zero(), T::one());
        let unit = [[one, zero, -z], [zero, one, y], [zero, zero, one]];
        for (column, [y, z, n]) in columns.iter_mut().zip(unit) {
            *column = [zero; LEG];
            // An external force has the opposite sign of a bias force.
            let mut force = Planar {
                y: -y,
                z: -z,
                n: -n,
            };
            for c in (ROOT..=coordinate(FREE_FOOT)).rev() {
                force = self.hinges[c - 2].reduce(&mut column[c], force);
            }
            column[0] = -force.y;
            column[1] = -force.z;
            column[2] = -force.n;
        }
    }
}

impl ArticulatedBodies {
    /// Set every lane of the factorisation `to` to this one.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(&self, model: &Model, to: &mut ArticulatedBodies<T>) {
        let bodies = model.bodies.len().min(NB);
        for (to, hinge) in to.hinges[..bodies].iter_mut().zip(&self.hinges) {
            *to = hinge.broadcast();
        }
        self.trunk.broadcast(&mut to.trunk);
    }
}
