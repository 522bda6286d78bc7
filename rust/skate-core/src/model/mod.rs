//! A scene compiled: locked joints merged away, constants where the step needs them.

pub mod contact_law;
pub mod contact_mode;
pub mod controller_state;
pub mod controller_terms;
pub mod friction;
pub mod lanes;
pub mod layout;
mod links;
pub mod rigid_body;
pub mod state;

use crate::{
    error::Invalid,
    model::{
        contact_law::ContactRules,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact},
        controller_terms::{Term, terms},
        friction::FrictionLaw,
        lanes::Body,
        layout::{
            DEPTH, FREE_FOOT, FREE_LOWER_LEG, LOWER_LEG, NB, NV, ROOT, TRUNK, UPPER_LEG, WAIST,
            coordinate,
        },
        rigid_body::{Axis, RigidBody, Segment},
    },
    numeric::spatial::SpatialInertia,
    scene::*,
};
use links::{UPPER_BODY, links, merge};
use nalgebra::Vector3;
use std::ops::Range;

/// Everything about the robot and the ice that does not change while it moves.
#[derive(Debug, Clone)]
pub struct Model {
    /// Number of coordinates.
    pub n: usize,
    /// Names of the coordinates.
    pub names: Vec<&'static str>,
    /// In depth-first order; the first seven are foot, lower leg, upper leg, waist and the free leg.
    pub bodies: Vec<RigidBody>,
    /// The bodies before this index move in the sagittal plane.
    pub n_planar: usize,
    /// What every evaluation reads of `bodies`, close together.
    pub numbers: [Body; NB],
    pub parent: [usize; NB],
    pub axis: [Axis; NB],
    /// Inertias of the trunk: the bodies from `n_planar` to the one that carries the limbs.
    pub trunk: [SpatialInertia; TRUNK],
    /// How many they are.
    pub n_trunk: usize,
    /// The last of the trunk, if the trunk leaves the plane.
    pub carrier: Option<usize>,
    /// The bodies of the limbs, limb by limb, each from its tip inwards. Those in the middle come last: the
    /// first two may then change places without a sum changing by a bit.
    pub limbs: Vec<usize>,
    /// Number of ancestors of each coordinate.
    pub depth: [usize; NV],
    /// `ancestors[c][d]`: the ancestor of coordinate `c` at depth `d`.
    pub ancestors: [[usize; DEPTH]; NV],
    /// Body and point of the top of the head.
    pub head: (usize, Vector3<f64>),
    /// Coordinates from the waist to the head, Eq. 15.
    pub head_chain: Vec<usize>,
    /// The same from the ice on, along the supporting leg.
    pub head_path: Vec<usize>,
    /// Coordinates of q8 and the shoulders q11, q14, where they are not locked.
    pub yaw: Option<usize>,
    /// The sole: heel (negative) and toe along y, height (negative) along z, from the ankle [m].
    pub sole: Sole,
    /// Half the distance between the legs [m].
    pub half_hip: f64,
    /// The paper's links for drawing.
    pub segments: Vec<Segment>,
    mass: f64,
    /// Viscous friction by coordinate, D of Eq. 9: y0 has that of the ice, q1 the couple of
    /// `Contact::edge_damping`.
    pub damping: [f64; NV],
    /// Coordinates that are damped.
    pub damped: Range<usize>,
    pub friction: FrictionLaw,
    /// The contact law; nothing else reads `scene.contact` after compilation.
    pub contact: ContactRules,
    /// Terms of the controller, those that the scene names.
    pub controller_terms: Vec<Term>,
    /// Lowest admissible height of the top of the head [m].
    pub fall_height: f64,
    /// Bodies of which the joints must stay above the ice: knees and ankles. A foot that turned over has
    /// its ankle below the ice before its sole arrives there; a free foot that passes through may.
    pub fall_joints: &'static [usize],
    pub scene: Scene,
    /// `Scene::kind` of the scene.
    pub(crate) kind: u64,
}

/// Ends of the sole seen from the ankle, foot flat [m].
#[derive(Debug, Clone, Copy)]
pub struct Sole {
    pub heel: f64,
    pub toe: f64,
    pub z: f64,
}

impl Sole {
    pub fn length(&self) -> f64 {
        self.toe - self.heel
    }

