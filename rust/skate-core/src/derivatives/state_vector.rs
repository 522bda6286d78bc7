//! The differentiated state as a vector.

use crate::{
    derivatives::variation::state_size,
    error::{Invalid, Termination},
    model::state::{State, check_finite},
    rhs::projection::project,
    sim::{Coordinates, Simulation},
};

impl Simulation {
    /// The differentiated state: q and v of `Coordinates`, anchor, t0, t1, t2.
    pub fn state_vector(&self) -> Vec<f64> {
        let (n, state) = (self.model.n, &self.state);
        let controller = &state.controller;
        let mut x = Vec::with_capacity(state_size(n));
        let Coordinates { q, v } = self.coordinates();
        x.extend_from_slice(&q[..n]);
        x.extend_from_slice(&v[..n]);
        x.extend([state.anchor, controller.t0, controller.t1, controller.t2]);
        x
    }

    /// Add `dx` to the differentiated state and project it onto the constraints of the present mode. The mode and
    /// the time do not change. The simulation may terminate; see `ended`.
    ///
    /// # Errors
    /// `Invalid` where an entry leaves [-1e6, 1e6]; then nothing has changed.
    pub fn displace(&mut self, dx: &[f64]) -> Result<(), Invalid> {
        if self.ended.is_some() {
            return Ok(());
        }
        let displaced = self.state_vector().into_iter().zip(dx);
        let displaced: Vec<f64> = displaced.map(|(x, dx)| x + dx).collect();
        check_finite("state + dx", &displaced)?;
        let n = self.model.n;
        let Coordinates { mut q, mut v } = self.coordinates();
        for c in 0..n {
            q[c] += dx[c];
            v[c] += dx[n + c];
        }
        let at = self.at_pivot(&q, &v);
        let state = &mut self.state;
        (state.q, state.v) = (at.q, at.v);
        let controller = &mut state.controller;
        let memory = [
            &mut state.anchor,
            &mut controller.t0,
            &mut controller.t1,
            &mut controller.t2,
        ];
        for (x, dx) in memory.into_iter().zip(&dx[2 * n..]) {
            *x += dx;
        }
        let State { q, v, mode, .. } = state;
        mode.support.zero_constrained(q, v);
        self.ended = self.settle().err();
        self.observe_beginning();
        self.update_counters();
        Ok(())
    }

    /// Project the state and evaluate.
    fn settle(&mut self) -> Result<(), Termination> {
        self.begin_mode()?;
        // A projection has the metric of the state before; the second leaves nothing to the first step.
        for _ in 0..2 {
            if project(&self.model, &mut self.eval, &mut self.state)? {
                self.begin_mode()?;
            }
        }
        Ok(())
    }
}
