//! Derivatives of a recorded motion, column by column.

use crate::{
    derivatives::{
        dual::{DualReplay, Stencil, Varied},
        linear::{Replay, projection},
        variation::{Variation, state_size},
    },
    events::trace::Record,
    integrate::Method,
    model::{Model, layout::NV, state::State},
    numeric::simd::{Register, SimdTask, Width},
};
use nalgebra::DMatrix;

/// A recorded motion.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    pub model: &'a Model,
    pub method: Method,
    pub start: &'a State,
    pub residual: &'a [f64; NV],
    pub records: &'a [Record],
    /// Called before every record; false stops, and the columns are not complete.
    pub go_on: &'a dyn Fn() -> bool,
}

/// Derivatives along all directions: final states by row, event times by row.
pub struct Columns {
    pub state: DMatrix<f64>,
    pub times: DMatrix<f64>,
    /// Loaded slide, flight, and the time of the last change of contact, by state and torques.
    pub totals: DMatrix<f64>,
    pub regular: bool,
}

impl Motion<'_> {
    /// All columns: those of the differentiated state and of the held torques up to `inputs`, then those of the
    /// parameters.
    pub fn differentiate(
        &self,
        events: &[usize],
        (inputs, parameters): (usize, &[Stencil]),
    ) -> Columns {
        let (size, all) = (state_size(self.model.n), inputs + parameters.len());
        let mut columns = Columns {
            state: DMatrix::zeros(size, all),
            times: DMatrix::zeros(events.len(), all),
            totals: DMatrix::zeros(3, inputs),
            regular: true,
        };
        Width::widest().run(Pass {
            motion: self,
            events,
            columns: &mut columns,
            inputs,
        });
        for (i, parameter) in parameters.iter().enumerate() {
            self.differentiate_by(parameter, events, inputs + i, &mut columns);
        }
        columns
    }

    /// The column of a parameter.
    fn differentiate_by(
        &self,
        parameter: &Stencil,
        events: &[usize],
        column: usize,
        columns: &mut Columns,
    ) {
        let models = Varied {
            model: self.model,
            parameter: Some(parameter),
        };
        let state = Variation::of(self.start, self.residual);
        let mut replay = DualReplay::new(models, self.method, state);
        for record in &projection(self.start.mode) {
            replay.apply(record);
        }
        replay.state.set_values(self.start);
        let mut events = events.iter().enumerate().peekable();
        for (i, record) in self.records.iter().enumerate() {
            if let Some((row, _)) = events.next_if(|(_, index)| **index == i) {
                columns.times[(row, column)] = replay.state.t.d;
            }
            if !(self.go_on)() {
                return;
            }
            replay.apply(record);
        }
        let n = self.model.n;
        for row in 0..state_size(n) {
            columns.state[(row, column)] = replay.state.entry(n, row).d;
        }
        columns.regular &= replay.regular;
    }
}

/// The columns of state and torques.
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
        let Motion {
            model,
            method,
            start,
            residual,
            records,
            go_on,
        } = *self.motion;
        let (n, inputs) = (model.n, self.inputs);
        let mut replay = Replay::<R>::new(model, method, (start, residual), inputs);
        for record in &projection(start.mode) {
            replay.apply(record);
        }
        for directions in &mut replay.all {
            directions.state.set_values(start);
        }
        let mut events = self.events.iter().enumerate().peekable();
        for (i, record) in records.iter().enumerate() {
            if let Some((row, _)) = events.next_if(|(_, index)| **index == i) {
                for column in 0..inputs {
                    let state = &replay.all[column / R::LANES].state;
                    self.columns.times[(row, column)] = state.t.d.lane(column % R::LANES);
                }
            }
            if !go_on() {
                return;
            }
            replay.apply(record);
        }
        for column in 0..inputs {
            let (directions, lane) = (&mut replay.all[column / R::LANES], column % R::LANES);
            for row in 0..state_size(n) {
                let d = directions.state.entry(n, row).d;
                self.columns.state[(row, column)] = d.lane(lane);
            }
            for (row, d) in directions.totals.iter().enumerate() {
                self.columns.totals[(row, column)] = d.lane(lane);
            }
        }
        self.columns.regular &= replay.regular;
    }
}
