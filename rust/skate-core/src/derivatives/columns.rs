//! Derivatives of a recorded motion, column by column.

use crate::{
    derivatives::{
        linear::{Replay, projection},
        parameters::Varied,
        tape::Record,
        variation::state_size,
    },
    integrate::Method,
    model::{contact_mode::ContactMode, layout::NV, state::State},
    numeric::simd::{Register, SimdTask, Width},
};
use nalgebra::DMatrix;

/// A recorded motion.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    pub varied: Varied<'a>,
    pub method: Method,
    pub start: &'a State,
    pub residual: &'a [f64; NV],
    pub records: &'a [Record],
    /// Contact mode after them.
    pub end: ContactMode,
    /// Called before every record; false stops, and the columns are not complete.
    pub go_on: &'a dyn Fn() -> bool,
}

/// Derivatives along all directions: final states by row, event times by row.
pub struct Columns {
    pub state: DMatrix<f64>,
    pub times: DMatrix<f64>,
    /// Loaded slide, flight, and the time of the last change of contact.
    pub totals: DMatrix<f64>,
    pub regular: bool,
}

impl Motion<'_> {
    /// Those of the first `inputs` entries of the differentiated state and of the held torques, then those of the
    /// parameters.
    pub fn differentiate(&self, events: &[usize], inputs: usize) -> Columns {
        let all = inputs + self.varied.parameters.len();
        let mut columns = Columns {
            state: DMatrix::zeros(state_size(self.varied.model.n), all),
            times: DMatrix::zeros(events.len(), all),
            totals: DMatrix::zeros(3, all),
            regular: true,
        };
        Width::widest().run(Pass {
            motion: self,
            events,
            columns: &mut columns,
            inputs,
        });
        columns
    }
}

struct Pass<'a, 'b> {
    motion: &'a Motion<'b>,
    events: &'a [usize],
    columns: &'a mut Columns,
    inputs: usize,
}

impl SimdTask for Pass<'_, '_> {
    fn run_scalar(self) {
        self.run_simd::<f64>();
    }

    fn run_simd<R: Register>(self) {
        let motion = self.motion;
        let (n, start) = (motion.varied.model.n, motion.start);
        let from = (start, motion.residual);
        let mut replay = Replay::<R>::new(motion.varied, motion.method, from, self.inputs);
        replay.enter_state(start);
        for record in &projection(start.mode) {
            replay.apply(record);
        }
        for directions in &mut replay.all {
            directions.state.set_values(start);
        }
        let mut events = self.events.iter().enumerate().peekable();
        for (i, record) in motion.records.iter().enumerate() {
            if let Some((row, _)) = events.next_if(|(_, index)| **index == i) {
                for directions in &replay.all {
                    for (lane, column) in directions.columns.clone().enumerate() {
                        self.columns.times[(row, column)] = directions.state.t.d.lane(lane);
                    }
                }
            }
            if !(motion.go_on)() {
                return;
            }
            replay.apply(record);
        }
        replay.leave_state(motion.end);
        for directions in &mut replay.all {
            directions.write(n, &mut self.columns.state);
            for (lane, column) in directions.columns.clone().enumerate() {
                for (row, d) in directions.totals.iter().enumerate() {
                    self.columns.totals[(row, column)] = d.lane(lane);
                }
            }
        }
        self.columns.regular &= replay.regular;
    }
}
