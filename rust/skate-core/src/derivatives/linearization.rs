//! Linearization of a motion.

use crate::{
    derivatives::{
        columns::Motion,
        nonsmooth::{Nonsmooth, Reason, find},
        parameters::{Parameters, Varied},
        saltation::{EventDerivative, groups},
        tape::{Record, Tape, nearest_guard},
        variation::state_size,
    },
    error::Invalid,
    events::{guard::Guard, observer::Operation},
    integrate::Method,
    model::{
        Model,
        layout::{NV, ROOT},
        scheme::{Methods, Scheme},
        state::State,
    },
    sim::Simulation,
};
use nalgebra::{DMatrix, DVector};
use std::{mem, sync::Arc};

/// The method of a motion that has no steps of a method.
const NO_STEPS: Method = Method::dopri5(1e-6);

/// Derivatives of a motion. The state is (q, v, anchor, t0, t1, t2) with the q and v of `Coordinates`, see `state_size`.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// Start and end of the motion [s].
    pub time: [f64; 2],
    /// Final state per start state, which is projected onto the constraints first.
    pub A: DMatrix<f64>,
    /// Final state per held residual torque of the joints [1/(N m)].
    pub B: DMatrix<f64>,
    /// Final state per parameter.
    pub P: DMatrix<f64>,
    /// Loaded slide and time of flight of the motion, see `Totals`, and time of the last change of contact, per start
    /// state and torque. Which steps count is held.
    pub totals: DMatrix<f64>,
    /// Whether the contact has changed, also at the start, where the torques jump.
    pub changed: bool,
    pub events: Vec<EventDerivative>,
    /// Reasons for which the derivatives may not exist.
    pub nonsmooth: Vec<Nonsmooth>,
    model: Arc<Model>,
    ends: [State; 2],
}

impl Linearization {
    /// Orthonormal basis, by column, of the tangent space of the constraints at the start.
    pub fn basis_before(&self) -> DMatrix<f64> {
        basis(&self.model, &self.ends[0])
    }

    /// The same at the end.
    pub fn basis_after(&self) -> DMatrix<f64> {
        basis(&self.model, &self.ends[1])
    }
}

impl Simulation {
    /// Advance with the held residual torques `residual` (n - 3) to the time `until` [s], and differentiate. None if
    /// `go_on`, which is called before every time step, has returned false.
    ///
    /// # Errors
    /// `Invalid` for an implicit method, an unknown or repeated parameter or one with time stepping, or a motion that
    /// terminates or is stiff.
    pub fn linearize(
        &mut self,
        residual: &[f64],
        until: f64,
        params: &[String],
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<Linearization>, Invalid> {
        let method = match self.model.scheme {
            Scheme::EventDriven(Methods { usual, .. }) if !usual.is_implicit() => usual,
            Scheme::TimeStepping { .. } if params.is_empty() => NO_STEPS,
            Scheme::TimeStepping { .. } => {
                let message =
                    "accuracy: derivatives by parameters need the method dop853, dopri5 or rk4";
                return Err(Invalid(message.into()));
            }
            Scheme::EventDriven(_) => {
                let message = "accuracy: derivatives need the method dop853, dopri5, rk4 or moreau";
                return Err(Invalid(message.into()));
            }
        };
        let parameters = Parameters::of(&self.model, params)?;
        let start = self.state;
        let mut torques = [0.0; NV];
        torques[ROOT..self.model.n].copy_from_slice(residual);
        // Laws are not checked in a motion that is differentiated.
        let watching = mem::replace(&mut self.observer, Some(Tape::default()).into());
        self.hold(residual);
        // Time stepping has no guards.
        let has_guards = self.model.scheme.locates_events();
        let nearest = nearest_guard(&self.present(), |_| has_guards);
        self.advance_while(until, go_on);
        let tape = self.take_observer::<Tape>().unwrap_or_default();
        self.observer = watching;
        self.observe_beginning();
        if let Some(cause) = self.ended {
            let (t, name) = (self.state.t, cause.name());
            return Err(Invalid(format!("the motion ends with {name} at {t} s")));
        }
        let stiff = tape.records.iter().find_map(|record| match record {
            Record::Step(step) if step.start.is_stiff => Some(step.start.t),
            _ => None,
        });
        if let Some(t) = stiff {
            return Err(Invalid(format!(
                "the motion is stiff at {t} s, where derivatives need the method dop853, dopri5, rk4 or moreau"
            )));
        }
        let motion = Motion {
            varied: Varied {
                model: &self.model,
                parameters: &parameters,
            },
            method,
            start: &start,
            residual: &torques,
            records: &tape.records,
            end: self.state.mode,
            go_on,
        };
        let end = (&self.state, &self.model);
        let done = assemble(&motion, nearest, end);
        Ok(go_on().then_some(done))
    }
}

/// The derivatives of a recorded motion to the state `end`; `nearest` is the guard nearest to zero at the start.
fn assemble(
    motion: &Motion<'_>,
    nearest: Option<(Guard, f64)>,
    (end, model): (&State, &Arc<Model>),
) -> Linearization {
    let (n, parameters) = (model.n, motion.varied.parameters.len());
    let (size, joints) = (state_size(n), n - ROOT);
    let groups = groups(motion.records);
    let events: Vec<usize> = groups.iter().map(|group| group.index).collect();
    let inputs = size + joints;
    let columns = motion.differentiate(&events, inputs);
    let mut residual = *motion.residual;
    let mut derivatives = Vec::new();
    for (i, group) in groups.iter().enumerate() {
        if let Some(step) = group.step {
            residual = step.context.residual;
        }
        let (saltation, guard_rate) = group.saltation(model, motion.method, &residual);
        let row = |from: usize, len: usize| -> DVector<f64> {
            columns
                .times
                .view((i, from), (1, len))
                .transpose()
                .column(0)
                .into()
        };
        derivatives.push(EventDerivative {
            t: group.first.2.t,
            what: group.what(),
            from: group.first.2.mode,
            to: group.after.mode,
            leg: group.after.support_leg,
            guard_rate,
            saltation,
            dt_dx: row(0, size),
            dt_du: row(size, joints),
            dt_dp: row(inputs, parameters),
        });
    }
    let start = (motion.start.t, nearest);
    let mut nonsmooth = find(model, motion.records, (&groups, &derivatives), start);
    if !columns.regular {
        nonsmooth.push(Nonsmooth {
            reason: Reason::Dependent,
            t: motion.start.t,
            margin: 0.0,
        });
    }
    let part = |from: usize, len: usize| columns.state.columns(from, len).into_owned();
    Linearization {
        time: [motion.start.t, end.t],
        A: part(0, size),
        B: part(size, joints),
        P: part(inputs, parameters),
        totals: columns.totals,
        changed: (motion.records.iter())
            .any(|r| matches!(r, Record::Operation(Operation::Changed))),
        events: derivatives,
        nonsmooth,
        model: model.clone(),
        ends: [*motion.start, *end],
    }
}

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
        end: state.mode,
        go_on: &|| true,
    };
    motion.differentiate(&[], size).state
}

/// Orthonormal basis of the tangent space: the range of the projector. Empty where dependent constraints leave the
/// projector undefined.
fn basis(model: &Model, state: &State) -> DMatrix<f64> {
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
