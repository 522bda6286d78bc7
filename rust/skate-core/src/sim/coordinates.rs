//! The coordinates that callers see: y0 and z0 are those of the supporting foot's toe in every contact mode.
//!
//! The state of a foot that stands on its heel alone has the heel as its pivot, whose constrained coordinates are zero.

use crate::{
    events::leg_swap::translate_pivot,
    model::{
        Model,
        contact_mode::{End, SoleContact},
        layout::NV,
        state::State,
    },
    numeric::trig::sin_cos_of,
    sim::Simulation,
};

/// Coordinates and velocities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// y0, z0 [m] of the toe, q1 and the joints [rad].
    pub q: [f64; NV],
    /// Their rates.
    pub v: [f64; NV],
}

/// Distance of the toe in front of the pivot [m].
pub fn toe_ahead(model: &Model, support: SoleContact) -> f64 {
    match support.pivot() {
        End::Heel => model.sole.length(),
        End::Toe => 0.0,
    }
}

/// x near `sum - part` with `x + part == sum`, if there is one.
fn other_part(sum: f64, part: f64) -> f64 {
    let x = sum - part;
    let near = [x, x.next_up(), x.next_down()];
    near.into_iter().find(|x| x + part == sum).unwrap_or(x)
}

impl Coordinates {
    /// The changes of y0, z0 and of their rates where the toe becomes the pivot.
    fn shift(self, model: &Model, support: SoleContact) -> Self {
        let mut shift = Self {
            q: [0.0; NV],
            v: [0.0; NV],
        };
        shift.v[2] = self.v[2];
        let along = toe_ahead(model, support);
        translate_pivot(along, sin_cos_of(self.q[2]), &mut shift.q, &mut shift.v);
        shift
    }

    /// From the state of a foot with this contact.
    pub fn of(mut self, model: &Model, support: SoleContact) -> Self {
        if support.pivot() == End::Heel {
            let shift = self.shift(model, support);
            for c in 0..2 {
                self.q[c] += shift.q[c];
                self.v[c] += shift.v[c];
            }
        }
        self
    }

    /// The inverse of `of`, up to rounding. `of` returns exactly what it has returned before.
    pub fn at_pivot(mut self, model: &Model, support: SoleContact) -> Self {
        if support.pivot() == End::Heel {
            let shift = self.shift(model, support);
            for c in 0..2 {
                self.q[c] = other_part(self.q[c], shift.q[c]);
                self.v[c] = other_part(self.v[c], shift.v[c]);
            }
        }
        self
    }
}

impl Simulation {
    /// The present coordinates, as `reset` takes them.
    pub fn coordinates(&self) -> Coordinates {
        let State { q, v, mode, .. } = self.state;
        Coordinates { q, v }.of(&self.model, mode.support.touch)
    }

    /// The state of these coordinates in the present contact mode.
    pub(crate) fn at_pivot(&self, q: &[f64; NV], v: &[f64; NV]) -> Coordinates {
        let given = Coordinates { q: *q, v: *v };
        given.at_pivot(&self.model, self.state.mode.support.touch)
    }

    /// Second derivatives of `coordinates` at q1 [rad] and its rate [rad/s], from those of the state.
    pub fn accelerations_of_toe(&self, (q1, rate): (f64, f64), qdd: &[f64; NV]) -> [f64; NV] {
        let along = toe_ahead(&self.model, self.state.mode.support.touch);
        let mut qdd = *qdd;
        if along != 0.0 {
            let ((s, c), turn) = (sin_cos_of(q1), rate * rate);
            qdd[0] -= along * (s * qdd[2] + c * turn);
            qdd[1] += along * (c * qdd[2] - s * turn);
        }
        qdd
    }
}
