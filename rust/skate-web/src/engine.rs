//! One simulation behind the border. All calls into `skate_core`, except those of `scene_edit`, are here.

use crate::scene_edit::{self, SceneEdit};
use serde_json::{Value, json};
use skate_core::{
    error::Invalid,
    model::{
        Model,
        layout::{NV, ROOT},
    },
    rhs::link_segments,
    scene::Leg,
    sim::{Coordinates, Simulation},
    task,
};

/// Number of entries of `Engine::state`.
pub const STATE_LENGTH: usize = 190;
/// Where q, v and the link segments begin; the entries before are listed in `state`.
const POSITIONS: usize = 40;
const RATES: usize = 60;
const SEGMENTS: usize = 80;
/// Most actions of one call of `step`: 100 s with the default period.
const MAX_ACTIONS: u32 = 10_000;

/// One robot on the ice.
#[derive(Debug)]
pub struct Engine {
    sim: Box<Simulation>,
}

impl Engine {
    /// A simulation at the start of a scene. The second value describes the scene; see `scene_edit`.
    ///
    /// # Errors
    /// `Invalid` if the scene or its start is not valid.
    pub fn new(edit: &SceneEdit) -> Result<(Self, Value), Invalid> {
        let scene = edit.apply()?;
        let mut description = scene_edit::describe(&scene);
        let sim = Box::new(Simulation::new(Model::compile(&scene)?)?);
        description["coordinates"] = json!(sim.model.names);
        Ok((Self { sim }, description))
    }

    /// Advance by `actions` action periods, fewer if the simulation ends; returns how many.
    pub fn step(&mut self, actions: u32) -> u32 {
        for done in 0..actions.min(MAX_ACTIONS) {
            if self.sim.ended.is_some() {
                return done;
            }
            let until = self.sim.next_action_time();
            self.sim.advance(until);
        }
        actions.min(MAX_ACTIONS)
    }

    /// Set the residual joint torques of the next actions [N m], one per joint.
    ///
    /// # Errors
    /// `Invalid` for a wrong number of torques and for torques that are not finite or above 1e5 N m.
    pub fn hold(&mut self, torque: &[f64]) -> Result<(), Invalid> {
        let joints = self.sim.model.n - ROOT;
        if torque.len() != joints {
            let n = torque.len();
            return Err(Invalid(format!("{n} residual torques: must be {joints}")));
        }
        for &x in torque {
            Invalid::range("residual torque", x, -1e5, 1e5, "N m")?;
        }
        self.sim.hold(torque);
        Ok(())
    }

    /// Add a speed [m/s] to the forward velocity of every body.
    ///
    /// # Errors
    /// `Invalid`, and nothing has changed, outside -10 to 10 m/s and on sticking ice.
    pub fn kick(&mut self, speed: f64) -> Result<(), Invalid> {
        self.sim.kick(speed)
    }

    pub fn snapshot(&self) -> Vec<u8> {
        self.sim.snapshot()
    }

    /// # Errors
    /// `Invalid`, and nothing has changed, for bytes that are no snapshot of this scene.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), Invalid> {
        self.sim.restore(bytes)
    }

    /// Observation of the present state, as learned policies get it.
    pub fn observation(&self) -> Vec<f32> {
        task::observation(&self.sim)
    }

    /// Everything that a picture of the present state needs. Entries that are not named are zero:
    ///
    /// | entry | value |
    /// |---|---|
    /// | 0 | time [s] |
    /// | 1 | number n of coordinates |
    /// | 2 | contact state of Table 2; 0 without support |
    /// | 3 | supporting leg: 0 right, 1 left |
    /// | 4 | termination: 0 none, else 1 + index in `Termination::ALL` |
    /// | 5 to 7 | top of the head in the world [m] |
    /// | 8 to 15 | contact forces (2, 4) [N]: supporting, free foot; f_y, N, N at the heel, N at the toe |
    /// | 16 | evaluations |
    /// | 17 | gait steps |
    /// | 18 | slide under load [m] |
    /// | 19 | unaccounted energy [J] |
    /// | 20 | forward velocity of the centre of mass [m/s] |
    /// | 40 to 58 | q, n entries [rad, m] |
    /// | 60 to 78 | v, n entries [rad/s, m/s] |
    /// | 80 to 181 | ends of the links (17, 2, 3) in the world [m] |
    pub fn state(&self) -> [f64; STATE_LENGTH] {
        let mut out = [0.0; STATE_LENGTH];
        let (sim, n) = (&self.sim, self.sim.model.n);
        let state = &sim.state;
        out[0] = state.t;
        out[1] = n as f64;
        out[2] = state.mode.number().into();
        out[3] = f64::from(u8::from(state.support_leg == Leg::Left));
        out[4] = sim.ended.map_or(0.0, |cause| 1.0 + cause as u8 as f64);
        out[5..8].copy_from_slice(&sim.head());
        out[8..16].copy_from_slice(self.contact_forces().as_flattened());
        let totals = sim.totals();
        out[16] = sim.stats.evaluations as f64;
        out[17] = totals.swaps as f64;
        out[18] = totals.loaded_slide;
        out[19] = sim.energy_residual();
        let eval = sim.full_kinematics();
        let ([forward, _], _) = eval.inertias.momentum(&sim.model, &eval.kin);
        out[20] = forward / sim.model.mass();
        let Coordinates { q, v } = sim.coordinates();
        out[POSITIONS..POSITIONS + NV].copy_from_slice(&q);
        out[RATES..RATES + NV].copy_from_slice(&v);
        let pivot = (state.q[0], state.q[1]);
        let segments = link_segments::segments(&sim.model, &eval, pivot, state.support_leg);
        let flat = segments.as_flattened().as_flattened();
        out[SEGMENTS..SEGMENTS + flat.len()].copy_from_slice(flat);
        out
    }

    /// Rows: supporting, free foot; columns: f_y, N, N at the heel, N at the toe [N].
    fn contact_forces(&self) -> [[f64; 4]; 2] {
        let (sim, solution) = (&self.sim, &self.sim.eval.solution);
        let [support, free] = sim.eval.loads(&sim.model, sim.state.mode);
        let row = |along: f64, [heel, toe]: [f64; 2]| [along, heel + toe, heel, toe];
        // Viscous friction is part of the damping matrix D.
        let drag = sim.model.damping[0] * sim.state.v[0];
        [
            row(solution.f_root[0] - drag, support),
            row(solution.lam[0], free),
        ]
    }
}
