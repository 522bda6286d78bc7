//! Velocities along the ice that change at an instant, without any impact.

use crate::{
    contact::equations::Y,
    error::EndCause,
    events::{Passage, REST, moving},
    model::{
        contact_mode::{Foot, Mode},
        controller_state::Phase,
        state::State,
    },
    scene::ContactLaw,
};

impl Passage<'_> {
    /// Find how the feet go on after a kick: those that move along the ice slide that way.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn kick(&mut self) -> Result<(), EndCause> {
        let phase = Phase::of(self.state.mode);
        let State { q, v, mode, .. } = *self.state;
        self.eval.move_planar(self.model, mode, &q, &v);
        let turned = |foot: Foot, speed: f64| match self.model.friction.grip(speed, REST) {
            grip if grip == foot.grip => foot,
            grip => Foot::new(foot.touch, grip),
        };
        let mut near = Mode {
            support: turned(mode.support, v[0]),
            free: turned(mode.free, self.eval.point_velocity[Y]),
        };
        if self.model.scene.contact.law == ContactLaw::PushOnly {
            near = self.with_resting_ends(near);
        }
        self.choose(near, [moving(near.support), moving(near.free)], None)?;
        self.note_phase(phase);
        Ok(())
    }
}
