//! Benchmark items on the scene `paper`.

use skate_core::{
    batch::{Autoreset, Batch},
    model::{
        Model,
        contact_mode::{ContactMode, Foot, SoleContact, TABLE_2, TableRow},
        friction::FrictionMode,
        layout::NV,
    },
    rhs::StepContext,
    scene::{Accuracy, Scene},
    sim::{Coordinates, Event, Simulation, Stats},
    task::{Start, Task, Weights},
};

const PAPER: &str = include_str!("../../../../skate_env/scenes/paper.toml");
/// Duration of the motion from which events are taken [s].
const SKATING: f64 = 10.0;
/// Number of environments at different phases of the gait; a larger batch repeats them.
const PHASES: usize = 64;
/// Standard deviation of the disturbance of starts.
const PERTURB: f64 = 0.01;
/// Parameters drawn per episode, with their ranges.
const DRAWN: [(&str, [f64; 2]); 5] = [
    ("body.head.mass", [4.0, 5.0]),
    ("body.upper_body.mass", [20.0, 23.0]),
    ("control.feedforward.scale", [0.9, 1.1]),
    ("ice.friction.mu_backward", [0.8, 1.0]),
    ("ice.friction.mu_forward", [0.1, 0.3]),
];

/// Runs the measured closure.
pub type Measure<'a> = &'a mut dyn FnMut(&mut dyn FnMut());

/// Benchmark item.
pub struct Item {
    pub name: String,
    /// Units of the measured operation per block.
    pub units: u32,
    /// Prepares a block and measures it once.
    pub block: Box<dyn FnMut(Measure)>,
}

pub fn all() -> Vec<Item> {
    let start = simulation("balanced");
    let mut items = vec![right_hand_side(
        &start,
        "air/air",
        ContactMode {
            support: Foot::AIR,
            free: Foot::AIR,
        },
    )];
    items.extend(TABLE_2.iter().map(|row| {
        let mode = mode(row);
        right_hand_side(&start, &format!("{} {}", row.number, mode.name()), mode)
    }));
    items.extend(["fast", "balanced", "reference"].map(step));
    items.push(event(
        "landing: impact, choice of mode",
        &start,
        "free heel lands",
    ));
    items.push(event("slip to stick", &start, "supporting foot slows down"));
    items.extend([reset(&start), snapshot(&start), restore(&start)]);
    items.extend(
        [
            ("", PERTURB, &[][..]),
            (", five numbers drawn", 0.0, &DRAWN),
        ]
        .map(episodes),
    );
    items.extend([64, 1024].map(batch));
    items
}

fn scene(accuracy: &str) -> Scene {
    let mut scene = Scene::from_toml(PAPER).expect("the preset");
    scene.accuracy = serde_json::from_value::<Accuracy>(accuracy.into()).expect("an accuracy");
    scene
}

fn simulation(accuracy: &str) -> Simulation {
    Simulation::new(Model::compile(&scene(accuracy)).expect("a model")).expect("a start")
}

/// Contact mode of a row of Table 2; a foot that rotates about an edge is on its toe.
fn mode(row: &TableRow) -> ContactMode {
    let touch = if row.q1 {
        SoleContact::Toe
    } else {
        SoleContact::Flat
    };
    let friction_mode = |slides: bool| {
        if slides {
            FrictionMode::Forward
        } else {
            FrictionMode::Stuck
        }
    };
    let free = match (row.f_nz, row.tau_n) {
        (false, _) => SoleContact::Air,
        (true, false) => SoleContact::Heel,
        (true, true) => SoleContact::Flat,
    };
    let mode = ContactMode {
        support: Foot::new(touch, friction_mode(row.y0)),
        free: Foot::new(free, friction_mode(!row.f_ny)),
    };
    assert_eq!(mode.number(), row.number);
    mode
}

/// Dependent evaluations with time steps too small to move the robot. All contact modes use the same
/// posture, because the cost does not depend on it.
fn right_hand_side(start: &Simulation, name: &str, mode: ContactMode) -> Item {
    const UNITS: u32 = 100;
    const STEP: f64 = 1e-12;
    let mut sim = start.clone();
    sim.state.mode = mode;
    let context = StepContext::of(&sim.model, &sim.state, &[0.0; NV]);
    let block = move |measure: Measure| {
        let (mut q, mut v) = (sim.state.q, sim.state.v);
        measure(&mut || {
            for _ in 0..UNITS {
                let done = sim.eval.accelerations(&sim.model, &q, &v, &context);
                done.expect("forces");
                for i in 0..sim.model.n {
                    q[i] += STEP * v[i];
                    v[i] += STEP * sim.eval.qdd[i];
                }
            }
        });
    };
    Item {
        name: format!("right-hand side, {name}"),
        units: UNITS,
        block: Box::new(block),
    }
}

/// Time steps of the first action period without an event.
fn step(accuracy: &str) -> Item {
    let (start, quiet) = first_quiet_period(simulation(accuracy));
    let until = start.next_action_time();
    let units = u32::try_from(quiet.steps - start.stats.steps).expect("some");
    let evaluations = quiet.evaluations - start.stats.evaluations;
    let block = move |measure: Measure| {
        let mut sim = start.clone();
        measure(&mut || sim.advance(until));
    };
    let each = evaluations as f64 / f64::from(units);
    Item {
        name: format!("step, {accuracy} ({each:.1} evaluations)"),
        units,
        block: Box::new(block),
    }
}

