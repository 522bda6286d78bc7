//! Where the points are that events, observations and rewards ask for.

use crate::{
    dynamics::kinematics::Kinematics,
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SUPPORT, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, LOWER_LEG, WAIST},
    },
    numeric::scalar::Scalar,
};

/// See the module's documentation. Feet are `SUPPORT` and `FREE`, ends are heel and toe.
#[derive(Debug, Clone, Copy, Default)]
pub struct SolePoints<T = f64> {
    /// Heights of the ends of the soles above the ice [m].
    pub gaps: [[T; 2]; 2],
    /// Their velocities along y and z [m/s].
    pub speeds: [[[T; 2]; 2]; 2],
    /// Top of the head from O [m].
    pub head: [T; 3],
    /// Waist and supporting ankle, y from O [m].
    pub waist: T,
    pub ankle: T,
    /// Height of the head above its limit, or of the lowest knee or ankle above the ice if that is less [m];
    /// infinity where a scene knows no fall.
    pub above_fall: T,
}

impl<T: Scalar> SolePoints<T> {
    /// Needs `Kinematics::frames` and `planar_velocities`; O is at the height `z0`, and the supporting foot
    /// turns about its heel where `on_heel` says so.
    #[inline(always)]
    pub fn of(models: impl ModelLanes<T>, kin: &Kinematics<T>, on_heel: T::Mask, z0: T) -> Self {
        let model = models.shape();
        let ends = [
            models.number(|m| m.sole.heel),
            models.number(|m| m.sole.toe),
        ];
        let zero = T::zero();
        let mut sole_points = Self {
            gaps: [[zero; 2]; 2],
            speeds: [[[zero; 2]; 2]; 2],
            head: [zero; 3],
            waist: zero,
            ankle: zero,
            above_fall: zero,
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
        let rise = models.number(|m| m.sole.length()) * kin.sin_cos[0].0;
        sole_points.gaps[SUPPORT] = [
            T::select(on_heel, z0, z0 - rise),
            T::select(on_heel, z0 + rise, z0),
        ];
        let head = kin.head(models);
        sole_points.head = [head[0], head[1], head[2]];
        (sole_points.waist, sole_points.ankle) = (kin.p[WAIST].y, kin.p[LOWER_LEG].y);
        sole_points.above_fall = T::of(f64::INFINITY);
        if model.scene.fall.is_some() {
            let mut lowest = T::of(f64::INFINITY);
            for &b in model.fall_joints {
                lowest = kin.p[b].z.simd_min(lowest);
            }
            let height = models.number(|m| m.fall_height);
            sole_points.above_fall = (z0 + head.z - height).simd_min(z0 + lowest);
        }
        sole_points
    }
}

impl<T: Scalar> SolePoints<T> {
    /// Put those of a lane where they belong, as `Solution::lane_to`.
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
    }
}

impl SolePoints {
    /// Of one robot.
    pub fn of_one(model: &Model, kin: &Kinematics, mode: ContactMode, z0: f64) -> Self {
        Self::of(model, kin, mode.support.touch == SoleContact::Heel, z0)
    }

    /// Height of an end of a sole [m].
    pub fn gap(&self, which: usize, end: End) -> f64 {
        self.gaps[which][end as usize]
    }

    /// Ends of the soles that are closed by what their height and vertical speed say.
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
        let free = match model.contact.free_foot_touches() {
            true => of(FREE),
            false => SoleContact::Air,
        };
        (of(SUPPORT), free)
    }
}
