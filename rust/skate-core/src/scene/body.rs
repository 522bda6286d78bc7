//! The body: Table 1 of the paper, and every size that the paper does not give.

use crate::scene::declaration::table;
use serde::{Deserialize, Serialize};

table! {
    /// One kind of link. Length, mass and damping are those of Table 1; the radius is assumed.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Link {
        /// l_i, distance from its joint to the next.
        pub length: f64 [0.02, 2.0, "m"],
        /// m_i.
        pub mass: f64 [0.01, 200.0, "kg"],
        /// d_i, viscous friction of its joint; for the legs, of the upper joint.
        pub damping: f64 [0.0, 1e3, "N m s/rad"],
        /// Radius of the uniform rod that represents it (assumed).
        pub radius: f64 [0.005, 0.5, "m"],
    }
}

table! {
    /// The waist: a link whose joints are the hips, which have the damping of the upper legs.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Bar {
        /// Distance between the hips.
        pub length: f64 [0.02, 2.0, "m"],
        /// m_i.
        pub mass: f64 [0.01, 200.0, "kg"],
        /// Radius of the uniform rod that represents it (assumed).
        pub radius: f64 [0.005, 0.5, "m"],
    }
}

table! {
    /// The foot: Table 1 gives its height, mass and damping; the size of the sole is assumed.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Foot {
        /// Height of the ankle above the sole, l_i.
        pub height: f64 [0.01, 0.3, "m"],
        /// m_i.
        pub mass: f64 [0.01, 200.0, "kg"],
        /// d_i of the ankle.
        pub damping: f64 [0.0, 1e3, "N m s/rad"],
        /// Distance of the sole's front end from the ankle (assumed).
        pub toe: f64 [0.02, 0.6, "m"],
        /// Distance of the sole's rear end from the ankle (assumed).
        pub heel: f64 [0.02, 0.6, "m"],
        /// Width of the box that represents it (assumed).
        pub width: f64 [0.02, 0.3, "m"],
    }
}

table! {
    /// All sizes of the robot. Arguments of `link`: length, mass, damping, radius.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct Body {
        /// Joints have the viscous friction d_i of their links.
        pub joint_damping: bool = true,
        pub head: Link = link(0.24, 4.5, 0.5, 0.08),
        pub upper_body: Link = link(0.41, 21.5, 10.0, 0.13),
        pub middle_body: Link = link(0.1, 2.0, 10.0, 0.11),
        pub lower_body: Link = link(0.1, 2.0, 10.0, 0.11),
        pub upper_arm: Link = link(0.31, 2.3, 0.03, 0.04),
        pub lower_arm: Link = link(0.24, 1.4, 1.0, 0.035),
        pub hand: Link = link(0.18, 0.4, 2.0, 0.025),
        pub upper_leg: Link = link(0.38, 7.3, 10.0, 0.07),
        pub lower_leg: Link = link(0.40, 3.4, 10.0, 0.045),
        /// The bar between the hips; its length is sideways.
        pub waist: Bar = Bar { length: 0.27, mass: 2.0, radius: 0.05 },
        pub foot: Foot = Foot { height: 0.07, mass: 1.3, damping: 10.0, toe: 0.18, heel: 0.08, width: 0.09 },
        /// Distance of each shoulder from the middle plane (assumed).
        pub shoulder: f64 [0.02, 0.6, "m"] = 0.20,
    }
}

fn link(length: f64, mass: f64, damping: f64, radius: f64) -> Link {
    Link {
        length,
        mass,
        damping,
        radius,
    }
}

impl Body {
    /// Sum of all 17 masses [kg]; 64.2 by default, as in Table 1.
    pub fn mass(&self) -> f64 {
        let trunk = self.head.mass + self.upper_body.mass + self.middle_body.mass;
        let arm = self.upper_arm.mass + self.lower_arm.mass + self.hand.mass;
        let leg = self.upper_leg.mass + self.lower_leg.mass + self.foot.mass;
        trunk + self.lower_body.mass + self.waist.mass + 2.0 * (arm + leg)
    }

    /// Height of the upright robot [m]; 1.70 by default, as in Table 1.
    pub fn height(&self) -> f64 {
        let legs = self.foot.height + self.lower_leg.length + self.upper_leg.length;
        legs + self.lower_body.length
            + self.middle_body.length
            + self.upper_body.length
            + self.head.length
    }
}
