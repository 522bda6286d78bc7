//! Terms of the controller that a scene names.

use crate::scene::{
    Feedforward, HeadDamping, KneeStop, Lifting, ProportionalDerivative as Pd, Scene,
};

/// One term of the controller. `Model::controller_terms` lists those of the scene.
#[derive(Debug, Clone)]
pub enum Term {
    Feedforward(Feedforward),
    /// tau8, Eq. 22, on the coordinate of q8.
    ArmSwing {
        amplitude: f64,
        yaw: usize,
    },
    Lifting(Lifting),
    HeadDamping(HeadDamping),
    HipPd(Pd),
    FreeKneePd(Pd),
    KneeStop(KneeStop),
}

/// The terms that a scene names; `yaw` is the coordinate of q8, if it moves.
pub fn terms(scene: &Scene, yaw: Option<usize>) -> Vec<Term> {
    let (control, stabilizers) = (&scene.control, &scene.stabilizers);
    let swing = control.arm_swing.as_ref().zip(yaw);
    let swing = swing.map(|(swing, yaw)| Term::ArmSwing {
        amplitude: swing.amplitude,
        yaw,
    });
    let all = [
        control.feedforward.clone().map(Term::Feedforward),
        swing,
        control.lifting.clone().map(Term::Lifting),
        stabilizers.head_damping.clone().map(Term::HeadDamping),
        stabilizers.hip_pd.clone().map(Term::HipPd),
        stabilizers.free_knee_pd.clone().map(Term::FreeKneePd),
        stabilizers.knee_stop.clone().map(Term::KneeStop),
    ];
    all.into_iter().flatten().collect()
}
