//! Somebody pushes the robot.

use crate::{
    error::{Invalid, Shown, Termination},
    model::{Model, state::State},
    rhs::sole_points::SolePoints,
    scene::Way,
    sim::Simulation,
};

/// The hardest kick [m/s]: faster than any preset skates.
const MAX_KICK: f64 = 10.0;

/// Is the argument `name` a kick, of `minimum` at least, that a robot can be given?
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
            Shown(speed)
        )));
    }
    Ok(())
}

impl Simulation {
    /// Change the forward velocity of every body by `speed` [m/s], in no time. All joints keep their rates;
    /// feet on the ice slide on in their new directions. What has ended is left alone.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, where the speed is beyond -10 to 10 m/s, or the feet stick to
    /// the ice.
    pub fn kick(&mut self, speed: f64) -> Result<(), Invalid> {
        check_kick("speed", speed, -MAX_KICK, &self.model)?;
        // What some processors, told so, take for zero is none.
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
        let (from, leg) = (self.state.mode, self.state.support_leg);
        self.event_handler().kick()?;
        let State { q, v, mode, .. } = &self.state;
        self.eval.move_planar(&self.model, *mode, q, v);
        self.sole_points = SolePoints::of_one(&self.model, &self.eval.kin, *mode, q[1]);
        if (self.state.mode, self.state.support_leg) != (from, leg) {
            self.stats.events += 1;
            self.record_change("kick", from, leg);
        }
        self.sample();
        match self.model.scene.accuracy.way() {
            // The next step sees to what else follows.
            Way::TimeSteps { .. } => self.begin_mode(),
            Way::Events(_) => self.resume(),
        }
    }
}
