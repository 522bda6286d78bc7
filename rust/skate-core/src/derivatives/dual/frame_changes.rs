//! Derivatives of the operations of events that need kinematics only, by the operations themselves on dual numbers.

use crate::{
    derivatives::{
        dual::{Varied, evaluation::update},
        variation::Variation,
    },
    events::trace::Record,
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        lanes::ModelLanes,
        layout::{FREE_FOOT, reverse_legs},
    },
    numeric::{dual::Dual, trig::sin_cos_of},
    rhs::{Evaluation, Stance},
};
use nalgebra::Vector3;

/// The state at an event, with a workspace.
pub struct FrameChange<'a> {
    pub models: Varied<'a>,
    pub eval: &'a mut Evaluation<Dual<f64>>,
    pub state: &'a mut Variation<f64>,
}

impl FrameChange<'_> {
    /// Apply one of these operations; others have no effect.
    pub fn apply(&mut self, record: &Record) {
        match *record {
            Record::MovePivot { from, to } => self.move_pivot(from, to),
            Record::Swap(mode, support) => self.swap(mode, support),
            Record::ZeroConstrained(mode) => self.zero_constrained(mode),
            Record::SetAnchor(mode) => self.set_anchor(mode),
            _ => {}
        }
    }

    /// See `events::leg_swap::move_pivot`.
    fn move_pivot(&mut self, from: SoleContact, to: SoleContact) {
        let (from, to) = (from.pivot(), to.pivot());
        if from == to {
            return;
        }
        let Variation { q, v, .. } = &mut *self.state;
        let along: Dual<f64> = self
            .models
            .number(|m| m.sole.ahead_of_ankle(to) - m.sole.ahead_of_ankle(from));
        let (s, c) = sin_cos_of(q[2]);
        q[0] += along * c;
        q[1] += along * s;
        v[0] -= along * s * v[2];
        v[1] += along * c * v[2];
    }

    /// See `events::leg_swap::swap`; `mode` is that before the swap, `support` the foot in its new role.
    fn swap(&mut self, mode: ContactMode, support: Foot) {
        let models = self.models;
        self.update(mode);
        let kin = &self.eval.kin;
        let along = models.number(|m| m.sole.ahead_of_ankle(support.touch.pivot()));
        let at = kin.sole_point(models, along);
        let velocity = kin.point_velocity(FREE_FOOT, &Vector3::new(Dual::default(), at.y, at.z));
        let Variation { q, v, residual, .. } = &mut *self.state;
        (q[0], q[1]) = (q[0] + at.y, q[1] + at.z);
        (v[0], v[1]) = (velocity.y, velocity.z);
        (q[2], v[2]) = (kin.angle[FREE_FOOT], kin.w[FREE_FOOT].x);
        for x in [q, v, residual] {
            reverse_legs(x);
        }
    }

    /// Constrained coordinates and velocities of the supporting foot are zero.
    fn zero_constrained(&mut self, mode: ContactMode) {
        let (q, v) = (&mut self.state.q, &mut self.state.v);
        let zero = Dual::default();
        if mode.support.touch == SoleContact::Air {
            return;
        }
        (q[1], v[1]) = (zero, zero);
        if mode.support.touch == SoleContact::Flat {
            (q[2], v[2]) = (zero, zero);
        }
        if !mode.support.slides() {
            v[0] = zero;
        }
    }

    /// The anchor of a foot that begins to stick.
    fn set_anchor(&mut self, mode: ContactMode) {
        self.update(mode);
        let along = Stance::of(self.models, mode).ankle_to_point;
        let point = self.eval.kin.sole_point(self.models, along);
        self.state.anchor = self.state.q[0] + point.y;
    }

    /// Kinematics at the present state in the frame of `mode`.
    fn update(&mut self, mode: ContactMode) {
        update(self.eval, self.models, mode, (&self.state.q, &self.state.v));
    }
}