/// State before that period, and counters after it.
fn first_quiet_period(mut sim: Simulation) -> (Simulation, Stats) {
    while sim.state.t < SKATING {
        let before = sim.clone();
        sim.advance(sim.next_action_time());
        if sim.stats.events == before.stats.events {
            return (before, sim.stats);
        }
    }
    panic!("no quiet period within {SKATING} s")
}

/// Handling of an event, from the state right before it.
fn event(name: &str, start: &Simulation, what: &'static str) -> Item {
    const UNITS: u32 = 10;
    /// Time before the event [s].
    const EARLIER: f64 = 1e-9;
    let before = right_before(start.clone(), what, EARLIER);
    let block = move |measure: Measure| {
        let mut sims = vec![before.clone(); UNITS as usize];
        measure(&mut || {
            for sim in &mut sims {
                let (t, Coordinates { q, v }) = (sim.state.t, sim.coordinates());
                sim.reset_map(t, &q, &v, Some(what)).expect("a guard");
            }
        });
        assert!(
            sims.iter()
                .all(|sim| sim.ended.is_none() && sim.state.mode != before.state.mode)
        );
    };
    Item {
        name: format!("event, {name}"),
        units: UNITS,
        block: Box::new(block),
    }
}

fn right_before(mut sim: Simulation, what: &str, earlier: f64) -> Simulation {
    while sim.state.t < SKATING {
        let mut before = sim.clone();
        sim.advance(sim.next_action_time());
        let events = sim.take_events();
        let wanted = |event: &&Event| event.what == what && event.from != event.to;
        if let Some(event) = events.iter().find(wanted) {
            before.advance(event.t - earlier);
            return before;
        }
    }
    panic!("{what}: not within {SKATING} s")
}

fn reset(start: &Simulation) -> Item {
    const UNITS: u32 = 10;
    let mut sim = start.clone();
    let (q, v, leg) = (sim.state.q, sim.state.v, sim.state.support_leg);
    let block = move |measure: Measure| {
        measure(&mut || (0..UNITS).for_each(|_| sim.reset(&q, &v, leg).expect("a start")));
    };
    Item {
        name: "reset".into(),
        units: UNITS,
        block: Box::new(block),
    }
}

fn snapshot(start: &Simulation) -> Item {
    const UNITS: u32 = 10;
    let sim = start.clone();
    let block = move |measure: Measure| {
        measure(&mut || (0..UNITS).for_each(|_| drop(sim.snapshot())));
    };
    Item {
        name: "snapshot".into(),
        units: UNITS,
        block: Box::new(block),
    }
}

fn restore(start: &Simulation) -> Item {
    const UNITS: u32 = 10;
    let mut sim = start.clone();
    let saved = sim.snapshot();
    let block = move |measure: Measure| {
        measure(&mut || (0..UNITS).for_each(|_| sim.restore(&saved).expect("a snapshot")));
    };
    Item {
        name: "restore".into(),
        units: UNITS,
        block: Box::new(block),
    }
}

/// Starts of all episodes of a batch on one thread, with fixed seeds.
fn episodes((what, perturb, drawn): (&str, f64, &[(&str, [f64; 2])])) -> Item {
    const UNITS: usize = 64;
    let mut scene = scene("fast");
    let drawn = drawn.iter().map(|&(name, range)| (name.into(), range));
    scene.randomise = drawn.collect();
    let task = Task {
        perturb,
        ..task(scene)
    };
    let mut batch = Batch::new(task, UNITS, Autoreset::NextStep, Some(1)).expect("a batch");
    let start = |i| Start {
        seed: Some(i as u64),
        ..Start::default()
    };
    let starts: Vec<_> = (0..UNITS).map(|i| (i, start(i))).collect();
    let block = move |measure: Measure| {
        measure(&mut || batch.reset(&starts, &|| true).expect("starts"));
    };
    Item {
        name: format!("reset of an episode, perturb {perturb}{what}"),
        units: UNITS as u32,
        block: Box::new(block),
    }
}

fn task(scene: Scene) -> Task {
    Task::new(scene, vec![100.0; 16], Weights::default()).expect("a task")
}

/// One action of every environment on one thread, at all phases of the gait.
fn batch(n: usize) -> Item {
    let task = task(scene("fast"));
    let mut first =
        Batch::new(task.clone(), PHASES, Autoreset::NextStep, Some(1)).expect("a batch");
    let start = |i| Start {
        phase: 2.0 * i as f64 / PHASES as f64,
        ..Start::default()
    };
    let starts: Vec<_> = (0..PHASES).map(|i| (i, start(i))).collect();
    first.reset(&starts, &|| true).expect("starts");
    let mut batch = Batch::new(task, n, Autoreset::NextStep, Some(1)).expect("a batch");
    let actions = vec![0.0; n * batch.task.joints()];
    let mut observations = vec![0.0; n * batch.task.observation.len()];
    let mut outcomes: Vec<_> = batch
        .episodes
        .iter()
        .map(|each| (each.result(), None))
        .collect();
    let block = move |measure: Measure| {
        for (i, episode) in batch.episodes.iter_mut().enumerate() {
            episode.clone_from(&first.episodes[i % PHASES]);
        }
        measure(&mut || {
            batch
                .step(&actions, &mut observations, &mut outcomes, &|| true)
                .expect("steps")
        });
    };
    Item {
        name: format!("batch of {n}, fast, per environment and action"),
        units: u32::try_from(n).expect("some"),
        block: Box::new(block),
    }
}
