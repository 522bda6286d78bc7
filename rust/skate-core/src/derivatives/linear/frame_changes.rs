//! Derivatives of the operations of events that need kinematics only; see `events::leg_swap`.

use crate::{
    derivatives::{
        linear::{balance::sole_point, jacobian::Differentiator, loads::Chain},
        parameters::{Slopes, Varied},
        variation::Variation,
    },
    dynamics::kinematics::{Kinematics, PlanarPoint},
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact},
        layout::{FREE_FOOT, LEG, NV, reverse_legs},
    },
    numeric::{dual::Dual, scalar::Scalar, simd::Register, trig::sin_cos_of},
    rhs::ankle_to_point,
};
use nalgebra::Vector3;

/// A point of the free foot's sole at a state.
#[derive(Debug, Clone, Default)]
pub struct Point {
    pub chain: Chain,
    /// Change of its velocity per rotation of a joint, at given velocities of the joints.
    turning: [[f64; 2]; LEG],
    /// Changes of its position and of its velocity, y and z, by every parameter.
    by_parameter: Slopes<4>,
}

impl Point {
    /// `kin` has the velocities.
    pub fn of(kin: &Kinematics, point: PlanarPoint, by_parameter: Slopes<4>) -> Self {
        let chain = Chain::of(kin, point);
        let (mut turning, mut sum) = ([[0.0; 2]; LEG], [0.0; 2]);
        for c in (2..LEG).rev() {
            let (w, r) = (kin.w[c - 2].x, chain.link(c));
            sum = [sum[0] - w * r[0], sum[1] - w * r[1]];
            turning[c] = sum;
        }
        Self {
            chain,
            turning,
            by_parameter,
        }
    }

    /// Position [m] and rotation.
    #[inline(always)]
    pub fn position<R: Register>(&self, x: &Variation<R>) -> Vector3<R> {
        let mut sum = self.moved(|c| x.q[c].d);
        if let Some([y, z, ..]) = self.by_parameter.along::<R>(x.parameter) {
            sum += Vector3::new(y, z, R::zero());
        }
        sum
    }

    /// Velocity [m/s] and rate.
    #[inline(always)]
    pub fn velocity<R: Register>(&self, x: &Variation<R>) -> Vector3<R> {
        let mut sum = self.moved(|c| x.v[c].d);
        self.add_turning(&x.q, x.parameter, &mut sum);
        sum
    }

    /// Add the change of the velocity by a variation of the positions or of a parameter.
    #[inline(always)]
    pub fn add_turning<R: Register>(
        &self,
        q: &[Dual<R>; NV],
        parameter: Option<usize>,
        sum: &mut Vector3<R>,
    ) {
        for c in 2..LEG {
            for i in 0..2 {
                sum[i] += R::of(self.turning[c][i]) * q[c].d;
            }
        }
        if let Some([.., y, z]) = self.by_parameter.along::<R>(parameter) {
            sum[0] += y;
            sum[1] += z;
        }
    }

    #[inline(always)]
    fn moved<R: Register>(&self, of: impl Fn(usize) -> R) -> Vector3<R> {
        let mut sum = Vector3::new(of(0), of(1), R::zero());
        for c in 2..LEG {
            let ([y, z], by) = (self.chain.motion(c), of(c));
            sum[0] += R::of(y) * by;
            sum[1] += R::of(z) * by;
            sum[2] += by;
        }
        sum
    }
}

/// The pivot moves along the sole.
pub fn move_pivot<R: Register>(
    Varied { model, parameters }: Varied<'_>,
    (from, to): (SoleContact, SoleContact),
    states: &mut [&mut Variation<R>],
) {
    let (from, to) = (from.pivot(), to.pivot());
    if from == to {
        return;
    }
    let along = |model: &Model| model.sole.ahead_of_ankle(to) - model.sole.ahead_of_ankle(from);
    let by_parameter = parameters.slopes(|other| [along(other)]);
    R::with_target_features(
        #[inline(always)]
        || {
            for x in states {
                let (q, v) = (&mut x.q, &mut x.v);
                let mut along = Dual::of(along(model));
                if let Some([change]) = by_parameter.along::<R>(x.parameter) {
                    along.d = change;
                }
                let (s, c) = sin_cos_of(q[2]);
                q[0] += along * c;
                q[1] += along * s;
                v[0] -= along * s * v[2];
                v[1] += along * c * v[2];
            }
        },
    );
}

