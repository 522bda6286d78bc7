//! Kicks: instantaneous changes of the forward velocity.

use crate::{
    error::{Invalid, MessageNumber, Termination},
    model::{Model, state::State},
    rhs::sole_points::SolePoints,
    sim::Simulation,
};

/// Largest kick [m/s]; it exceeds the skating speed of all presets.
const MAX_KICK: f64 = 10.0;

/// Check that the argument `name` is a kick of at least `minimum` [m/s] that the model allows.
pub(crate) fn check_kick(
    name: &str,
    speed: f64,
    minimum: f64,
    model: &Model,
) -> Result<(), Invalid> {
    Invalid::range(name, speed, minimum, MAX_KICK, "m/s")?;
    if model.friction.sticks() && speed != 0.0 {
        return Err(Invalid(format!(
            "{name} = {}: must be 0 on sticking ice, where no foot can slide",
            MessageNumber(speed)
        )));
    }
    Ok(())
}

impl Simulation {
    /// Add `speed` [m/s] to the forward velocity of every body instantaneously. All joint rates are kept;
    /// feet on the ice slide in their new direction. No effect after termination.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, if the speed is outside -10 to 10 m/s or the feet stick to the
    /// ice.
    pub fn kick(&mut self, speed: f64) -> Result<(), Invalid> {
        check_kick("speed", speed, -MAX_KICK, &self.model)?;
        // Subnormal speeds count as zero, so that the result does not depend on flush-to-zero mode.
        if speed.abs() < f64::MIN_POSITIVE || self.ended.is_some() {
            return Ok(());
        }
        self.budget.add_call();
        self.ended = self.apply_kick(speed).err();
        self.update_counters();
        Ok(())
    }

    fn apply_kick(&mut self, speed: f64) -> Result<(), Termination> {
        if self.model.scene.energy_balance {
            let eval = self.full_kinematics();
            let (momentum, _) = eval.inertias.momentum(&self.model, &eval.kin);
            self.state.energy_balance.kicks +=
                speed * (momentum[0] + 0.5 * speed * self.model.mass());
        }
        self.state.v[0] += speed;
        self.observe_beginning();
        let (from, leg) = (self.state.mode, self.state.support_leg);
        self.event_handler().kick()?;
        let State { q, v, mode, .. } = &self.state;
        self.eval.set_planar_configuration(&self.model, *mode, q, v);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, *mode, q[1]);
        if (self.state.mode, self.state.support_leg) != (from, leg) {
            self.stats.events += 1;
            self.record_change("kick", from, leg);
        }
        self.sample();
        if self.model.scheme.locates_events() {
            self.resume()
        } else {
            self.begin_mode()
        }
    }
}
