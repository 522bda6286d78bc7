//! Points of the robot that events, observations, rewards and time steps need: the ends of the soles, the head, the
//! centre of mass.

use crate::{
    dynamics::{
        centre_of_mass::{CentreOfMass, InnerMotion},
        kinematics::Kinematics,
    },
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SUPPORT, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, LOWER_LEG, WAIST},
        state::State,
    },
    numeric::scalar::Scalar,
};

/// Positions and velocities of these points. Arrays are indexed by foot, `SUPPORT` and `FREE`, then by end,
/// heel and toe.
#[derive(Debug, Clone, Copy, Default)]
pub struct SolePoints<T = f64> {
    /// Heights of the ends of the soles above the ice [m].
    pub gaps: [[T; 2]; 2],
    /// Their velocities along y and z [m/s].
    pub speeds: [[[T; 2]; 2]; 2],
    /// Top of the head from O [m].
    pub head: [T; 3],
    /// y of the waist and of the supporting ankle, from O [m].
    pub waist: T,
    pub ankle: T,
    /// `fall_margin`, infinity in a scene without falls [m].
    pub above_fall: T,
    /// Zero but between time steps of fixed lengths; its angular momentum is that of a flight.
    pub centre: CentreOfMass<T>,
}

/// Heights of heel and toe of the supporting foot above the ice, the pivot being at `z0` [m]; `on_heel` where
/// the heel is the pivot.
#[inline(always)]
pub fn support_gaps<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    on_heel: T::Mask,
    z0: T,
) -> [T; 2] {
    let rise = models.number(|m| m.sole.length()) * kin.sin_cos[0].0;
    [
        T::select(on_heel, z0, z0 - rise),
        T::select(on_heel, z0 + rise, z0),
    ]
}

/// Height of the head above its limit, or of the lowest knee or ankle above the ice if that is less [m].
#[inline(always)]
pub fn fall_margin<T: Scalar>(
    models: impl ModelLanes<T>,
    kin: &Kinematics<T>,
    head: T,
    z0: T,
) -> T {
    let mut lowest = T::of(f64::INFINITY);
    for &b in models.shape().fall_joints {
        lowest = kin.p[b].z.simd_min(lowest);
    }
    let height = models.number(|m| m.fall_height);
    (z0 + head - height).simd_min(z0 + lowest)
}

impl<T: Scalar> SolePoints<T> {
    /// From `Kinematics::frames` and `planar_velocities`; O is at the height `z0`, and the heel is the
    /// supporting foot's pivot where `on_heel` is set.
    #[inline(always)]
    pub fn of(models: impl ModelLanes<T>, kin: &Kinematics<T>, on_heel: T::Mask, z0: T) -> Self {
        let model = models.shape();
        let ends = [End::Heel, End::Toe].map(|end| models.number(|m| m.sole.ahead_of_ankle(end)));
        let zero = T::zero();
        let mut sole_points = Self {
            gaps: [[zero; 2]; 2],
            speeds: [[[zero; 2]; 2]; 2],
            head: [zero; 3],
            waist: zero,
            ankle: zero,
            above_fall: zero,
            centre: CentreOfMass::zero(),
        };
        for (foot, body) in [(SUPPORT, 0), (FREE, FREE_FOOT)] {
            for (end, along) in ends.into_iter().enumerate() {
                let at = kin.sole_point_of(models, body, along);
                let (v, w) = (&kin.v[body], kin.w[body].x);
                sole_points.speeds[foot][end] = [v.y - w * at.z, v.z + w * at.y];
                if foot == FREE {
                    sole_points.gaps[foot][end] = z0 + at.z;
                }
            }
        }
        sole_points.gaps[SUPPORT] = support_gaps(models, kin, on_heel, z0);
        let head = kin.head(models);
        sole_points.head = [head[0], head[1], head[2]];
        (sole_points.waist, sole_points.ankle) = (kin.p[WAIST].y, kin.p[LOWER_LEG].y);
        sole_points.above_fall = T::of(f64::INFINITY);
        if model.scene.fall.is_some() {
            sole_points.above_fall = fall_margin(models, kin, head.z, z0);
        }
        sole_points
    }
}

impl<T: Scalar> SolePoints<T> {
    /// Copy one lane, as `Solution::lane_to`.
    #[inline(always)]
    pub fn lane_to(&self, i: usize, sole_points: &mut SolePoints) {
        for foot in 0..2 {
            for end in 0..2 {
                sole_points.gaps[foot][end] = self.gaps[foot][end].lane(i);
                for axis in 0..2 {
                    sole_points.speeds[foot][end][axis] = self.speeds[foot][end][axis].lane(i);
                }
            }
        }
        for axis in 0..3 {
            sole_points.head[axis] = self.head[axis].lane(i);
        }
        (sole_points.waist, sole_points.ankle) = (self.waist.lane(i), self.ankle.lane(i));
        sole_points.above_fall = self.above_fall.lane(i);
        let (from, to) = (&self.centre, &mut sole_points.centre);
        for axis in 0..2 {
            to.at[axis] = from.at[axis].lane(i);
            to.velocity[axis] = from.velocity[axis].lane(i);
        }
        to.spin = from.spin.lane(i);
    }
}

impl SolePoints {
    /// Points of one robot, without the centre of mass.
    pub fn of_one(model: &Model, kin: &Kinematics, mode: ContactMode, z0: f64) -> Self {
        Self::of(model, kin, mode.support.touch.pivot() == End::Heel, z0)
    }

    /// All points that the next step from a state needs.
    pub fn of_state(model: &Model, kin: &Kinematics, state: &State) -> Self {
        let State { q, v, mode, .. } = state;
        let mut sole_points = Self::of_one(model, kin, *mode, q[1]);
        if !model.scheme.locates_events() {
            sole_points.centre = InnerMotion::of(model, kin, v, mode.is_flight()).with_root(v);
        }
        sole_points
    }

    /// Height of an end of a sole [m].
    pub fn gap(&self, which: usize, end: End) -> f64 {
        self.gaps[which][end as usize]
    }

    /// Ends of the soles for which `closed(height, vertical velocity)` is true.
    pub fn closed_ends(
        &self,
        model: &Model,
        closed: impl Fn(f64, f64) -> bool,
    ) -> (SoleContact, SoleContact) {
        let of = |which: usize| {
            let [heel, toe] =
                [0, 1].map(|end| closed(self.gaps[which][end], self.speeds[which][end][1]));
            SoleContact::of(heel, toe)
        };
        let free = match model.contact.free_foot_touches {
            true => of(FREE),
            false => SoleContact::Air,
        };
        (of(SUPPORT), free)
    }
}
