//! The body: Table 1 of the paper, and every size that the paper leaves open.

use serde::{Deserialize, Serialize};

/// One kind of link. Length, mass and damping are Table 1's; the radius is assumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// l_i, distance from its joint to the next [m], 0.02 to 2.
    pub length: f64,
    /// m_i [kg], 0.01 to 200.
    pub mass: f64,
    /// d_i, viscous friction of its joint, for the legs the upper one [N m s/rad], 0 to 1000.
    pub damping: f64,
    /// Radius of the uniform rod that stands for it [m], 0.005 to 0.5 (assumed).
    pub radius: f64,
}

/// The waist: a link whose joints are the hips, which have the damping of the upper legs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// [m], 0.02 to 2.
    pub length: f64,
    /// [kg], 0.01 to 200.
    pub mass: f64,
    /// [m], 0.005 to 0.5 (assumed).
    pub radius: f64,
}

/// The foot: Table 1 gives its height, mass and damping; the sole's size is assumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foot {
    /// Height of the ankle above the sole, l_i [m], 0.01 to 0.3.
    pub height: f64,
    /// m_i [kg], 0.01 to 200.
    pub mass: f64,
    /// d_i of the ankle [N m s/rad], 0 to 1000.
    pub damping: f64,
    /// The sole's front end ahead of the ankle [m], 0.02 to 0.6 (assumed).
    pub toe: f64,
    /// The sole's rear end behind the ankle [m], 0.02 to 0.6 (assumed).
    pub heel: f64,
    /// Width of the box that stands for it [m], 0.02 to 0.3 (assumed).
    pub width: f64,
}

/// All sizes of the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Joints have the viscous friction d_i of their links.
    pub joint_damping: bool,
    pub head: Link,
    pub upper_body: Link,
    pub middle_body: Link,
    pub lower_body: Link,
    pub upper_arm: Link,
    pub lower_arm: Link,
    pub hand: Link,
    /// The bar between the hips; its length runs sideways.
    pub waist: Bar,
    pub upper_leg: Link,
    pub lower_leg: Link,
    pub foot: Foot,
    /// Distance of each shoulder from the middle plane [m], 0.02 to 0.6 (assumed).
    pub shoulder: f64,
}

impl Default for Body {
    fn default() -> Self {
        let link = |length, mass, damping, radius| Link {
            length,
            mass,
            damping,
            radius,
        };
        Self {
            joint_damping: true,
            head: link(0.24, 4.5, 0.5, 0.08),
            upper_body: link(0.41, 21.5, 10.0, 0.13),
            middle_body: link(0.1, 2.0, 10.0, 0.11),
            lower_body: link(0.1, 2.0, 10.0, 0.11),
            upper_arm: link(0.31, 2.3, 0.03, 0.04),
            lower_arm: link(0.24, 1.4, 1.0, 0.035),
            hand: link(0.18, 0.4, 2.0, 0.025),
            waist: Bar {
                length: 0.27,
                mass: 2.0,
                radius: 0.05,
            },
            upper_leg: link(0.38, 7.3, 10.0, 0.07),
            lower_leg: link(0.40, 3.4, 10.0, 0.045),
            foot: Foot {
                height: 0.07,
                mass: 1.3,
                damping: 10.0,
                toe: 0.18,
                heel: 0.08,
                width: 0.09,
            },
            shoulder: 0.20,
        }
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
