//! Gait statistics, updated at every accepted time step.

use crate::{
    contact::{equations::Solution, loads::loads},
    control::feedforward::tau1,
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, SoleContact},
        friction::cone,
        state::State,
    },
    rhs::sole_points::SolePoints,
    scene::Leg,
};
use serde::{Deserialize, Serialize};

/// Minimum period of a gait step [s]. A leg swap sooner after the last one does not end a step: with
/// push-only contact two feet can alternate within microseconds.
pub const MIN_STEP_PERIOD: f64 = 0.1;
/// A foot is loaded if it carries at least this fraction of the weight.
pub const LOADED_FRACTION: f64 = 0.1;
/// Minimum time between two transfers of the load; faster ones are chatter [s].
pub const DEBOUNCE: f64 = 0.15;

/// A force counts as admissible up to this fraction of the weight. Where two feet touch for less than a
/// millisecond a force changes by 1 MN/s, and the projection of a located event state changes it by about
/// 3e-5 at `balanced` (estimate).
const FORCE_TOLERANCE: f64 = 1e-4;

/// One gait step: from one leg swap to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GaitStep {
    /// Time of the leg swap that ends it [s].
    pub time: f64,
    /// [s]
    pub period: f64,
    /// Displacement of the supporting foot while sliding [m].
    pub slide: f64,
    /// Displacement while sliding with a loaded foot [m].
    pub loaded_slide: f64,
    /// Displacement of the hips [m].
    pub progress: f64,
    /// Lowest top of the head [m].
    pub lowest_head: f64,
    /// Lowest position of the free toe, negative below the ice [m].
    pub deepest_toe: f64,
    /// Time with a tensile normal force, a contact force outside the friction cone, or a couple tau1 that the
    /// supporting sole cannot carry [s].
    pub inadmissible_time: f64,
}

/// Totals since the start, or since `reset_totals`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// As in `GaitStep` [m].
    pub slide: f64,
    pub loaded_slide: f64,
    /// Number of transfers of the load to the other leg. A transfer counts when that leg supports and is
    /// loaded, at least `DEBOUNCE` after the last one.
    pub swaps: u64,
    /// Time with both feet in the air, and with both feet on the ice [s].
    pub flight: f64,
    pub double_support: f64,
    /// Leg and time of the last transfer [s].
    leg: Leg,
    pub(super) transferred: f64,
}

impl Totals {
    /// Zero totals, starting at `state`.
    pub fn new(state: &State) -> Self {
        Self {
            leg: state.support_leg,
            transferred: state.t,
            ..Self::default()
        }
    }
}

/// Values of the present gait step, and totals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GaitMonitor {
    /// Time [s] and position of the hips [m] at the start of the gait step.
    start: f64,
    hips_at_start: f64,
    pub current: GaitStep,
    pub totals: Totals,
    /// Time of the last change of the contact mode or the supporting leg [s].
    pub changed: f64,
}

impl GaitMonitor {
    /// Start at `state`; `sole_points` are its sole points.
    pub fn new(state: &State, sole_points: &SolePoints) -> Self {
        Self {
            totals: Totals::new(state),
            changed: state.t,
            start: state.t,
            hips_at_start: state.q[0] + sole_points.waist,
            current: GaitStep {
                time: state.t,
                period: 0.0,
                slide: 0.0,
                loaded_slide: 0.0,
                progress: 0.0,
                lowest_head: state.q[1] + sole_points.head[2],
                deepest_toe: sole_points.gap(FREE, End::Toe),
                inadmissible_time: 0.0,
            },
        }
    }

