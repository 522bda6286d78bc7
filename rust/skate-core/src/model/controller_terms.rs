//! Terms of the controller that a scene names.

use crate::scene::{
    Control, Feedforward, HeadDamping, KneeStop, Lifting, ProportionalDerivative as Pd, Scene,
    Stabilizers,
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

impl Term {
    /// Whether it exerts torques with slopes on joints; see `control::joint_torques`.
    pub fn has_joint_torques(&self) -> bool {
        match self {
            Self::Feedforward(_) | Self::ArmSwing { .. } => false,
            Self::Lifting(_) | Self::HeadDamping(_) => false,
            Self::HipPd(_) | Self::FreeKneePd(_) | Self::KneeStop(_) => true,
        }
    }
}

/// The terms that a scene names; `yaw` is the coordinate of q8, if it moves.
pub fn terms(scene: &Scene, yaw: Option<usize>) -> Vec<Term> {
    // A new field of these tables does not compile until it is named here.
    let Control {
        sample_period: _,
        action_period: _,
        psi: _,
        lifting,
        feedforward,
        arm_swing,
    } = scene.control.clone();
    let Stabilizers {
        head_damping,
        hip_pd,
        free_knee_pd,
        knee_stop,
    } = scene.stabilizers.clone();
    let swing = arm_swing.zip(yaw).map(|(swing, yaw)| Term::ArmSwing {
        amplitude: swing.amplitude,
        yaw,
    });
    let all = [
        feedforward.map(Term::Feedforward),
        swing,
        lifting.map(Term::Lifting),
        head_damping.map(Term::HeadDamping),
        hip_pd.map(Term::HipPd),
        free_knee_pd.map(Term::FreeKneePd),
        knee_stop.map(Term::KneeStop),
    ];
    all.into_iter().flatten().collect()
}
