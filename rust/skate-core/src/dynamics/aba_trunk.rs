//! Articulated-body algorithm for the trunk's joints q8, q9, q10, in body frames. The joint axis is a
//! coordinate axis, so that U is a column of the articulated inertia (Featherstone 2008, section 7.3 and
//! appendix A).

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        lanes::ModelLanes,
        layout::{NV, TRUNK, coordinate},
        rigid_body::Axis,
    },
    numeric::{
        planar::{Planar, PlanarInertia},
        scalar::Scalar,
        spatial::{Spatial, SpatialForce, SpatialInertia, SpatialMotion, at},
    },
};

/// Transform between a body and its parent: rotation about the axis `A`, translation by `l` along z.
/// `to_parent` maps components from the body frame to the parent frame, `to_child` the reverse.
#[derive(Debug, Clone, Copy, Default)]
struct Frame<T> {
    s: T,
    c: T,
    l: T,
}

/// The two axes that a rotation about `A` affects: the first turns towards the second.
const fn rotated_axes(axis: usize) -> (usize, usize) {
    ((axis + 1) % 3, (axis + 2) % 3)
}

impl<T: Scalar> Frame<T> {
    #[inline(always)]
    fn of(models: impl ModelLanes<T>, kin: &Kinematics<T>, b: usize) -> Self {
        let (s, c) = kin.sin_cos[b];
        let l = models.number(|m| m.numbers[b].above);
        Self { s, c, l }
    }

    #[inline(always)]
    fn to_parent<const A: usize>(self, v: &mut [T]) {
        let (j, k) = rotated_axes(A);
        (v[j], v[k]) = (self.c * v[j] - self.s * v[k], self.s * v[j] + self.c * v[k]);
    }

    #[inline(always)]
    fn to_child<const A: usize>(self, v: &mut [T]) {
        let (j, k) = rotated_axes(A);
        (v[j], v[k]) = (self.c * v[j] + self.s * v[k], self.c * v[k] - self.s * v[j]);
    }

    #[inline(always)]
    fn force_to_parent<const A: usize>(self, f: &mut Spatial<T>) {
        self.to_parent::<A>(&mut f[..3]);
        self.to_parent::<A>(&mut f[3..]);
        f[0] -= self.l * f[4];
        f[1] += self.l * f[3];
    }

    #[inline(always)]
    fn motion_to_child<const A: usize>(self, m: &mut Spatial<T>) {
        m[3] += self.l * m[1];
        m[4] -= self.l * m[0];
        self.to_child::<A>(&mut m[..3]);
        self.to_child::<A>(&mut m[3..]);
    }

    /// R B R^T of a symmetric block.
    #[inline(always)]
    fn block_to_parent<const A: usize>(self, B: &mut [[T; 3]; 3]) {
        let (j, k) = rotated_axes(A);
        let (s, c) = (self.s, self.c);
        let (jj, jk, kk, aj, ak) = (B[j][j], at(B, j, k), B[k][k], at(B, A, j), at(B, A, k));
        let mix = T::of(2.0) * s * c * jk;
        B[j][j] = c * c * jj - mix + s * s * kk;
        B[k][k] = s * s * jj + mix + c * c * kk;
        B[j.min(k)][j.max(k)] = s * c * (jj - kk) + (c * c - s * s) * jk;
        B[j.min(A)][j.max(A)] = c * aj - s * ak;
        B[k.min(A)][k.max(A)] = s * aj + c * ak;
    }

