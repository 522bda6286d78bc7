//! What is known before a contact mode is selected.

use crate::{
    contact::{
        conditions::Tolerance,
        equations::{Solution, Y, Z},
    },
    model::{
        contact_mode::{ContactMode, FREE, SUPPORT, SoleContact},
        friction::FrictionMode,
    },
};

/// See the module's documentation. Arrays are indexed by foot, `SUPPORT` and `FREE`.
#[derive(Debug, Clone, Copy)]
pub struct ModeQuery {
    /// Ends of the soles whose gap is closed. The problem's pivot and contact point are those of
    /// `SoleContact::pivot` and `SoleContact::contact_point` for these contacts.
    pub closed: [SoleContact; 2],
    /// Closed ends that may carry a load. An end whose load has just vanished may not.
    pub may_load: [SoleContact; 2],
    /// Friction mode of a foot that already slides; `None` where the selection decides.
    pub sliding: [Option<FrictionMode>; 2],
    /// A foot that must come to rest on the ice.
    pub must_stick: Option<usize>,
    /// A foot whose force has reached the edge of the friction cone and that may not stick.
    pub must_slide: Option<usize>,
    /// The mode from which distances are measured.
    pub reference: ContactMode,
    /// A mode that has just ended.
    pub excluded: Option<ContactMode>,
    pub tolerance: Tolerance,
    /// Forces (y, z) on the feet before, or none at an impact [N].
    pub forces: [[f64; 2]; 2],
}

impl ModeQuery {
    /// A free choice among the modes of these closed ends.
    pub fn new(
        closed: [SoleContact; 2],
        sliding: [Option<FrictionMode>; 2],
        reference: ContactMode,
        tolerance: Tolerance,
    ) -> Self {
        Self {
            closed,
            may_load: closed,
            sliding,
            must_stick: None,
            must_slide: None,
            reference,
            excluded: None,
            tolerance,
            forces: [[0.0; 2]; 2],
        }
    }

    /// Square of the change of the forces on both feet [N^2].
    pub fn change_of_forces(&self, solution: &Solution) -> f64 {
        let forces = [&solution.f_root, &solution.lam];
        let change = |foot: usize, axis: usize| forces[foot][axis] - self.forces[foot][axis];
        [(SUPPORT, Y), (SUPPORT, Z), (FREE, Y), (FREE, Z)]
            .into_iter()
            .map(|(foot, axis)| change(foot, axis) * change(foot, axis))
            .sum()
    }
}
