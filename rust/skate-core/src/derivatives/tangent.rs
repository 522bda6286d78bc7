//! Tangent space of a mode's constraints.

use crate::{
    derivatives::{
        columns::Motion,
        parameters::{Parameters, Varied},
        variation::state_size,
    },
    integrate::Method,
    model::{Model, layout::NV, state::State},
};
use nalgebra::DMatrix;

/// The method of a motion that has no steps of a method.
pub const NO_STEPS: Method = Method::dopri5(1e-6);

/// Projector onto the tangent space of the constraints of the state's mode.
fn projector(model: &Model, state: &State) -> DMatrix<f64> {
    let size = state_size(model.n);
    let motion = Motion {
        varied: Varied {
            model,
            parameters: &Parameters::default(),
        },
        method: NO_STEPS,
        start: state,
        residual: &[0.0; NV],
        records: &[],
        go_on: &|| true,
    };
    motion.differentiate(&[], size).state
}

/// Orthonormal basis of the tangent space: the range of the projector. Empty where dependent constraints leave the
/// projector undefined.
pub fn basis(model: &Model, state: &State) -> DMatrix<f64> {
    let projector = projector(model, state);
    if !projector.iter().all(|x| x.is_finite()) {
        return DMatrix::zeros(projector.nrows(), 0);
    }
    // Not the singular vectors: nalgebra 0.35 returns a wrong one for some projectors, which have many equal
    // singular values. The pivots of a projector are 0 up to rounding, or of order 1.
    let (q, r, _) = projector.col_piv_qr().unpack();
    let pivots = r.diagonal();
    let rank = pivots.iter().filter(|x| x.abs() > 1e-6).count();
    q.columns(0, rank).into_owned()
}