/// Constrained coordinates and velocities of the supporting foot are zero.
pub fn zero_constrained<R: Register>(mode: ContactMode, states: &mut [&mut Variation<R>]) {
    let touch = mode.support.touch;
    if touch == SoleContact::Air {
        return;
    }
    let zero = Dual::default();
    for x in states {
        (x.q[1], x.v[1]) = (zero, zero);
        if touch == SoleContact::Flat {
            (x.q[2], x.v[2]) = (zero, zero);
        }
        if !mode.support.slides() {
            x.v[0] = zero;
        }
    }
}

impl<R: Register> Differentiator<R> {
    /// The point of the free foot's sole at the distance `along` in front of the ankle, with its position and velocity
    /// (y, z, rotation) from O.
    fn sole_point(
        &mut self,
        Varied { model, parameters }: Varied<'_>,
        mode: ContactMode,
        along: impl Fn(&Model) -> f64,
        x: &Variation<R>,
    ) -> (Point, [[f64; 3]; 2]) {
        let (q, v) = (x.q.map(|q| q.x), x.v.map(|v| v.x));
        self.eval.set_leg_configuration(model, mode, &q, &v);
        let by_parameter = parameters
            .slopes(|other| sole_point(other, &mut self.varied, (mode, along(other)), (&q, &v)));
        let kin = &self.eval.kin;
        let at = kin.sole_point(model, along(model));
        let velocity = kin.point_velocity(FREE_FOOT, &Vector3::new(0.0, at.y, at.z));
        let position = [at.y, at.z, kin.angle[FREE_FOOT]];
        let velocity = [velocity.y, velocity.z, kin.w[FREE_FOOT].x];
        (Point::of(kin, at, by_parameter), [position, velocity])
    }

    /// The free foot becomes the supporting one; `mode` is that before, `support` the foot in its new role.
    pub fn swap(
        &mut self,
        varied: Varied<'_>,
        (mode, support): (ContactMode, Foot),
        states: &mut [&mut Variation<R>],
    ) {
        let Some(first) = states.first() else {
            return;
        };
        let along = |model: &Model| model.sole.ahead_of_ankle(support.touch.pivot());
        let (point, [position, velocity]) = self.sole_point(varied, mode, along, first);
        let y0 = first.q[0].x;
        let z0 = first.q[1].x;
        let origin = [y0, z0, 0.0];
        R::with_target_features(
            #[inline(always)]
            || {
                for x in states {
                    let (dq, dv) = (point.position(x), point.velocity(x));
                    for i in 0..3 {
                        x.q[i] = Dual {
                            x: origin[i] + position[i],
                            d: dq[i],
                        };
                        x.v[i] = Dual {
                            x: velocity[i],
                            d: dv[i],
                        };
                    }
                    reverse_legs(&mut x.q);
                    reverse_legs(&mut x.v);
                    reverse_legs(&mut x.residual);
                }
            },
        );
    }

    /// The contact point of a foot that begins to stick becomes the anchor.
    pub fn set_anchor(
        &mut self,
        varied: Varied<'_>,
        mode: ContactMode,
        states: &mut [&mut Variation<R>],
    ) {
        let Some(first) = states.first() else {
            return;
        };
        let along = |model: &Model| ankle_to_point(model, mode.free.touch);
        let (point, [position, _]) = self.sole_point(varied, mode, along, first);
        R::with_target_features(
            #[inline(always)]
            || {
                for x in states {
                    x.anchor = Dual {
                        x: x.q[0].x + position[0],
                        d: point.position(x).x,
                    };
                }
            },
        );
    }
}
