//! The frame of an event: pivot, contact point and workspace move with the contacts.

use crate::{
    contact::equations::Slip,
    events::{EventHandler, leg_swap, observer::Operation},
    model::{
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact, touches},
        layout::reverse_legs,
        state::State,
    },
    rhs::{ankle_to_point, sole_points::SolePoints},
};

impl EventHandler<'_> {
    /// Set the mode: the pivot moves, and a free foot that alone touches the ice becomes the supporting foot.
    pub(super) fn set_mode(&mut self, mode: ContactMode) {
        let before = self.state.mode.free;
        self.move_pivot(mode.support.touch);
        self.state.mode = mode;
        if mode.support.touch == SoleContact::Air && mode.free.touch != SoleContact::Air {
            self.swap(mode.free);
            self.stop_new_support();
        } else {
            self.zero_constrained_coordinates();
        }
        if !mode.free.slides() && mode.free != before {
            self.set_anchor();
        }
    }

    /// The free foot becomes the supporting foot. A held torque stays on its physical joint.
    pub(super) fn swap(&mut self, support: Foot) {
        self.observe(Operation::Swap(self.state.mode, support));
        leg_swap::swap(self.model, self.eval, self.state, support, Foot::AIR);
        reverse_legs(self.residual);
        self.forces.swap(SUPPORT, FREE);
    }

    /// Move the pivot to that of the contact `to`.
    fn move_pivot(&mut self, to: SoleContact) {
        let from = self.state.mode.support.touch;
        self.observe(Operation::MovePivot { from, to });
        leg_swap::move_pivot(self.model, self.state, to);
    }

    /// Move state and workspace to the frame of `mode`'s contacts. `factor` follows where forces are needed.
    pub(super) fn update_frame(&mut self, mode: ContactMode) {
        self.move_pivot(mode.support.touch);
        let State { q, v, .. } = &*self.state;
        if self.frame == Some((touches(mode), *q)) {
            self.eval.set_velocities(self.model, mode, v);
            return;
        }
        self.eval.set_planar_configuration(self.model, mode, q, v);
        self.frame = Some((touches(mode), *q));
        self.unfactored = Some(mode.free.touch);
    }

    /// Set up the contact problem in the frame, if that is still to be done.
    pub(super) fn factor(&mut self) {
        if let Some(free) = self.unfactored.take() {
            self.eval.assemble(self.model, free);
        }
    }

    /// Set the supporting foot's constrained coordinates and velocities to zero exactly.
    pub(super) fn zero_constrained_coordinates(&mut self) {
        self.observe(Operation::ZeroConstrained(self.state.mode));
        let State { q, v, mode, .. } = &mut *self.state;
        mode.support.zero_constrained(q, v);
    }

    /// Stop the motion of feet on the ice against their constraints, which time steps of fixed length leave: it grows
    /// with the rates of the legs. Impulses without friction take energy only. To set the velocities of the root to zero
    /// would move the whole robot, and might add energy.
    pub(super) fn stop_feet(&mut self) {
        let mode = self.state.mode;
        if !self.model.scheme.locates_events()
            && let Ok(lost) = self.apply_impact_with(mode, Slip::default())
        {
            self.state.energy_balance.impacts += lost;
        }
    }

    /// The same for a foot that has just become the supporting one, which then rests exactly; the balance has the
    /// energy of what is left, less than the tolerances.
    pub(super) fn stop_new_support(&mut self) {
        self.stop_feet();
        let before = self.energy_in_frame();
        self.zero_constrained_coordinates();
        self.state.energy_balance.impacts += before - self.energy_in_frame();
    }

    /// Energy of the present state; 0 without an energy balance [J].
    fn energy_in_frame(&mut self) -> f64 {
        if !self.model.scene.energy_balance {
            return 0.0;
        }
        self.update_frame(self.state.mode);
        self.energy(self.state.q[1])
    }

    /// Store the position at which the free foot sticks.
    pub fn set_anchor(&mut self) {
        let State { q, v, mode, .. } = *self.state;
        self.observe(Operation::SetAnchor(mode));
        self.eval.set_leg_configuration(self.model, mode, &q, &v);
        let along = ankle_to_point(self.model, mode.free.touch);
        self.state.anchor = q[0] + self.eval.kin.sole_point(self.model, along).y;
    }

    /// Positions and velocities of the ends of the soles, for the velocities in `eval`.
    pub(super) fn sole_points(&self) -> SolePoints {
        let State { q, mode, .. } = &*self.state;
        SolePoints::of_one(self.model, &self.eval.kin, *mode, q[1])
    }

    /// The same after the event, when `eval` may be that of another configuration.
    pub fn sole_points_after(&mut self) -> SolePoints {
        let State { q, v, mode, .. } = &*self.state;
        if self.frame == Some((touches(*mode), *q)) {
            self.eval.kin.planar_velocities(self.model, v);
        } else {
            self.eval.set_planar_configuration(self.model, *mode, q, v);
        }
        SolePoints::of_state(self.model, &self.eval.kin, self.state)
    }
}
