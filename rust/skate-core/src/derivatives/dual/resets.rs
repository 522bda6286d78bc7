//! Derivatives of projections and impacts, by the operations themselves on dual numbers.

use crate::{
    contact::equations::{PHI, Slip, Solution, Y},
    derivatives::{
        dual::{
            Varied,
            evaluation::{factor, response, solve, update},
        },
        variation::{Variation, held},
    },
    events::trace::Record,
    model::{
        contact_mode::{ContactMode, Foot, SoleContact},
        layout::{FREE_FOOT, NV, ROOT},
    },
    numeric::{dual::Dual, trig::wrap_angle, vec3},
    rhs::{Evaluation, Stance},
};
use nalgebra::Vector3;

/// Corrections of the positions. The derivative of a projection from a state on the constraints needs one; the
/// second covers states beside them.
const CORRECTIONS: usize = 2;

/// The state at an event, with a workspace.
pub struct Reset<'a> {
    pub models: Varied<'a>,
    pub eval: &'a mut Evaluation<Dual<f64>>,
    pub state: &'a mut Variation<f64>,
}

impl Reset<'_> {
    /// Apply a projection or an impact; other operations have no effect.
    pub fn apply(&mut self, record: &Record) {
        match *record {
            Record::CloseGaps { closed, projects } => self.close_gaps(closed, projects),
            Record::Impact { mode, has_friction } => self.impact(mode, has_friction),
            Record::Project(mode) => self.project(mode),
            _ => {}
        }
    }

    /// The closed ends move onto the ice; see `EventHandler::close_contacts`.
    fn close_gaps(&mut self, closed: ContactMode, projects: bool) {
        let zero = Dual::default();
        if closed.support.touch != SoleContact::Air {
            self.state.q[1] = zero;
            if closed.support.touch == SoleContact::Flat {
                self.state.q[2] = zero;
            }
        }
        if projects {
            let slide = crate::model::friction::FrictionMode::Forward;
            let sliding = ContactMode {
                support: Foot::new(closed.support.touch, slide),
                free: Foot::new(closed.free.touch, slide),
            };
            self.project_positions(sliding);
        }
    }

    /// Projection onto the free foot's constraints: positions, then velocities.
    fn project(&mut self, mode: ContactMode) {
        if mode.free.touch == SoleContact::Air {
            return;
        }
        self.project_positions(mode);
        self.update(mode);
        let mut velocity = Vector3::from(self.eval.point_velocity);
        let [y, _, rotation]: [Dual<f64>; 3] = held(mode);
        velocity[Y] *= y;
        velocity[PHI] *= rotation;
        let models = self.models;
        let step = self.correction(mode, velocity);
        for c in 0..models.model.n {
            self.state.v[c] += step[c];
        }
    }

    fn project_positions(&mut self, mode: ContactMode) {
        self.update(mode);
        let rows = Stance::of(self.models, mode).rows;
        let models = self.models;
        factor(self.eval, models, rows);
        let [y, _, rotation]: [Dual<f64>; 3] = held(mode);
        for _ in 0..CORRECTIONS {
            let angle = self.eval.kin.angle[FREE_FOOT];
            let (q, point) = (&self.state.q, self.eval.point);
            let violation = Vector3::new(
                y * (q[0] + point.y - self.state.anchor),
                q[1] + point.z,
                rotation * wrap_angle(angle),
            );
            let step = self.correction(mode, violation);
            for c in 0..models.model.n {
                self.state.q[c] += step[c];
            }
            self.update(mode);
        }
    }

    /// Change of all coordinates that removes a violation of the free foot's constraints.
    fn correction(&mut self, mode: ContactMode, violation: Vector3<Dual<f64>>) -> [Dual<f64>; NV] {
        let problem = &mut self.eval.factored.problem;
        (problem.b, problem.alpha0) = (vec3::zero(), violation);
        let (Solution { a_root, lam, .. }, _) = solve(self.eval, mode, Slip::default());
        response(self.eval, self.models, (&a_root, &lam))
    }

    /// Inelastic impact; see `EventHandler::apply_impact_with`.
    fn impact(&mut self, mode: ContactMode, has_friction: bool) {
        self.update(mode);
        let rows = Stance::of(self.models, mode).rows;
        factor(self.eval, self.models, rows);
        let slip = match has_friction {
            true => Slip::of(self.models, mode),
            false => Slip::default(),
        };
        let v = &mut self.state.v;
        let root = Vector3::new(v[0], v[1], v[2]);
        let point = Vector3::from(self.eval.point_velocity);
        let problem = &mut self.eval.factored.problem;
        problem.b = vec3::apply(&problem.S, &root);
        if rows > 0 {
            problem.alpha0 = vec3::sub(&point, &vec3::apply(&problem.G, &root));
        }
        let (Solution { a_root, lam, .. }, _) = solve(self.eval, mode, slip);
        let change = vec3::sub(&a_root, &root);
        let change = response(self.eval, self.models, (&change, &lam));
        for c in 0..self.models.model.n {
            v[c] = if c < ROOT {
                a_root[c]
            } else {
                v[c] + change[c]
            };
        }
    }

    /// Kinematics at the present state in the frame of `mode`.
    fn update(&mut self, mode: ContactMode) {
        update(self.eval, self.models, mode, (&self.state.q, &self.state.v));
    }
}
