//! Derivatives of position and velocity of a point of the free foot's sole.

use crate::{
    derivatives::{linear::loads::Chain, parameters::Slopes, variation::Variation},
    dynamics::kinematics::{Kinematics, PlanarPoint},
    model::layout::{LEG, NV},
    numeric::{dual::Dual, simd::Register},
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
