//! Torque on the free knee towards an angle while the free leg swings; see `scene::Stabilizers::free_knee_pd`.

use crate::{
    control::joint::{FREE_KNEE, JointInput, JointTorque},
    model::{
        contact_mode::ContactMode,
        controller_state::{ControllerState, Phase},
        lanes::ModelLanes,
    },
    numeric::scalar::{Mask, Scalar},
};

/// Sample the phase.
#[inline(always)]
pub fn sample(mode: ContactMode, controller: &mut ControllerState) {
    controller.phase = Phase::of(mode);
}

/// Call `add` with the torque of term `i`, if the leg swings in a lane: states 1 to 4 at the last sample.
#[inline(always)]
pub fn torque<T: Scalar>(
    models: impl ModelLanes<T>,
    i: usize,
    input: &JointInput<'_, T>,
    mut add: impl FnMut(JointTorque<T>),
) {
    let phase = |lane: usize| input.now[lane].controller.phase;
    let swings = T::Mask::from_lanes(|lane| phase(lane) == Some(Phase::Swing));
    if swings.any() {
        let torque = JointTorque::pd(models, i, FREE_KNEE, input.motion(FREE_KNEE));
        add(torque.only(swings));
    }
}
