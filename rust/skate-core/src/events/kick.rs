//! Kicks: instantaneous changes of the velocities along the ice, without impact.

use crate::{
    contact::equations::Y,
    error::Termination,
    events::{EventHandler, REST, sliding_mode},
    model::{
        contact_mode::{ContactMode, Foot},
        state::State,
    },
};

impl EventHandler<'_> {
    /// Select the mode after a kick: feet that move along the ice slide in that direction.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn kick(&mut self) -> Result<(), Termination> {
        let before = self.state.mode;
        let State { q, v, mode, .. } = *self.state;
        self.eval.set_planar_configuration(self.model, mode, &q, &v);
        let turned = |foot: Foot, speed: f64| match self.model.friction.mode_at(speed, REST) {
            friction_mode if friction_mode == foot.friction_mode => foot,
            friction_mode => Foot::new(foot.touch, friction_mode),
        };
        let mut next = ContactMode {
            support: turned(mode.support, v[0]),
            free: turned(mode.free, self.eval.point_velocity[Y]),
        };
        if self.model.contact.is_push_only {
            next = self.with_resting_ends(next);
        }
        let sliding = [sliding_mode(next.support), sliding_mode(next.free)];
        self.select_mode(next, sliding, None)?;
        self.update_phase(before);
        Ok(())
    }
}