    /// All numbers that are no counts, in any units.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        let Self {
            start,
            hips_at_start,
            current,
            totals,
            changed,
        } = *self;
        let GaitStep {
            time,
            period,
            slide,
            loaded_slide,
            progress,
            lowest_head,
            deepest_toe,
            inadmissible_time,
        } = current;
        let own = [
            start,
            hips_at_start,
            changed,
            time,
            period,
            slide,
            loaded_slide,
        ];
        let step = [progress, lowest_head, deepest_toe, inadmissible_time];
        own.into_iter().chain(step).chain([
            totals.slide,
            totals.loaded_slide,
            totals.flight,
            totals.double_support,
            totals.transferred,
        ])
    }

    /// Start the next gait step at `state`.
    pub fn next_gait_step(&mut self, state: &State, sole_points: &SolePoints) {
        let Self {
            totals, changed, ..
        } = *self;
        *self = Self {
            totals,
            changed,
            ..Self::new(state, sole_points)
        };
    }

    /// Start a gait step at `state`, whose time is before the present one.
    #[cold]
    pub fn turn_back(&mut self, state: &State, sole_points: &SolePoints) {
        let Totals { transferred, .. } = self.totals;
        self.totals.transferred = transferred.min(state.t);
        *self = Self {
            totals: self.totals,
            ..Self::new(state, sole_points)
        };
    }

    /// Add the time from `before` to `state`, with the contact forces and sole points in it.
    pub fn accumulate(
        &mut self,
        model: &Model,
        forces: &Solution,
        sole_points: &SolePoints,
        before: &State,
        state: &State,
    ) {
        let (record, totals) = (&mut self.current, &mut self.totals);
        let mode = state.mode;
        let loads = loads(state.levers(model), mode, forces);
        let loaded = is_loaded(model, loads[0]);
        if mode.support.slides() {
            let distance = state.q[0] - before.q[0];
            record.slide += distance;
            totals.slide += distance;
            if loaded {
                record.loaded_slide += distance;
                totals.loaded_slide += distance;
            }
        }
        let elapsed = state.t - before.t;
        match [mode.support, mode.free].map(|foot| foot.touch == SoleContact::Air) {
            [true, true] => totals.flight += elapsed,
            [false, false] => totals.double_support += elapsed,
            _ => {}
        }
        if loaded && state.support_leg != totals.leg && state.t - totals.transferred >= DEBOUNCE {
            totals.swaps += 1;
            (totals.leg, totals.transferred) = (state.support_leg, state.t);
        }
        record.time = state.t;
        record.period = state.t - self.start;
        record.progress = state.q[0] + sole_points.waist - self.hips_at_start;
        record.lowest_head = record.lowest_head.min(state.q[1] + sole_points.head[2]);
        record.deepest_toe = record.deepest_toe.min(sole_points.gap(FREE, End::Toe));
        let couple = tau1(model, state);
        if !admissible(model, forces, &loads, mode, couple) {
            record.inadmissible_time += state.t - before.t;
        }
    }
}

/// Does a foot with these normal forces of heel and toe count as loaded?
pub fn is_loaded(model: &Model, [heel, toe]: [f64; 2]) -> bool {
    heel + toe >= LOADED_FRACTION * model.weight()
}

/// Whether all contact forces are compressive, inside the friction cone, with the centre of pressure inside
/// the sole. The supporting sole carries `couple` [N m] as a force at each end; a foot on one end cannot.
fn admissible(
    model: &Model,
    forces: &Solution,
    loads: &[[f64; 2]; 2],
    mode: ContactMode,
    couple: f64,
) -> bool {
    let slack = FORCE_TOLERANCE * model.weight();
    let at_ends = couple / model.sole.length();
    let mut loads = *loads;
    if mode.support.touch == SoleContact::Flat {
        loads[0][0] -= at_ends;
        loads[0][1] += at_ends;
    } else if at_ends.abs() > slack {
        return false;
    }
    let along = [forces.f_root[0], forces.lam[0]];
    [mode.support, mode.free]
        .iter()
        .enumerate()
        .all(|(which, foot)| {
            if foot.touch == SoleContact::Air {
                return true;
            }
            let [heel, toe] = loads[which];
            let friction = &model.friction;
            let [least, largest] = cone(friction.mu, heel + toe);
            let in_cone = (least - slack..=largest + slack).contains(&along[which]);
            heel >= -slack && toe >= -slack && (in_cone || !friction.is_dry())
        })
}
