//! M = L^T D L along the tree: no fill-in, and the root's block falls out as the articulated inertia
//! at the supporting foot (Featherstone 2008, section 6.5 and table 6.3).

use crate::model::{DEPTH, FREE_FOOT, Model, NV, ROOT, coordinate};
use nalgebra::Matrix3;

/// Lower triangle of a matrix with the tree's sparsity. Row `c` holds the entries of the ancestors
/// of coordinate `c` by depth, then the diagonal: every ancestor's row is a prefix of it.
#[derive(Debug, Clone)]
pub struct PackedMatrix {
    pub rows: [[f64; DEPTH]; NV],
    /// 1 / D of the factored coordinates.
    inverse: [f64; NV],
}

impl Default for PackedMatrix {
    fn default() -> Self {
        Self {
            rows: [[0.0; DEPTH]; NV],
            inverse: [0.0; NV],
        }
    }
}

impl PackedMatrix {
    /// Entry (c, a) for `a` an ancestor of `c` or `c` itself.
    pub fn dense(&self, model: &Model) -> Vec<f64> {
        let n = model.n;
        let mut out = vec![0.0; n * n];
        for c in 0..n {
            for d in 0..=model.depth[c] {
                let a = if d == model.depth[c] {
                    c
                } else {
                    model.ancestors[c][d]
                };
                out[c * n + a] = self.rows[c][d];
                out[a * n + c] = self.rows[c][d];
            }
        }
        out
    }

    /// Eliminate the joints, leaves first; the root's rows become the Schur complement.
    pub fn factor(&mut self, model: &Model) {
        for c in (ROOT..model.n.min(NV)).rev() {
            let up = &model.ancestors[c];
            match model.depth[c] {
                3 => self.eliminate::<3>(c, up),
                4 => self.eliminate::<4>(c, up),
                5 => self.eliminate::<5>(c, up),
                6 => self.eliminate::<6>(c, up),
                7 => self.eliminate::<7>(c, up),
                8 => self.eliminate::<8>(c, up),
                9 => self.eliminate::<9>(c, up),
                10 => self.eliminate::<10>(c, up),
                _ => self.eliminate::<11>(c, up),
            }
        }
    }

    /// Take row `c`, of depth `D`, out of the rows of its ancestors. Every loop has a length that the
    /// compiler knows, and is written out.
    fn eliminate<const D: usize>(&mut self, c: usize, ancestors: &[usize; DEPTH]) {
        let row = self.rows[c];
        let inverse = 1.0 / row[D];
        self.inverse[c] = inverse;
        let mut scaled = row;
        for x in &mut scaled[..D] {
            *x *= inverse;
        }
        macro_rules! take_out_of_ancestors {
            ($($m:literal)*) => {$(
                if $m < D {
                    let up = &mut self.rows[ancestors[$m]];
                    for i in 0..=$m {
                        up[i] -= scaled[$m] * row[i];
                    }
                }
            )*};
        }
        take_out_of_ancestors!(0 1 2 3 4 5 6 7 8 9 10);
        self.rows[c] = scaled;
    }

    /// The root's block: articulated inertia of the whole robot at O, order y0, z0, q1.
    pub fn root(&self) -> Matrix3<f64> {
        let r = &self.rows;
        Matrix3::new(
            r[0][0], r[1][0], r[2][0], //
            r[1][0], r[1][1], r[2][1], //
            r[2][0], r[2][1], r[2][2],
        )
    }

    /// Carry a generalised force down to the root: x <- L^-T x on the joints.
    pub fn reduce(&self, model: &Model, x: &mut [f64; NV]) {
        for c in (ROOT..model.n).rev() {
            let depth = model.depth[c];
            let value = x[c];
            for (&a, l) in model.ancestors[c][..depth]
                .iter()
                .zip(&self.rows[c][..depth])
            {
                x[a] -= l * value;
            }
        }
    }

    /// `reduce` for a vector that is zero outside the legs' chain.
    pub fn reduce_leg(&self, x: &mut [f64; LEG]) {
        for c in (ROOT..=coordinate(FREE_FOOT)).rev() {
            let value = x[c];
            for (a, l) in x[..c].iter_mut().zip(&self.rows[c][..c]) {
                *a -= l * value;
            }
        }
    }

    /// From reduced joint forces and the root's acceleration to all accelerations, in place:
    /// x[root] holds the acceleration, x[joints] the reduced forces.
    pub fn expand(&self, model: &Model, x: &mut [f64; NV]) {
        for c in ROOT..model.n {
            let mut value = x[c] * self.inverse[c];
            let depth = model.depth[c];
            for (&a, l) in model.ancestors[c][..depth]
                .iter()
                .zip(&self.rows[c][..depth])
            {
                value -= l * x[a];
            }
            x[c] = value;
        }
    }

    /// 1 / D of a joint.
    pub fn inverse_d(&self, c: usize) -> f64 {
        self.inverse[c]
    }
}

/// Coordinates that move the free foot: the root and q2 to q7, each the next one's parent.
pub const LEG: usize = 9;
