//! Symmetric matrix with branch-induced sparsity (Featherstone 2008, section 6.4).

use crate::model::{
    Model,
    layout::{DEPTH, NV},
};

/// Lower triangle. Row `c` holds the entries of the ancestors of coordinate `c` by depth, then the
/// diagonal. The row of every ancestor has the same columns up to its own depth.
#[derive(Debug, Clone)]
pub struct PackedMatrix {
    pub rows: [[f64; DEPTH]; NV],
}

impl Default for PackedMatrix {
    fn default() -> Self {
        Self {
            rows: [[0.0; DEPTH]; NV],
        }
    }
}

impl PackedMatrix {
    /// Dense n x n copy, row by row.
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
}
