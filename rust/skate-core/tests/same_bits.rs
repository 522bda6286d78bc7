//! Motions have the same bits on every target, with every width of registers, in debug and release. The checksums are
//! part of the test, so that it compares machines: run it on another one, or in an emulator of an older processor. A
//! change that changes motions writes new ones here.

mod presets;

use presets::PRESETS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use skate_core::{
    batch::{Autoreset, Batch, Outcome},
    model::{Model, layout::ROOT},
    numeric::{checksum::checksum, simd::Width},
    scene::Scene,
    task::{Start, Task, Weights},
};

const ENVIRONMENTS: usize = 11;
const ACTIONS: usize = 30;
/// Accuracies, and the checksums of the presets at each.
const MOTIONS: [(&str, [u64; PRESETS.len()]); 4] = [
    (
        r#""fast""#,
        [
            0x9510_17d1_fbaa_153d,
            0x04bc_0665_e23d_dd5d,
            0x9f4c_f8be_e378_33d3,
            0x3351_2a28_c361_c1a4,
            0x1e1e_f7e6_e38d_d18f,
            0x3515_e981_cd9e_592e,
        ],
    ),
    (
        r#""balanced""#,
        [
            0x3397_b569_d3f3_f38a,
            0x8783_ef5c_96cb_0036,
            0x9834_ecb0_0b81_7a9a,
            0x4b2e_d3a0_02dc_f158,
            0x9c54_611e_24eb_f559,
            0x44c4_031e_912c_4403,
        ],
    ),
    (
        "1e-8",
        [
            0xd70f_0821_9216_e783,
            0xf436_f5af_b488_ca28,
            0x503a_b84f_3c84_2998,
            0x8951_b5b4_9875_49e9,
            0x3092_aba8_4437_9d1e,
            0x6e6f_b8f8_8669_82e5,
        ],
    ),
    (
        r#"{"method": "rosenbrock", "tolerance": 1e-4}"#,
        [
            0x23b9_3499_9a5e_6f69,
            0x2a33_335a_8776_7df2,
            0x77a9_fb1d_7e2e_be66,
            0x6ca8_7a59_e4ef_ac2a,
            0xf789_7fa5_ec4a_308a,
            0xcb8a_fe07_9677_6b57,
        ],
    ),
];

/// Checksum of positions and velocities of disturbed episodes under random actions.
fn motion(scene: &Scene, width: Width) -> u64 {
    let joints = Model::compile(scene).expect("a model").n - ROOT;
    let mut task =
        Task::new(scene.clone(), vec![20.0; joints], Weights::default()).expect("a task");
    task.perturb = 0.02;
    let mut batch = Batch::new(task, ENVIRONMENTS, Autoreset::SameStep, Some(1)).expect("a batch");
    batch.lanes = width;
    let start = |i| Start {
        seed: Some(i as u64),
        ..Start::default()
    };
    let starts: Vec<_> = (0..ENVIRONMENTS).map(|i| (i, start(i))).collect();
    batch.reset(&starts, &|| true).expect("starts");
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut observations = vec![0.0; ENVIRONMENTS * batch.task.observation.len()];
    let mut outcomes: Vec<Outcome> = batch.episodes.iter().map(|e| (e.result(), None)).collect();
    let mut bytes = Vec::new();
    for _ in 0..ACTIONS {
        let actions: Vec<f64> = (0..ENVIRONMENTS * joints)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        batch
            .step(&actions, &mut observations, &mut outcomes, &|| true)
            .expect("steps");
        for episode in &batch.episodes {
            let state = &episode.sim.state;
            let numbers = state.q.iter().chain(&state.v);
            bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
        }
    }
    checksum(&bytes)
}

#[test]
fn motions_have_the_same_bits_everywhere() {
    for width in Width::all() {
        let found = MOTIONS.map(|(accuracy, _)| {
            let checksums = PRESETS.map(|preset| {
                let mut scene = Scene::from_toml(preset).expect("the preset");
                scene.accuracy = serde_json::from_str(accuracy).expect("an accuracy");
                motion(&scene, width)
            });
            (accuracy, checksums)
        });
        assert!(found == MOTIONS, "{width:?} lanes: {found:#018x?}");
    }
}
