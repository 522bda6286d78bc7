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
    planar::{Hinge, Planar, PlanarInertia},
    spatial::{Rods, SpatialForce, SpatialInertia},
    trunk::{TRUNK, Trunk},
};
use nalgebra::Matrix3;

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
    /// Factor M + g D, D being the friction of the joints: eliminate them all. Needs
    /// `Kinematics::frames`.
    pub fn factor(&mut self, model: &Model, kin: &Kinematics, g: f64) {
        if g == 0.0 {
            self.eliminate(model, kin, |_| 0.0);
        } else {
            self.eliminate(model, kin, |c| g * model.damping[c]);
        }
    }

    /// `own` is what a joint resists by itself besides its bodies.
    #[inline(always)]
    fn eliminate(&mut self, model: &Model, kin: &Kinematics, own: impl Fn(usize) -> f64) {
        let inertia = &mut self.inertia;
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        for (b, body) in bodies[..n_planar].iter().enumerate() {
            inertia[b] = PlanarInertia::rigid(body.mass, kin.c[b], body.inertia.m11);
        }
        if let Some(carrier) = model.carrier {
            let mut carried = SpatialInertia::default();
            let (mut rods, mut outer) = (Rods::default(), PlanarInertia::default());
            for &b in &model.limbs {
                let body = &bodies[b];
                rods.add(body, kin.c[b], kin.sin_cos[b]);
                outer += PlanarInertia::rigid(body.mass, kin.c[b], body.inertia.m11);
                (self.hinges[b], outer) = outer.eliminate(kin.joint[b], own(coordinate(b)));
                if body.parent == carrier {
                    carried.add_limb(&outer, &rods, model.side[b]);
                    (rods, outer) = Default::default();
                }
            }
            inertia[bodies[n_planar].parent] += self.trunk.factor(model, kin, &own, carried);
        }
        // What the body before it feels of the last one, in registers as in `Kinematics::frames`.
        let mut last = PlanarInertia::default();
        for b in (1..n_planar).rev() {
            let mut body = inertia[b];
            body += last;
            (self.hinges[b], last) = body.eliminate(kin.joint[b], own(coordinate(b)));
            if bodies[b].parent + 1 != b {
                inertia[bodies[b].parent] += last;
                last = PlanarInertia::default();
            }
        }
        self.root = inertia[0];
        self.root += last;
        self.root.yy += own(0);
        self.root.nn += own(coordinate(0));
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

    /// 1 / D of any joint.
    pub fn inverse(&self, model: &Model, c: usize) -> f64 {
        let b = c - 2;
        match model.carrier {
            Some(carrier) if (model.n_planar..=carrier).contains(&b) => {
                self.trunk.inverse(b - model.n_planar)
            }
            _ => self.hinges[b].inverse,
        }
    }

    /// Carry generalised forces `x` and the forces on the bodies down to the root: on return x holds
    /// what accelerates each joint, and for the root the force that accelerates S.
    pub fn reduce(&self, model: &Model, forces: &mut Forces, x: &mut [f64; NV]) {
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        let planar = &mut forces.planar;
        if let Some(carrier) = model.carrier {
            let top = carrier - n_planar;
            let mut carried = SpatialForce::default();
            let mut outer = Planar::default();
            for &b in &model.limbs {
                outer += planar[b];
                outer = self.hinges[b].reduce(&mut x[coordinate(b)], outer);
                if bodies[b].parent == carrier {
                    carried.add_at(model.side[b], &outer);
                    outer = Planar::default();
                }
            }
            for (sum, force) in forces.trunk[top].0.iter_mut().zip(carried.0) {
                *sum += force;
            }
            planar[bodies[n_planar].parent] += self.trunk.reduce(model, &forces.trunk, x);
        }
        let mut last = Planar::default();
        for b in (1..n_planar).rev() {
            let mut own = planar[b];
            own += last;
            last = self.hinges[b].reduce(&mut x[coordinate(b)], own);
            if bodies[b].parent + 1 != b {
                planar[bodies[b].parent] += last;
                last = Planar::default();
            }
        }
        last += planar[0];
        x[0] -= last.y;
        x[1] -= last.z;
        x[2] -= last.n;
    }

    /// From reduced joint forces and the root's acceleration to all accelerations, in place.
    pub fn expand(&mut self, model: &Model, x: &mut [f64; NV]) {
        let bodies = &model.bodies[..model.bodies.len().min(NB)];
        let n_planar = model.n_planar.min(bodies.len());
        let motion = &mut self.motion;
        let mut last = Planar {
            y: x[0],
            z: x[1],
            n: x[2],
        };
        motion[0] = last;
        for b in 1..n_planar {
            let up = bodies[b].parent;
            let up = if up + 1 == b { last } else { motion[up] };
            last = self.hinges[b].expand(&mut x[coordinate(b)], up);
            motion[b] = last;
        }
        let Some(carrier) = model.carrier else {
            return;
        };
        let base = motion[bodies[n_planar].parent];
        let carried = self.trunk.expand(model, base, x);
        let mut inner = Planar::default();
        for b in carrier + 1..bodies.len() {
            if bodies[b].parent == carrier {
                inner = carried.planar_at(model.side[b]);
            }
            inner = self.hinges[b].expand(&mut x[coordinate(b)], inner);
        }
    }

    /// `reduce` for unit forces on the free foot along y and z at `point`, and a unit couple, as many
    /// of them as `columns` has: each then holds the reduced joint forces, and first the forces that
    /// arrive at the root.
    pub fn reduce_unit_forces(&self, point: [f64; 2], columns: &mut [[f64; LEG]]) {
        let [y, z] = point;
        let unit = [[1.0, 0.0, -z], [0.0, 1.0, y], [0.0, 0.0, 1.0]];
        for (column, [y, z, n]) in columns.iter_mut().zip(unit) {
            *column = [0.0; LEG];
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
        }
    }
}
