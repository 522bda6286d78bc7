//! The equations of motion in velocities and impulses: for time steps (Moreau 1988), impacts and projections.

use crate::{
    contact::equations::{Solution, Y, Z},
    model::{
        lanes::ModelLanes,
        layout::{FREE_FOOT, NV},
    },
    numeric::{scalar::Scalar, vec3},
    rhs::Evaluation,
};
use nalgebra::Vector3;

impl<T: Scalar> Evaluation<T> {
    /// Set the contact problem's b and alpha0 for velocities and impulses over `h` seconds, with the torques of
    /// `control`. Joint friction is taken at the velocities `v`, inertial forces at `mean`. The free foot's
    /// motion is that at the end of the step.
    #[inline(always)]
    pub fn assemble_impulse_problem(
        &mut self,
        models: impl ModelLanes<T>,
        (v, mean): (&[T; NV], &[T; NV]),
        h: T,
    ) {
        self.reduce_forces(models, mean, v);
        for force in &mut self.reduced {
            *force *= h;
        }
        self.factored
            .set_loads(models.shape(), &self.reduced, vec3::zero());
        let root = Vector3::new(v[0], v[1], v[2]);
        let has_rows = self.factored.rows() > 0;
        let problem = &mut self.factored.problem;
        problem.b = vec3::add(&problem.b, &vec3::apply(&problem.S, &root));
        if has_rows {
            let velocity = Vector3::from(self.point_velocity);
            let own = vec3::sub(&velocity, &vec3::apply(&problem.G, &root));
            problem.alpha0 = vec3::add(&problem.alpha0, &own);
            // Kinematics are those of the midpoint; J v at the end differs by h/2 J' v.
            let rate = self
                .kin
                .acceleration(FREE_FOOT, [self.point.y, self.point.z]);
            self.drift = rate.map(|rate| T::of(0.5) * h * rate);
            problem.alpha0[Y] += self.drift[Y];
            problem.alpha0[Z] += self.drift[Z];
        }
    }

    /// Change of the velocities `v` by the forces of `assemble_impulse_problem` and a solution of its contact
    /// problem.
    #[inline(always)]
    pub fn velocity_change(
        &mut self,
        models: impl ModelLanes<T>,
        v: &[T; NV],
        solution: &Solution<T>,
    ) -> &[T; NV] {
        let root = vec3::sub(&solution.a_root, &Vector3::new(v[0], v[1], v[2]));
        self.factored
            .back_substitute(models, (&root, &solution.lam), &mut self.reduced);
        &self.reduced
    }

    /// Motion of all coordinates caused by a motion of the root and impulses on the free foot, after `factor`.
    #[inline(always)]
    pub fn response(
        &mut self,
        models: impl ModelLanes<T>,
        root: &Vector3<T>,
        impulse: &Vector3<T>,
    ) -> &[T; NV] {
        self.qdd = [T::zero(); NV];
        self.factored.clear_loads();
        self.factored
            .back_substitute(models, (root, impulse), &mut self.qdd);
        &self.qdd
    }
}