    /// X I X^T with X = `force_to_parent`.
    #[inline(always)]
    fn inertia_to_parent<const A: usize>(self, I: &mut SpatialInertia<T>) {
        let (j, k) = rotated_axes(A);
        let (s, c, l) = (self.s, self.c, self.l);
        self.block_to_parent::<A>(&mut I.n);
        self.block_to_parent::<A>(&mut I.f);
        for i in 0..3 {
            let (row_j, row_k) = (I.h[j][i], I.h[k][i]);
            (I.h[j][i], I.h[k][i]) = (c * row_j - s * row_k, s * row_j + c * row_k);
        }
        for row in &mut I.h {
            self.to_parent::<A>(row);
        }
        let SpatialInertia { n, h, f } = I;
        let old = [h[0][1], h[1][0], h[1][1]];
        for i in 0..3 {
            h[0][i] -= l * at(f, 1, i);
            h[1][i] += l * at(f, 0, i);
        }
        n[0][0] -= l * (h[0][1] + old[0]);
        n[0][1] += l * (h[0][0] - old[2]);
        n[1][1] += l * (h[1][0] + old[1]);
        n[0][2] -= l * h[2][1];
        n[1][2] += l * h[2][0];
    }
}

/// Eliminated joint: U / D, 1 / D and the transform to the parent.
#[derive(Debug, Clone, Copy, Default)]
struct Joint<T> {
    k: Spatial<T>,
    inverse: T,
    frame: Frame<T>,
}

/// Eliminate a joint. `own` is added to D. On return `I` is the articulated inertia that the parent sees,
/// in the parent frame.
#[inline(always)]
fn eliminate<T: Scalar, const A: usize>(joint: &mut Joint<T>, own: T, I: &mut SpatialInertia<T>) {
    let mut u = [T::zero(); 6];
    for i in 0..3 {
        (u[i], u[3 + i]) = (at(&I.n, A, i), I.h[A][i]);
    }
    joint.inverse = T::one() / (u[A] + own);
    let mut k = u;
    for k in &mut k {
        *k *= joint.inverse;
    }
    joint.k = k;
    for i in 0..3 {
        for j in 0..3 {
            if i <= j {
                I.n[i][j] -= k[i] * u[j];
                I.f[i][j] -= k[3 + i] * u[3 + j];
            }
            I.h[i][j] -= k[i] * u[3 + j];
        }
    }
    joint.frame.inertia_to_parent::<A>(I);
}

/// Inward pass: `x` becomes the reduced torque, `force` the force on the parent.
#[inline(always)]
fn reduce<T: Scalar, const A: usize>(joint: &Joint<T>, x: &mut T, force: &mut Spatial<T>) {
    *x -= force[A];
    for i in 0..6 {
        force[i] += joint.k[i] * *x;
    }
    joint.frame.force_to_parent::<A>(force);
}

/// Outward pass: `x` becomes the joint acceleration, `motion` the motion of the body.
#[inline(always)]
fn expand<T: Scalar, const A: usize>(joint: &Joint<T>, x: &mut T, motion: &mut Spatial<T>) {
    joint.frame.motion_to_child::<A>(motion);
    let mut held = joint.k[0] * motion[0];
    for i in 1..6 {
        held += joint.k[i] * motion[i];
    }
    *x = *x * joint.inverse - held;
    motion[A] += *x;
}

/// Call a function with the joint axis as a const parameter.
macro_rules! for_axis {
    ($axis:expr, $function:ident($($argument:expr),*)) => {
        match $axis {
            Axis::X => $function::<_, 0>($($argument),*),
            Axis::Y => $function::<_, 1>($($argument),*),
            Axis::Z => $function::<_, 2>($($argument),*),
        }
    };
}

/// The trunk's eliminated joints.
#[derive(Debug, Clone, Default)]
pub struct Trunk<T = f64> {
    joints: [Joint<T>; TRUNK],
    /// Origin of the planar body that carries the trunk, from O in world axes, and sine and cosine of its
    /// angle.
    base: [T; 2],
    turn: (T, T),
}

