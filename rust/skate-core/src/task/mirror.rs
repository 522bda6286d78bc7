//! Mirrored view: states with left support are shown and acted on as in a mirror.
//!
//! Legs are numbered by role and do not change; yaw and roll of the trunk change sign; the arms are exchanged.

use crate::{error::Invalid, task::Entry};
use nalgebra::DMatrix;

/// Names of elements that change sign.
const NEGATED: [&str; 5] = [
    "q8",
    "q10",
    "support_leg",
    "feedforward.tau8",
    "head_error.x",
];
/// Joints of the right and of the left arm.
const ARMS: [(&str, &str); 3] = [("q11", "q14"), ("q12", "q15"), ("q13", "q16")];

/// Mirror of actions and observations.
#[derive(Debug, Clone)]
pub struct Mirror {
    /// For each joint its partner and the sign of its torque.
    pub joints: Vec<(usize, f64)>,
    /// Entries of an observation that are exchanged, and those that change sign.
    swapped: Vec<(usize, usize)>,
    negated: Vec<usize>,
}

impl Mirror {
    /// Mirror of actions with these joints and of observations with these entries.
    ///
    /// # Errors
    /// `Invalid` if a joint of one arm only is present.
    pub fn new(joints: &[&'static str], entries: &[Entry]) -> Result<Self, Invalid> {
        let partner = |name: &str| {
            let (prefix, joint) = name.split_at(name.rfind('.').map_or(0, |dot| dot + 1));
            let pairs = ARMS.iter().flat_map(|&(a, b)| [(a, b), (b, a)]);
            let other = pairs.into_iter().find(|&(own, _)| own == joint);
            format!("{prefix}{}", other.map_or(joint, |(_, other)| other))
        };
        let is_negated = |name: &str| {
            NEGATED.contains(&name) || NEGATED.contains(&name.rsplit('.').next().unwrap_or(name))
        };
        let mut of_joints = Vec::new();
        for name in joints {
            let other = partner(name);
            let Some(at) = joints.iter().position(|&joint| joint == other) else {
                return Err(Invalid(format!(
                    "mirrored = true: must be false in a scene with {name} but without {other}"
                )));
            };
            of_joints.push((at, if is_negated(name) { -1.0 } else { 1.0 }));
        }
        let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        let mut swapped = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let other = partner(name);
            let at = names.iter().position(|&name| name == other);
            // Each pair once; a joint has an entry wherever it has a torque.
            swapped.extend(at.filter(|&at| at > i).map(|at| (i, at)));
        }
        let negated = (0..names.len()).filter(|&i| is_negated(names[i])).collect();
        Ok(Self {
            joints: of_joints,
            swapped,
            negated,
        })
    }

    /// Mirror the rows of an observation's derivatives in place.
    pub fn rows(&self, rows: &mut DMatrix<f64>) {
        for &(a, b) in &self.swapped {
            rows.swap_rows(a, b);
        }
        for &i in &self.negated {
            rows.row_mut(i).neg_mut();
        }
    }

    /// Mirror an observation in place.
    pub fn observation(&self, out: &mut [f32]) {
        for &(a, b) in &self.swapped {
            out.swap(a, b);
        }
        for &i in &self.negated {
            // Not -0.0, so that a mirror image has the same bits.
            out[i] = 0.0 - out[i];
        }
    }
}