    /// Distance of an end in front of the ankle [m]; negative for the heel.
    pub fn ahead_of_ankle(&self, end: End) -> f64 {
        match end {
            End::Heel => self.heel,
            End::Toe => self.toe,
        }
    }
}

impl Model {
    /// Resolve a scene once, so that the step tests none of its choices.
    ///
    /// # Errors
    /// See `Scene::validate`.
    pub fn compile(scene: &Scene) -> Result<Self, Invalid> {
        scene.validate()?;
        Ok(Self::of(scene.clone(), scene.kind()))
    }

    /// The same with other numbers, which the caller has checked.
    pub(crate) fn renumbered(&self, scene: Scene) -> Self {
        Self::of(scene, self.kind)
    }

    fn of(scene: Scene, kind: u64) -> Self {
        let links = links(&scene.body);
        let mut bodies: Vec<RigidBody> = Vec::with_capacity(NB);
        let mut names = vec!["y0", "z0"];
        let mut segments = Vec::with_capacity(NB);
        // Where each link went: its body, and its origin in that body's frame.
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
        let yaw = names.iter().position(|&name| name == "q8");
        let mut model = Self {
            n: bodies.len() + 2,
            n_planar: bodies
                .iter()
                .position(|b| b.axis != Axis::X)
                .unwrap_or(bodies.len()),
            depth: [0; NV],
            ancestors: [[0; DEPTH]; NV],
            numbers: [Body::default(); NB],
            parent: [0; NB],
            axis: [Axis::X; NB],
            trunk: Default::default(),
            n_trunk: 0,
            carrier: None,
            limbs: Vec::new(),
            head,
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
            controller_terms: terms(&scene, yaw),
            fall_joints: match scene.contact.free_foot {
                true => &[LOWER_LEG, UPPER_LEG, FREE_LOWER_LEG, FREE_FOOT],
                false => &[LOWER_LEG, UPPER_LEG, FREE_LOWER_LEG],
            },
            fall_height: scene.fall.as_ref().map_or(0.0, |fall| fall.head_height),
            scene,
            kind,
            names,
            bodies,
        };
        model.lay_out_tree();
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

    /// Degrees of freedom: coordinates that move in some contact mode.
    pub fn dof(&self) -> usize {
        let leaves_the_ice = self.contact.is_unilateral();
        let y0 = leaves_the_ice || !self.friction.sticks();
        let q1 = self.contact.support_rotates();
        self.n - ROOT + usize::from(y0) + usize::from(leaves_the_ice) + usize::from(q1)
    }

    /// Every contact mode that the scene allows.
    pub fn modes(&self) -> Vec<ContactMode> {
        let feet = |touches: &[SoleContact]| {
            let mut feet = Vec::new();
            for &touch in touches {
                for &friction_mode in self.friction.friction_modes {
                    let foot = Foot::new(touch, friction_mode);
                    if !feet.contains(&foot) {
                        feet.push(foot);
                    }
                }
            }
            feet
        };
        let [support, free] =
            [SUPPORT, FREE].map(|which| feet(self.contact.allowed_contacts(which)));
        let pairs = support
            .iter()
            .flat_map(|&support| free.iter().map(move |&free| ContactMode { support, free }));
        pairs.collect()
    }

    /// Is it one of `modes`?
    pub(crate) fn allows(&self, mode: ContactMode) -> bool {
        let may = |which: usize, foot: Foot| {
            let mut friction_modes = self.friction.friction_modes.iter();
            self.contact.allowed_contacts(which).contains(&foot.touch)
                && friction_modes.any(|&friction_mode| Foot::new(foot.touch, friction_mode) == foot)
        };
        may(SUPPORT, mode.support) && may(FREE, mode.free)
    }

    /// Index of the coordinate of that name, if it was not locked away.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|&known| known == name)
    }

    /// Total mass [kg].
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Weight [N], the scale of forces; without gravity that of 1 m/s2.
    pub fn weight(&self) -> f64 {
        self.mass() * self.scene.ice.gravity.max(1.0)
    }

    /// Coefficients (y0, z0, q1 and joints) laid out from named values; absent names are zero.
    pub fn from_names(&self, values: &std::collections::BTreeMap<String, f64>) -> [f64; NV] {
        let mut out = [0.0; NV];
        for (i, &name) in self.names.iter().enumerate() {
            out[i] = values.get(name).copied().unwrap_or(0.0);
        }
        out
    }
}
