//! Time stepping with impulses after Moreau (1988): accuracy `fast`, method `moreau`.
//!
//! A step has a given length, and contacts act in it by impulses. Without events the method has order 2. Joint friction
//! and the forces on the head are implicit, so that large coefficients do not limit the step. One step of length h from
//! (q, v), in `step::moreau_step`:
//!
//! 1. Midpoint: q_m = q + h/2 v. All terms that depend on positions are evaluated once, at q_m (midpoint rule).
//! 2. Factor M + h/2 D by the articulated-body algorithm (Featherstone 2008, section 7.3). D is the joint friction,
//!    which acts on the mean of old and new velocities. The diagonal also has the stabilizers' slopes by the turn of
//!    their own joint, h/2 D_s + h^2/4 K_s.
//! 3. Visual lifting (K_p) and head damping (D_h) act on the means of old and new positions and velocities of the
//!    head, too. Their linearisation extends the matrix to M + h/2 D + J^T (h/2 D_h + h^2/4 K_p) J.
//! 4. Open-loop torques, Eqs. 16 to 22, at the middle of the step.
//! 5. Torques and bias forces at q_m. The first iteration uses v, the second the mean of v and the v' of the first.
//!    In the second, tau7 of Eq. 21 is the mean over the controller samples within the step.
//! 6. Contact problem: articulated inertia S of the root, Delassus matrix W of the free foot, and the right-hand sides
//!    for velocities at the end of the step (`contact::equations`).
//! 7. Impulses. The contact mode follows from the signs of impulses and new velocities (Signorini's and Coulomb's
//!    laws), which satisfy the contact constraints at the end of the step. A foot on which friction would do work, because
//!    it reverses, has none in this step: `step_contacts::driving_friction`.
//! 8. New velocities v' from the impulses. Repeat once from 5.
//! 9. New positions q' = q_m + h/2 v', and the energy balance with the mean velocities.
//! 10. Project q' onto the constraints of the free foot (Eich 1993).
//! 11. Restore the momentum: `momentum`. Update sole points and mean forces.
//!
//! Around a step:
//!
//! - `step_length`: steps are shorter if the legs move quickly, if both feet are on the ice in push-only contact, and
//!   after a jump of the torques. A step that turns a joint by more than 0.3 rad is void and repeated with a quarter of
//!   the length.
//! - `trial_steps`: if the impulses open a contact, the step is repeated in the new contact mode. A landing is located
//!   and ends the step. In two-way contact a release does so, too. Other changes of the contact mode take effect at
//!   the end of the step.
//! - `driver`: the sequence of steps up to a given time. The controller samples between two steps.
//!
//! Slow feet are not captured; friction brings them to rest.
//!
//! Moreau, J. J. (1988): Push-only contact and dry friction in finite freedom dynamics. In: Nonsmooth Mechanics and
//! Applications, CISM Courses and Lectures 302, Springer.

mod contact_changes;
pub(crate) mod driver;
mod momentum;
mod repetition;
pub(crate) mod step;
pub(crate) mod step_contacts;
mod step_length;
pub(crate) mod trial_steps;

use crate::{
    control::ControllerInput,
    error::Termination,
    model::{
        contact_mode::{ContactMode, touches},
        layout::NV,
        state::State,
    },
    numeric::{scalar::Scalar, simd::with_avx2},
    rhs::Stance,
    sim::Simulation,
};
pub(crate) use driver::StepDriver;
pub(crate) use repetition::{StepInputs, StepResult, repeat};
use step::{MoreauStep, moreau_step};
use step_contacts::StepContacts;
use trial_steps::StepRequest;

impl Simulation {
    /// Advance to the time `until` [s].
    pub(crate) fn advance_by_steps(&mut self, until: f64, mut go_on: impl FnMut() -> bool) {
        let mut driver = StepDriver::new(self, until);
        while (driver.in_step || go_on())
            && let Some(request) = driver.next_request(self)
        {
            let mode = self.compute_step(request);
            driver.process(self, mode);
        }
        driver.finish(self);
    }

    /// Compute the requested step and return the contact mode at its end. If other ends touch the ice than at the
    /// start, the state does not change.
    pub(crate) fn compute_step(
        &mut self,
        request: &StepRequest,
    ) -> Result<ContactMode, Termination> {
        let (start, h) = (&request.start, request.h);
        // Filled in place: an initialiser would be built elsewhere and copied.
        let mut step = MoreauStep::default();
        (step.h, step.residual) = (h, self.residual);
        (step.start.q, step.start.v, step.start.anchor) = (start.q, start.v, start.anchor);
        step.start.centre = request.centre;
        let energy_balance = &start.energy_balance;
        step.start.energies = [
            energy_balance.actuators,
            energy_balance.damping,
            energy_balance.friction,
        ];
        let stance = Stance::of(&*self.model, start.mode);
        let now = [midpoint_input(start, h)];
        let (modes, constraints) = ([start.mode], [request.constraint]);
        let mut contacts = StepContacts::new(&*self.model, &modes, &constraints);
        let eval = &mut self.eval;
        let stepped = with_avx2(
            #[inline(always)]
            || moreau_step(eval, &mut contacts, &mut step, &stance, &now),
        );
        let outcome = contacts.outcome(0);
        let result = stepped.then_some((&step, &step.end.q, &step.end.v));
        self.store_step(request, outcome, result, 0);
        outcome
    }

    /// Store the result of a step in a lane; `result` holds its positions and velocities separately.
    #[inline(always)]
    pub(crate) fn store_step<T: Scalar>(
        &mut self,
        request: &StepRequest,
        outcome: Result<ContactMode, Termination>,
        result: Option<(&MoreauStep<T>, &[f64; NV], &[f64; NV])>,
        lane: usize,
    ) {
        self.eval.count += 1;
        let (Some((step, q, v)), Ok(mode)) = (result, outcome) else {
            return;
        };
        if touches(mode) != touches(request.start.mode) {
            return;
        }
        let (state, end) = (&mut self.state, &step.end);
        state.t = request.start.t + request.h;
        state.mode = mode;
        // Separate assignments: for a pair the compiler builds a temporary.
        state.q = *q;
        state.v = *v;
        state.anchor = end.anchor.lane(lane);
        state.energy_balance.actuators = end.energies[0].lane(lane);
        state.energy_balance.damping = end.energies[1].lane(lane);
        state.energy_balance.friction = end.energies[2].lane(lane);
        step.forces.lane_to(lane, &mut self.eval.solution);
        step.sole_points.lane_to(lane, &mut self.sole_points);
    }
}

/// Input of the controller at the middle of a step.
pub(crate) fn midpoint_input(start: &State, h: f64) -> ControllerInput {
    ControllerInput {
        t: start.t + 0.5 * h,
        ..ControllerInput::of(start)
    }
}
