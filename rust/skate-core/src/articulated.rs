//! Accelerations from forces by articulated bodies: the joints are eliminated from the leaves to the
//! supporting foot and filled in again from there (Featherstone 2008, section 7.3).
//!
//! Every hinge but the trunk's three turns about its carrier's x axis. A limb therefore needs three
//! of the six components: in the frame of the body that carries it its joints see forces along y and
//! z and moments about x alone, whatever that body does. The legs are such a chain in the world's
//! axes about the pivot O, the arms and the head are such chains in the trunk's. Only the trunk's own
//! joints need 6 x 6 matrices; see `trunk`.

use crate::{
    kinematics::Kinematics,
    model::{FREE_FOOT, Model, NB, NV, ROOT, coordinate},
    trunk::{SpatialForce, SpatialInertia, TRUNK, Trunk},
};
use nalgebra::Matrix3;
use std::ops::AddAssign;

/// Motion or force of a body in its carrier's y-z plane, at the carrier's origin (legs: at O).
#[derive(Debug, Clone, Copy, Default)]
pub struct Planar {
    pub y: f64,
    pub z: f64,
    /// Rotation, or moment, about x.
    pub n: f64,
}

impl AddAssign for Planar {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.y += other.y;
        self.z += other.z;
        self.n += other.n;
    }
}

impl Planar {
    /// Work of a force along a unit rotation about the point `p`.
    #[inline]
    fn about(&self, p: [f64; 2]) -> f64 {
        self.n + p[1] * self.y - p[0] * self.z
    }

    /// A unit rotation about the point `p` times `rate`, added.
    #[inline]
    fn turn(&mut self, p: [f64; 2], rate: f64) {
        self.y += p[1] * rate;
        self.z -= p[0] * rate;
        self.n += rate;
    }
}

/// Symmetric: force per acceleration of an articulated body in the plane.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlanarInertia {
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
    pub yn: f64,
    pub zn: f64,
    pub nn: f64,
}

impl AddAssign for PlanarInertia {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
        self.yn += other.yn;
        self.zn += other.zn;
        self.nn += other.nn;
    }
}

impl PlanarInertia {
    /// A rigid body of mass `m`, centre `c` and inertia `J` about it.
    #[inline]
    fn rigid(m: f64, c: [f64; 2], J: f64) -> Self {
        let (hy, hz) = (m * c[0], m * c[1]);
        Self {
            yy: m,
            yz: 0.0,
            zz: m,
            yn: -hz,
            zn: hy,
            nn: J + hy * c[0] + hz * c[1],
        }
    }

    /// The same inertia at the origin, given at the point `p`.
    pub fn seen_from_origin(&self, p: [f64; 2]) -> Self {
        let (y, z) = (
            self.yz * p[0] - self.yy * p[1],
            self.zz * p[0] - self.yz * p[1],
        );
        Self {
            yn: self.yn + y,
            zn: self.zn + z,
            nn: self.nn + 2.0 * (self.zn * p[0] - self.yn * p[1]) + (z * p[0] - y * p[1]),
            ..*self
        }
    }

    /// Let a hinge at `p` give way: what remains of the inertia on its other side.
    #[inline]
    fn eliminate(&self, p: [f64; 2]) -> (Hinge, Self) {
        let u = Planar {
            y: self.yy * p[1] - self.yz * p[0] + self.yn,
            z: self.yz * p[1] - self.zz * p[0] + self.zn,
            n: self.yn * p[1] - self.zn * p[0] + self.nn,
        };
        let inverse = 1.0 / u.about(p);
        let k = Planar {
            y: u.y * inverse,
            z: u.z * inverse,
            n: u.n * inverse,
        };
        let left = Self {
            yy: self.yy - k.y * u.y,
            yz: self.yz - k.y * u.z,
            zz: self.zz - k.z * u.z,
            yn: self.yn - k.y * u.n,
            zn: self.zn - k.z * u.n,
            nn: self.nn - k.n * u.n,
        };
        (Hinge { p, k, inverse }, left)
    }
}

/// An eliminated hinge about x.
#[derive(Debug, Clone, Copy, Default)]
struct Hinge {
    /// Where it is: y and z in the carrier's frame (legs: in the world's axes from O).
    p: [f64; 2],
    /// U / D: what a unit of its torque hands on to the parent.
    k: Planar,
    /// 1 / D
    inverse: f64,
}

impl Hinge {
    /// Torque `x` less the force on the body: what accelerates the hinge. Returns what the parent feels.
    #[inline]
    fn reduce(&self, x: &mut f64, force: Planar) -> Planar {
        let u = *x - force.about(self.p);
        *x = u;
        Planar {
            y: force.y + self.k.y * u,
            z: force.z + self.k.z * u,
            n: force.n + self.k.n * u,
        }
    }

    /// The hinge's acceleration from its reduced torque and its parent's motion, and the body's.
    #[inline]
    fn expand(&self, x: &mut f64, up: Planar) -> Planar {
        let k = &self.k;
        *x = *x * self.inverse - (k.y * up.y + k.z * up.z + k.n * up.n);
        let mut motion = up;
        motion.turn(self.p, *x);
        motion
    }
}

/// Forces on the bodies that keep them from accelerating: inertial and gravity's.
#[derive(Debug, Clone)]
pub struct Forces {
    pub planar: [Planar; NB],
    pub trunk: [SpatialForce; TRUNK],
}

