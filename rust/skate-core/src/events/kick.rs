//! Velocities along the ice that change at an instant, without any impact.

use crate::{
    contact::equations::Y,
    error::Termination,
    events::{EventHandler, REST, moving},
    model::{
        contact_mode::{ContactMode, Foot},
        controller_state::Phase,
        state::State,
    },
};

impl EventHandler<'_> {
    /// Find how the feet go on after a kick: those that move along the ice slide that way.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn kick(&mut self) -> Result<(), Termination> {
        let phase = Phase::of(self.state.mode);
        let State { q, v, mode, .. } = *self.state;
        self.eval.move_planar(self.model, mode, &q, &v);
        let turned = |foot: Foot, speed: f64| match self.model.friction.mode_at(speed, REST) {
            friction_mode if friction_mode == foot.friction_mode => foot,
            friction_mode => Foot::new(foot.touch, friction_mode),
        };
        let mut near = ContactMode {
            support: turned(mode.support, v[0]),
            free: turned(mode.free, self.eval.point_velocity[Y]),
        };
        if self.model.contact.is_unilateral() {
            near = self.with_resting_ends(near);
        }
        self.choose(near, [moving(near.support), moving(near.free)], None)?;
        self.note_phase(phase);
        Ok(())
    }
}
