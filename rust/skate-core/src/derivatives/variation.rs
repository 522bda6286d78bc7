//! State with its derivatives along several directions.

use crate::{
    control::OpenLoop,
    model::{
        controller_state::ControllerState,
        layout::{NV, ROOT},
        state::State,
    },
    numeric::{dual::Dual, scalar::Scalar},
};

/// Size of the differentiated state of a model with `n` coordinates: q, v, the anchor of a stuck free foot, and
/// the times t0, t1 and t2 of the controller. What the controller samples is piecewise constant.
pub fn state_size(n: usize) -> usize {
    2 * n + 4
}

/// State and held torques with their derivatives. The time is varied, too: an event happens earlier or later.
#[derive(Debug, Clone)]
pub struct Variation<R> {
    pub t: Dual<R>,
    pub q: [Dual<R>; NV],
    pub v: [Dual<R>; NV],
    pub anchor: Dual<R>,
    /// t0, t1, t2.
    pub times: [Dual<R>; 3],
    pub residual: [Dual<R>; NV],
    /// The scene's parameter that varies along the first lane's direction, those of the other lanes following. None for
    /// directions of state and torques.
    pub parameter: Option<usize>,
}

impl<R: Scalar> Variation<R> {
    /// The state without derivatives.
    pub fn of(state: &State, residual: &[f64; NV]) -> Self {
        let zero = [Dual::default(); NV];
        let mut variation = Self {
            t: Dual::default(),
            q: zero,
            v: zero,
            anchor: Dual::default(),
            times: [Dual::default(); 3],
            residual: residual.map(Dual::of),
            parameter: None,
        };
        variation.set_values(state);
        variation
    }

    /// Replace the values and keep the derivatives.
    pub fn set_values(&mut self, state: &State) {
        self.t.x = state.t;
        for c in 0..NV {
            (self.q[c].x, self.v[c].x) = (state.q[c], state.v[c]);
        }
        self.anchor.x = state.anchor;
        let controller = &state.controller;
        for (time, x) in self
            .times
            .iter_mut()
            .zip([controller.t0, controller.t1, controller.t2])
        {
            time.x = x;
        }
    }

    /// Input of the open-loop torques. The sampled tau7 is constant.
    pub fn open_loop(&self, controller: &ControllerState) -> OpenLoop<Dual<R>> {
        OpenLoop::of(controller, self.t, self.times, Dual::of(controller.tau7))
    }

    /// Entry `i` of the differentiated state, then the held torques of the joints.
    pub fn entry(&mut self, n: usize, i: usize) -> &mut Dual<R> {
        match i {
            i if i < n => &mut self.q[i],
            i if i < 2 * n => &mut self.v[i - n],
            i if i == 2 * n => &mut self.anchor,
            i if i < 2 * n + 4 => &mut self.times[i - 2 * n - 1],
            i => &mut self.residual[ROOT + i - state_size(n)],
        }
    }

    /// Set the derivatives of lane `l` to a unit vector along entry `first + l`.
    pub fn seed(&mut self, n: usize, first: usize) {
        for lane in 0..R::LANES {
            let i = first + lane;
            if i < state_size(n) + n - ROOT {
                self.entry(n, i).d.set_lane(lane, 1.0);
            }
        }
    }
}