impl Default for Forces {
    fn default() -> Self {
        Self {
            planar: [Planar::default(); NB],
            trunk: [SpatialForce::default(); TRUNK],
        }
    }
}

/// M, factored.
#[derive(Debug, Clone, Default)]
pub struct Articulated {
    hinges: [Hinge; NB],
    trunk: Trunk,
    root: PlanarInertia,
    /// Workspace for the planar bodies.
    inertia: [PlanarInertia; NB],
    motion: [Planar; NB],
}

/// Coordinates that move the free foot: the root and q2 to q7, each the next one's parent.
pub const LEG: usize = 9;

impl Articulated {
    /// Eliminate all joints; needs `Kinematics::frames`.
    pub fn factor(&mut self, model: &Model, kin: &Kinematics) {
        let inertia = &mut self.inertia;
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        for (b, body) in bodies[..n_planar].iter().enumerate() {
            inertia[b] = PlanarInertia::rigid(body.mass, kin.c[b], body.inertia.m11);
        }
        if let Some(carrier) = model.carrier {
            let mut carried = SpatialInertia::default();
            // A limb's bodies follow each other, from its tip inwards.
            let mut outer = PlanarInertia::default();
            for (b, body) in bodies.iter().enumerate().skip(carrier + 1).rev() {
                carried.add_rod(body, kin.c[b], kin.sin_cos[b]);
                outer += PlanarInertia::rigid(body.mass, kin.c[b], body.inertia.m11);
                (self.hinges[b], outer) = outer.eliminate(kin.joint[b]);
                if body.parent == carrier {
                    carried.add_limb(&outer, model.side[b]);
                    outer = PlanarInertia::default();
                }
            }
            inertia[bodies[n_planar].parent] += self.trunk.factor(model, kin, carried);
        }
        for b in (1..n_planar).rev() {
            let (hinge, left) = inertia[b].eliminate(kin.joint[b]);
            self.hinges[b] = hinge;
            inertia[bodies[b].parent] += left;
        }
        self.root = inertia[0];
    }

    /// Articulated inertia of the whole robot at O, order y0, z0, q1.
    pub fn root(&self) -> Matrix3<f64> {
        let r = &self.root;
        Matrix3::new(r.yy, r.yz, r.yn, r.yz, r.zz, r.zn, r.yn, r.zn, r.nn)
    }

    /// 1 / D of a leg's joint.
    #[inline]
    pub fn inverse_d(&self, c: usize) -> f64 {
        self.hinges[c - 2].inverse
    }

    /// Carry generalised forces `x` and the forces on the bodies down to the root: on return x holds
    /// what accelerates each joint, and for the root the force that accelerates S.
    pub fn reduce(&self, model: &Model, kin: &Kinematics, forces: &mut Forces, x: &mut [f64; NV]) {
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        let planar = &mut forces.planar;
        if let Some(carrier) = model.carrier {
            let top = carrier - n_planar;
            let mut outer = Planar::default();
            for b in (carrier + 1..bodies.len()).rev() {
                outer += planar[b];
                outer = self.hinges[b].reduce(&mut x[coordinate(b)], outer);
                if bodies[b].parent == carrier {
                    forces.trunk[top].add_at(model.side[b], &outer);
                    outer = Planar::default();
                }
            }
            planar[bodies[n_planar].parent] += self.trunk.reduce(model, kin, &forces.trunk, x);
        }
        for b in (1..n_planar).rev() {
            let rest = self.hinges[b].reduce(&mut x[coordinate(b)], planar[b]);
            planar[bodies[b].parent] += rest;
        }
        x[0] -= planar[0].y;
        x[1] -= planar[0].z;
        x[2] -= planar[0].n;
    }

    /// From reduced joint forces and the root's acceleration to all accelerations, in place.
    pub fn expand(&mut self, model: &Model, kin: &Kinematics, x: &mut [f64; NV]) {
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        let motion = &mut self.motion;
        motion[0] = Planar {
            y: x[0],
            z: x[1],
            n: x[2],
        };
        for b in 1..n_planar {
            let up = motion[bodies[b].parent];
            motion[b] = self.hinges[b].expand(&mut x[coordinate(b)], up);
        }
        let Some(carrier) = model.carrier else {
            return;
        };
        let base = motion[bodies[n_planar].parent];
        let carried = self.trunk.expand(model, kin, base, x);
        let mut inner = Planar::default();
        for b in carrier + 1..bodies.len() {
            if bodies[b].parent == carrier {
                inner = carried.planar_at(model.side[b]);
            }
            inner = self.hinges[b].expand(&mut x[coordinate(b)], inner);
        }
    }

    /// `reduce` for unit forces on the free foot along y and z at `point`, and a unit couple: row i of
    /// the result holds the reduced joint forces, and first the forces that arrive at the root.
    pub fn reduce_unit_forces(&self, point: [f64; 2]) -> [[f64; LEG]; 3] {
        let [y, z] = point;
        let unit = [[1.0, 0.0, -z], [0.0, 1.0, y], [0.0, 0.0, 1.0]];
        unit.map(|[y, z, n]| {
            let mut column = [0.0; LEG];
            // A force on a body is minus the force that would keep it from accelerating.
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
            column
        })
    }
}
