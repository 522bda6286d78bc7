//! Compilation of a scene into a model.

use crate::{
    error::Invalid,
    model::{
        Model, Sole,
        controller_terms::{Term, terms},
        lanes::Body,
        layout::{
            DEPTH, FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, NB, NV, UPPER_LEG, WAIST, coordinate,
        },
        links::{UPPER_BODY, links, merge},
        rigid_body::{Axis, RigidBody, Segment},
        scheme::Scheme,
    },
    numeric::spatial::SpatialInertia,
    scene::Scene,
};
use nalgebra::Vector3;

impl Model {
    /// Compile a scene, so that a time step tests none of its choices.
    ///
    /// # Errors
    /// See `Scene::validate`.
    pub fn compile(scene: &Scene) -> Result<Self, Invalid> {
        scene.validate()?;
        Ok(Self::of(scene.clone(), scene.kind()))
    }

    /// The same structure with other numbers, which the caller has validated.
    pub(crate) fn renumbered(&self, scene: Scene) -> Self {
        Self::of(scene, self.kind)
    }

    fn of(mut scene: Scene, kind: u64) -> Self {
        let links = links(&scene.body);
        let mut bodies: Vec<RigidBody> = Vec::with_capacity(NB);
        let mut names = vec!["y0", "z0"];
        let mut segments = Vec::with_capacity(NB);
        // For each link its body and its origin in that body's frame.
        let mut place: Vec<(usize, Vector3<f64>)> = Vec::with_capacity(NB);
        for link in &links {
            let is_root = place.is_empty();
            let (parent, origin) = if is_root {
                (0, Vector3::zeros())
            } else {
                place[link.body.parent]
            };
            let offset = origin + link.body.offset;
            if scene.locked.iter().any(|name| name == link.joint) {
                merge(&mut bodies[parent], &link.body, offset);
                place.push((parent, offset));
            } else {
                names.push(link.joint);
                place.push((bodies.len(), Vector3::zeros()));
                let damping = match scene.body.joint_damping {
                    _ if is_root => scene.contact.edge_damping,
                    true => link.body.damping,
                    false => 0.0,
                };
                bodies.push(RigidBody {
                    parent,
                    offset,
                    damping,
                    ..link.body.clone()
                });
            }
            let (body, origin) = *place.last().expect("just pushed");
            segments.push(Segment {
                body,
                ends: link.ends.map(|end| origin + end),
            });
        }
        let head_end = segments[16].ends[1];
        let head = (segments[16].body, head_end);
        let neck = segments[16].ends[0];
        // Exactly the top for psi = 1.
        let psi = head_end + (neck - head_end) * (1.0 - scene.control.psi);
        let scheme = Scheme::from(scene.accuracy);
        let yaw = names.iter().position(|&name| name == "q8");
        let controller_terms = terms(&scene, yaw);
        let mut model = Self {
            n: bodies.len() + 2,
            n_planar: bodies
                .iter()
                .position(|b| b.axis != Axis::X)
                .unwrap_or(bodies.len()),
            depth: [0; NV],
            ancestors: [[0; DEPTH]; NV],
            numbers: [Body::default(); NB],
            moments: [[0.0; 3]; NB],
            parent: [0; NB],
            axis: [Axis::X; NB],
            trunk: Default::default(),
            n_trunk: 0,
            carrier: None,
            limbs: Vec::new(),
            head,
            psi,
            head_chain: Vec::new(),
            head_path: Vec::new(),
            yaw,
            sole: Sole {
                heel: -scene.body.foot.heel,
                toe: scene.body.foot.toe,
                z: -scene.body.foot.height,
            },
            half_hip: 0.5 * scene.body.waist.length,
            segments,
            mass: bodies.iter().map(|body| body.mass).sum(),
            damping: [0.0; NV],
            damped: 0..0,
            friction: scene.ice.friction.into(),
            contact: (&scene.contact).into(),
            has_joint_torques: controller_terms.iter().any(Term::has_joint_torques),
            controller_terms,
            fall_joints: match scene.contact.free_foot {
                true => &[LOWER_LEG, UPPER_LEG, FREE_LOWER_LEG, FREE_FOOT],
                false => &[LOWER_LEG, UPPER_LEG, FREE_LOWER_LEG],
            },
            fall_height: scene.fall.as_ref().map_or(0.0, |fall| fall.head_height),
            scheme,
            usual_rate: scheme.usual_rate(),
            scene_numbers: scene.numbers(),
            scene,
            kind,
            names,
            bodies,
        };
        model.lay_out_tree();
        model.add_moments();
        for (b, body) in model.bodies.iter().enumerate() {
            (model.parent[b], model.axis[b]) = (body.parent, body.axis);
            model.numbers[b] = Body {
                mass: body.mass,
                com: body.com.into(),
                above: body.offset.z,
                across: body.inertia.m11,
                along: body.inertia.m33,
                side: 0.0,
            };
        }
        if model.n_planar < model.bodies.len() {
            let carrier = place[UPPER_BODY].0;
            let trunk = &model.bodies[model.n_planar..=carrier];
            for (inertia, body) in model.trunk.iter_mut().zip(trunk) {
                *inertia = SpatialInertia::rigid(body.mass, &body.com, &body.inertia);
            }
            model.n_trunk = trunk.len();
            model.carrier = Some(carrier);
            for b in carrier + 1..model.bodies.len() {
                let body = &model.bodies[b];
                model.numbers[b].side = body.offset.x + model.numbers[body.parent].side;
            }
            let bodies: Vec<usize> = (carrier + 1..model.bodies.len()).collect();
            let mut limbs: Vec<&[usize]> = bodies
                .chunk_by(|_, &next| model.bodies[next].parent != carrier)
                .collect();
            limbs.sort_by_key(|limb| model.numbers[limb[0]].side == 0.0);
            model.limbs = limbs
                .iter()
                .flat_map(|limb| limb.iter().rev())
                .copied()
                .collect();
        }
        let c = coordinate(head.0);
        let path = &model.ancestors[c][..model.depth[c]];
        let trunk = path.iter().copied().chain([c]);
        model.head_chain = trunk.filter(|&c| c > coordinate(WAIST)).collect();
        let leg = [LOWER_LEG, UPPER_LEG, WAIST].map(coordinate);
        model.head_path = leg
            .into_iter()
            .chain(model.head_chain.iter().copied())
            .collect();
        model
    }

    fn add_moments(&mut self) {
        let mut carried = [0.0; NB];
        for (b, body) in self.bodies.iter().enumerate().rev() {
            carried[b] += body.mass;
            let is_root = b == 0;
            for i in 0..3 {
                self.moments[b][i] += body.mass * body.com[i];
                if !is_root {
                    self.moments[body.parent][i] += carried[b] * body.offset[i];
                }
            }
            if !is_root {
                carried[body.parent] += carried[b];
            }
        }
    }

    fn lay_out_tree(&mut self) {
        self.depth[1] = 1;
        self.ancestors[1][0] = 0;
        for (b, body) in self.bodies.iter().enumerate() {
            let c = coordinate(b);
            let up = if b == 0 { 1 } else { coordinate(body.parent) };
            let d = self.depth[up];
            self.ancestors[c] = self.ancestors[up];
            self.ancestors[c][d] = up;
            self.depth[c] = d + 1;
            self.damping[c] = body.damping;
        }
        self.damping[0] = self.friction.drag;
        let first = self.damping.iter().position(|&d| d != 0.0);
        let last = self.damping.iter().rposition(|&d| d != 0.0);
        self.damped = first.zip(last).map_or(0..0, |(a, b)| a..b + 1);
    }
}
