//! Quantities of the present state, statistics and logs.

use crate::{
    control::{self, ControllerInput},
    dynamics::bias_forces::energy,
    model::{layout::NV, state::State},
    rhs::Evaluation,
    sim::{
        Event, Simulation,
        gait_statistics::{GaitStep, Totals},
    },
};

impl Simulation {
    /// Torques of the baseline controller at the present state [N m].
    pub fn baseline(&self) -> [f64; NV] {
        let State { q, v, mode, .. } = &self.state;
        let mut eval = self.eval.clone();
        eval.set_configuration(&self.model, mode.support.touch, q, v);
        control::baseline(
            &self.model,
            &mut eval.kin,
            v,
            q,
            &ControllerInput::of(&self.state),
        )
    }

    /// Position of the top of the head in the world [m].
    pub fn head(&self) -> [f64; 3] {
        let [x, y, z] = self.sole_points.head;
        [x, y + self.state.q[0], z + self.state.q[1]]
    }

    /// Totals since the start or the last `reset_totals`.
    pub fn totals(&self) -> &Totals {
        &self.monitor.totals
    }

    /// Restart the totals at the present state.
    pub fn reset_totals(&mut self) {
        self.monitor.totals = Totals::new(&self.state);
    }

    /// Time since the load last passed to the other leg, or since the totals began [s].
    pub fn since_step(&self) -> f64 {
        self.state.t - self.monitor.totals.transferred
    }

    /// Time since the last change of the contact mode or the supporting leg [s].
    pub fn since_event(&self) -> f64 {
        self.state.t - self.monitor.changed
    }

    /// End of the present action period [s]; periods are counted from t = 0.
    pub fn next_action_time(&self) -> f64 {
        let period = self.model.scene.control.action_period;
        ((self.state.t / period).round() + 1.0) * period
    }

    /// Evaluation with the kinematics of all bodies at the present state, for energy, momentum and drawing.
    /// A time step does not compute the arms in world axes.
    pub fn full_kinematics(&self) -> Evaluation {
        let mut eval = self.eval.clone();
        let State { q, v, mode, .. } = &self.state;
        eval.full_kinematics(&self.model, mode.support.touch, q, v);
        eval
    }

    /// Kinetic plus potential energy [J]; the ice is the zero of height.
    pub fn energy(&self) -> f64 {
        self.energy_of(&self.full_kinematics())
    }

    /// Energy at an evaluation with full kinematics [J].
    pub(super) fn energy_of(&self, eval: &Evaluation) -> f64 {
        let State { q, v, .. } = &self.state;
        let (kinetic, potential) = energy(&self.model, &eval.kin, v, q[1]);
        kinetic + potential
    }

    /// Error of the energy balance: unaccounted energy [J]; 0 if the scene has no energy balance.
    pub fn energy_residual(&self) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        self.energy() - self.state.energy_balance.total()
    }

    /// Events since the last call, at most the last `LOG_CAPACITY`.
    pub fn take_events(&mut self) -> Vec<Event> {
        self.events.take()
    }

    /// Gait steps completed since the last call, at most the last `LOG_CAPACITY`.
    pub fn take_records(&mut self) -> Vec<GaitStep> {
        self.records.take()
    }
}
