//! Motions under the check of all laws.

use skate_core::{laws::Law, sim::Simulation};

/// No law but those of `except` has been broken since `Simulation::check`.
pub fn assert_laws(sim: &Simulation, except: &[Law]) {
    for record in sim.broken_laws() {
        let name = &sim.model.scene.name;
        assert!(except.contains(&record.law), "scene {name}: {record:#?}");
    }
}