impl<T: Scalar> Trunk<T> {
    /// See `ArticulatedBodies::factor`. Returns the articulated inertia that the trunk's planar base sees,
    /// in world axes at O.
    #[inline(always)]
    pub fn factor(
        &mut self,
        models: impl ModelLanes<T>,
        kin: &Kinematics<T>,
        own: impl Fn(usize) -> T,
        carried: SpatialInertia<T>,
    ) -> PlanarInertia<T> {
        let model = models.shape();
        let n = model.n_trunk.min(TRUNK);
        let mut I = carried;
        I.add(&models.trunk(n - 1));
        for i in (0..n).rev() {
            let b = model.n_planar + i;
            let joint = &mut self.joints[i];
            joint.frame = Frame::of(models, kin, b);
            let own = own(coordinate(b));
            for_axis!(model.axis[b], eliminate(joint, own, &mut I));
            if i > 0 {
                I.add(&models.trunk(i - 1));
            }
        }
        let base = model.parent[model.n_planar];
        (self.base, self.turn) = (kin.joint[base], kin.sin_cos[base]);
        let (s, c) = self.turn;
        let (yy, yz, zz, yn, zn) = (I.f[1][1], I.f[1][2], I.f[2][2], I.h[0][1], I.h[0][2]);
        let mix = T::of(2.0) * s * c * yz;
        let turned = PlanarInertia {
            yy: c * c * yy - mix + s * s * zz,
            yz: s * c * (yy - zz) + (c * c - s * s) * yz,
            zz: s * s * yy + mix + c * c * zz,
            yn: c * yn - s * zn,
            zn: s * yn + c * zn,
            nn: I.n[0][0],
        };
        turned.moved_to_origin(self.base)
    }

    /// 1 / D of trunk joint `i`.
    #[inline(always)]
    pub fn inverse(&self, i: usize) -> T {
        self.joints[i].inverse
    }

    /// See `ArticulatedBodies::reduce`. Returns the force on the planar base, in world axes at O.
    #[inline(always)]
    pub fn reduce(
        &self,
        model: &Model,
        forces: &[SpatialForce<T>; TRUNK],
        x: &mut [T; NV],
    ) -> Planar<T> {
        let mut f = [T::zero(); 6];
        for i in (0..model.n_trunk.min(TRUNK)).rev() {
            let b = model.n_planar + i;
            for (sum, own) in f.iter_mut().zip(&forces[i].0) {
                *sum += *own;
            }
            let x = &mut x[coordinate(b)];
            for_axis!(model.axis[b], reduce(&self.joints[i], x, &mut f));
        }
        let (s, c) = self.turn;
        let (y, z) = (c * f[4] - s * f[5], s * f[4] + c * f[5]);
        let p = self.base;
        let n = f[0] + p[0] * z - p[1] * y;
        Planar { y, z, n }
    }

    /// See `ArticulatedBodies::expand`. `up` is the motion of the base; returns the motion of the limbs'
    /// carrier.
    #[inline(always)]
    pub fn expand(&self, model: &Model, up: Planar<T>, x: &mut [T; NV]) -> SpatialMotion<T> {
        let p = self.base;
        let (y, z) = (up.y - up.n * p[1], up.z + up.n * p[0]);
        let (s, c) = self.turn;
        let zero = T::zero();
        let mut motion = [up.n, zero, zero, zero, c * y + s * z, c * z - s * y];
        for i in 0..model.n_trunk.min(TRUNK) {
            let b = model.n_planar + i;
            let x = &mut x[coordinate(b)];
            for_axis!(model.axis[b], expand(&self.joints[i], x, &mut motion));
        }
        SpatialMotion(motion)
    }
}

impl Trunk {
    /// Set every lane of `to` to this.
    #[inline(always)]
    pub fn broadcast<T: Scalar>(&self, to: &mut Trunk<T>) {
        for (to, joint) in to.joints.iter_mut().zip(&self.joints) {
            for (k, x) in to.k.iter_mut().zip(joint.k) {
                *k = T::of(x);
            }
            let Frame { s, c, l } = joint.frame;
            to.inverse = T::of(joint.inverse);
            to.frame = Frame {
                s: T::of(s),
                c: T::of(c),
                l: T::of(l),
            };
        }
        to.base = [T::of(self.base[0]), T::of(self.base[1])];
        to.turn = (T::of(self.turn.0), T::of(self.turn.1));
    }
}
