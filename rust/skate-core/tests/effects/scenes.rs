//! Random base scenes.

use super::pairs::{Pair, dry};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use skate_core::scene::*;

/// A robot that glides on one leg under low gravity and small torques, so that a second may pass without an
/// event. Posture, speeds and effects are random.
pub fn base(rng: &mut ChaCha8Rng) -> Scene {
    let mut scene = Scene::default();
    (scene.body.foot.toe, scene.body.foot.heel) = (0.3, 0.3);
    scene.ice.gravity = 0.1;
    scene.ice.friction = dry(0.02, 0.09);
    let mut on = |share: f64| rng.random_bool(share);
    scene.energy_balance = on(0.5);
    scene.body.joint_damping = on(0.8);
    scene.fall = on(0.5).then_some(Fall { head_height: -10.0 });
    scene.control.lifting = on(0.5).then_some(Lifting {
        K_p: [1.0, 0.5, 2.0],
        ahead: 0.1,
        height: 1.7,
    });
    scene.control.feedforward = on(0.5).then_some(Feedforward {
        scale: 0.002,
        t2: PushOffStart::Rotation,
        tau1_scale: 1.0,
        tau7_scale: 0.02,
    });
    scene.control.arm_swing = on(0.5).then_some(ArmSwing { amplitude: 0.1 });
    scene.stabilizers.head_damping = on(0.5).then_some(HeadDamping { y: 1.0, z: 1.0 });
    scene.stabilizers.hip_pd = on(0.5).then_some(ProportionalDerivative::new(1.0, 1.0));
    scene.stabilizers.free_knee_pd = on(0.5).then_some(ProportionalDerivative::new(0.1, 0.1));
    let posture = [
        ("q2", 0.1),
        ("q3", -0.2),
        ("q4", 0.1),
        ("q5", 0.6),
        ("q6", -0.9),
        ("q7", 0.3),
    ];
    for name in &COORDINATES[3..] {
        let middle = posture.iter().find(|(joint, _)| joint == name);
        let q = middle.map_or(0.0, |(_, q)| *q) + rng.random_range(-0.03..0.03);
        scene.start.q.insert((*name).into(), q);
        scene
            .start
            .v
            .insert((*name).into(), rng.random_range(-0.02..0.02));
    }
    scene
        .start
        .v
        .insert("y0".into(), rng.random_range(1.0..2.0));
    scene
}

/// Both scenes, or None if the pairs exclude each other.
pub fn both(base: &Scene, pairs: &[&Pair]) -> Option<[Scene; 2]> {
    let (mut without, mut with) = (base.clone(), base.clone());
    for pair in pairs {
        (pair.absent)(&mut without);
        (pair.inactive)(&mut with);
        for &joint in pair.joints {
            without.locked.push(joint.into());
            for scene in [&mut without, &mut with] {
                scene.start.q.remove(joint);
                scene.start.v.remove(joint);
                if joint == "q8" {
                    scene.control.arm_swing = None;
                }
            }
        }
    }
    let valid = without.validate().is_ok() && with.validate().is_ok();
    valid.then_some([without, with])
}

pub fn held(pairs: &[&Pair]) -> Vec<&'static str> {
    pairs.iter().flat_map(|pair| pair.joints).copied().collect()
}
