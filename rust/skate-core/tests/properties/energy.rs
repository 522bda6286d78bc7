//! Energy balance.

use crate::strategies::{config, hold, scene, simulation, torque};
use proptest::prelude::*;
use skate_core::scene::{ContactLaw, Friction, PulledFriction};

proptest! {
    #![proptest_config(config(40))]

    /// For all torques the energy balance closes, and dissipation is never negative: joint friction,
    /// impacts, captures, and sliding friction of feet without tensile force.
    #[test]
    fn the_balance_closes_and_dissipation_is_positive(
        scene in scene(&[r#""reference""#]), torques in prop::collection::vec(torque(), 10),
    ) {
        let mut scene = scene;
        scene.energy_balance = true;
        let mut sim = simulation(&scene);
        // With the paper's two-way contact, friction on a foot with tensile force adds energy.
        let pushes = scene.contact.law == ContactLaw::PushOnly
            || scene.contact.pulled_friction == PulledFriction::None
            || !matches!(scene.ice.friction, Friction::Directional { .. } | Friction::Coulomb { .. });
        let mut size: f64 = 1.0;
        for torque in &torques {
            let before = sim.state.energy_balance;
            hold(&mut sim, torque);
            let until = sim.next_action_time();
            sim.advance(until);
            let after = sim.state.energy_balance;
            // Rounding error of the sum [J].
            let least = -1e-11 * size;
            prop_assert!(after.damping - before.damping >= least);
            // An impact includes the energy to lift the end out of the ice, by 1e-11 m at most.
            prop_assert!(after.impacts - before.impacts >= -1e-7, "{before:?} {after:?}");
            prop_assert!(after.capture - before.capture >= least, "{before:?} {after:?}");
            prop_assert!(!pushes || after.friction - before.friction >= least, "{before:?} {after:?}");
            size = size.max(after.total().abs()).max(after.actuators.abs()).max(after.impacts.abs());
            if sim.ended.is_some() {
                break;
            }
        }
        let residual = sim.energy_residual().abs() / size;
        // Measured at most 7e-12 of the energy.
        prop_assert!(residual < 1e-9, "{residual:e}");
    }
}
