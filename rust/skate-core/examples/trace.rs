use skate_core::{model::Model, scene::Scene, sim::Simulation};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut scene = Scene::from_toml(&std::fs::read_to_string(&a[1]).unwrap()).unwrap();
    scene.accuracy = serde_json::from_str(&a[2]).unwrap();
    let until: f64 = a[3].parse().unwrap();
    let mut sim = Simulation::new(Model::compile(&scene).unwrap()).unwrap();
    println!(
        "start {} v {:?} q {:?}",
        sim.state.mode.name(),
        &sim.state.v[..3],
        &sim.state.q[..3]
    );
    for e in sim.take_events() {
        println!("{:?}", e);
    }
    while sim.ended.is_none() && sim.state.t < until {
        let next = sim.state.t + 0.002;
        sim.advance(next);
        println!(
            "t {} {} v {:?} q {:?} gaps {:?} {:?}",
            sim.state.t,
            sim.state.mode.name(),
            &sim.state.v[..3],
            &sim.state.q[..3],
            sim.eval
                .gaps(&sim.model, sim.state.mode.support.touch, sim.state.q[1]),
            sim.ended
        );
    }
}
