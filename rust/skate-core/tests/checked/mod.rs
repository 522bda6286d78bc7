//! Motions under the check of all laws.

use skate_core::sim::Simulation;

/// No law has been broken since `Simulation::check`.
pub fn assert_laws(sim: &Simulation) {
    let name = &sim.model.scene.name;
    if let Some(record) = sim.broken_laws().next() {
        panic!("scene {name}: {record:#?}");
    }
}
