//! The model: a compiled scene, in which locked joints are merged and constants precomputed.

mod compile;
pub mod contact_law;
pub mod contact_mode;
pub mod controller_state;
pub mod controller_terms;
pub mod friction;
pub mod lanes;
pub mod layout;
mod links;
pub mod rigid_body;
pub mod scheme;
pub mod state;

use crate::{
    model::{
        contact_law::ContactRules,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact},
        controller_terms::Term,
        friction::FrictionLaw,
        lanes::Body,
        layout::{DEPTH, NB, NV, ROOT, TRUNK},
        rigid_body::{Axis, RigidBody, Segment},
        scheme::Scheme,
    },
    numeric::spatial::SpatialInertia,
    scene::Scene,
};
use nalgebra::Vector3;
use std::ops::Range;

/// Constants of the robot, the ice and the controller.
#[derive(Debug, Clone)]
pub struct Model {
    /// Number of coordinates.
    pub n: usize,
    /// Names of the coordinates.
    pub names: Vec<&'static str>,
    /// In depth-first order; the first seven are supporting foot, lower leg, upper leg, waist and the free leg.
    pub bodies: Vec<RigidBody>,
    /// The bodies before this index move in the sagittal plane.
    pub n_planar: usize,
    /// The numbers of `bodies` that every evaluation reads, contiguous in memory.
    pub numbers: [Body; NB],
    /// First moment of each body about its joint, in its frame, with the bodies that it carries as masses at their
    /// joints [kg m].
    pub moments: [[f64; 3]; NB],
    pub parent: [usize; NB],
    pub axis: [Axis; NB],
    /// Inertias of the trunk: the bodies from `n_planar` to the one that carries the limbs.
    pub trunk: [SpatialInertia; TRUNK],
    /// Number of bodies of the trunk.
    pub n_trunk: usize,
    /// Last body of the trunk, if the trunk moves out of the plane.
    pub carrier: Option<usize>,
    /// The bodies of the limbs, limb by limb, each from its tip inwards. The limb in the middle comes last: sums
    /// over the other two are then symmetric in every bit.
    pub limbs: Vec<usize>,
    /// Number of ancestors of each coordinate.
    pub depth: [usize; NV],
    /// `ancestors[c][d]`: the ancestor of coordinate `c` at depth `d`.
    pub ancestors: [[usize; DEPTH]; NV],
    /// Body and point of the top of the head.
    pub head: (usize, Vector3<f64>),
    /// Point psi of the head's body on which the controller acts, see `Control::psi`.
    pub psi: Vector3<f64>,
    /// Coordinates from the waist to the head, Eq. 15.
    pub head_chain: Vec<usize>,
    /// Coordinates from the supporting lower leg to the head.
    pub head_path: Vec<usize>,
    /// Coordinate of q8, if it is not locked.
    pub yaw: Option<usize>,
    /// The sole: heel (negative) and toe along y, height (negative) along z, from the ankle [m].
    pub sole: Sole,
    /// Half the distance between the legs [m].
    pub half_hip: f64,
    /// The paper's links as line segments, for drawings.
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
    /// The controller has terms of `control::joint_torques`.
    pub has_joint_torques: bool,
    /// Lowest admissible height of the top of the head [m].
    pub fall_height: f64,
    /// Bodies whose joints, knees and ankles, must stay above the ice. The free ankle is left out in scenes without
    /// free-foot contact, in which the foot passes through the ice.
    pub fall_joints: &'static [usize],
    /// The numerical scheme; nothing else reads `scene.accuracy` after compilation.
    pub scheme: Scheme,
    /// `Scheme::usual_rate` of the scheme [1/s].
    pub usual_rate: f64,
    pub scene: Scene,
    /// `Scene::kind` and `Scene::numbers` of the scene.
    pub(crate) kind: u64,
    pub(crate) scene_numbers: Vec<f64>,
}

/// Ends of the sole, from the ankle, foot flat [m].
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
    /// Degrees of freedom: coordinates that move in some contact mode.
    pub fn dof(&self) -> usize {
        let leaves_the_ice = self.contact.is_push_only;
        let y0 = leaves_the_ice || !self.friction.sticks();
        let q1 = self.contact.support_rotates;
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

    /// Index of the coordinate of that name, if it is not locked.
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

    /// Values by coordinate from values by name; absent names are zero.
    pub fn from_names(&self, values: &std::collections::BTreeMap<String, f64>) -> [f64; NV] {
        let value = |name: &&str| values.get(*name).copied();
        std::array::from_fn(|i| self.names.get(i).and_then(value).unwrap_or(0.0))
    }
}
