//! The robot as a hybrid system for external integrators: right-hand side, guards, reset map.

use crate::{
    control::sampled,
    error::{Invalid, Termination},
    events::{guard::Guard, guards::Guards},
    model::{contact_mode::SoleContact, layout::NV, state::State},
    rhs::{Evaluation, StepContext, projection::violation},
    sim::{Coordinates, Simulation},
};

impl Simulation {
    /// Second derivatives of the coordinates at the time `t` and these `Coordinates`, in the present contact mode with
    /// the present controller state.
    ///
    /// # Errors
    /// As `Evaluation::accelerations`.
    pub fn accelerations_at(
        &self,
        t: f64,
        q: &[f64; NV],
        v: &[f64; NV],
    ) -> Result<[f64; NV], Termination> {
        let at = self.at_pivot(q, v);
        let eval = self.evaluation_at(t, &at.q, &at.v)?;
        Ok(self.accelerations_of_toe((q[2], v[2]), &eval.qdd))
    }

    /// Second derivatives of the present coordinates; after termination, those of the last evaluation.
    pub fn accelerations(&self) -> [f64; NV] {
        let State { q, v, .. } = &self.state;
        self.accelerations_of_toe((q[2], v[2]), &self.evaluation().qdd)
    }

    /// Evaluation at a time and a state, with the pivot of the present contact mode.
    fn evaluation_at(
        &self,
        t: f64,
        q: &[f64; NV],
        v: &[f64; NV],
    ) -> Result<Evaluation, Termination> {
        let mut eval = self.eval.clone();
        let mut context = StepContext::of(&self.model, &self.state, &self.residual);
        context.now.t = t;
        eval.accelerations(&self.model, q, v, &context)?;
        Ok(eval)
    }

    /// Torques and accelerations at the present state; after termination, those of the last evaluation.
    pub fn evaluation(&self) -> Evaluation {
        let State { t, q, v, .. } = &self.state;
        if self.model.scheme.locates_events() {
            self.eval.clone()
        } else {
            // Time stepping evaluates at the middle of the step.
            self.evaluation_at(*t, q, v).unwrap_or(self.eval.clone())
        }
    }

    /// Guards of the present contact mode with their values at a time and `Coordinates`.
    ///
    /// # Errors
    /// As `accelerations_at`.
    pub fn guards_at(
        &self,
        t: f64,
        q: &[f64; NV],
        v: &[f64; NV],
    ) -> Result<Vec<(Guard, f64)>, Termination> {
        let (model, mode) = (&*self.model, self.state.mode);
        let Coordinates { q, v } = self.at_pivot(q, v);
        let eval = self.evaluation_at(t, &q, &v)?;
        let guards = Guards::of(model, mode);
        let values = guards.as_slice().iter();
        Ok(values
            .map(|guard| (*guard, guard.value(model, &eval, mode, (q[1], v[0]))))
            .collect())
    }

    /// Whether a controller sample at a time and `Coordinates` would change the controller state.
    pub fn controller_would_change(&self, t: f64, q: &[f64; NV], v: &[f64; NV]) -> bool {
        let state = State {
            t,
            q: *q,
            v: *v,
            ..self.state
        };
        sampled(&self.model, &state, state.free_foot_angle()) != state.controller
    }

    /// Set the time and the `Coordinates` and apply the event of the guard with the description `guard`; for None,
    /// sample the controller. An earlier time than the present one begins a gait step. The simulation may terminate; see
    /// `ended`.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if a number is not finite or the contact mode has no such guard.
    pub fn reset_map(
        &mut self,
        t: f64,
        q: &[f64; NV],
        v: &[f64; NV],
        guard: Option<&str>,
    ) -> Result<(), Invalid> {
        // Any finite value is allowed; the range is wider than that of a start.
        if let Some(x) = [t].iter().chain(q).chain(v).find(|x| !x.is_finite()) {
            return Err(Invalid(format!("reset_map to {x}: must be finite")));
        }
        let guards = Guards::of(&self.model, self.state.mode);
        let known = guards.as_slice().iter();
        let find = |name: &str| {
            let found = known.clone().find(|guard| guard.describe() == name);
            found.copied().ok_or_else(|| {
                let known: Vec<_> = known.clone().map(|guard| guard.describe()).collect();
                Invalid(format!("guard = \"{name}\": must be one of {known:?}"))
            })
        };
        let found = guard.map(find).transpose()?;
        if self.ended.is_some() {
            return Ok(());
        }
        self.budget.add_call();
        let Coordinates { q, v } = self.at_pivot(q, v);
        let back = t < self.state.t;
        (self.state.t, self.state.q, self.state.v) = (t, q, v);
        self.observe_beginning();
        let begun = self.begin_mode();
        if back {
            self.monitor.turn_back(&self.state, &self.sole_points);
        }
        let handled = begun.and_then(|()| match found {
            Some(guard) => self.handle_event(guard),
            None => {
                self.sample();
                self.resume()
            }
        });
        self.ended = handled.err();
        self.update_counters();
        Ok(())
    }

    /// Violation of the free foot's constraints [m, rad] and its rate [m/s, rad/s].
    pub fn violation(&self) -> (f64, f64) {
        if self.state.mode.free.touch == SoleContact::Air {
            return (0.0, 0.0);
        }
        let mut eval = self.eval.clone();
        let State { q, v, mode, .. } = &self.state;
        eval.set_planar_configuration(&self.model, *mode, q, v);
        let (gap, speed) = violation(&eval, &self.state);
        (gap.amax(), speed.amax())
    }
}
