//! Constraints that depend on each other, as with two straight legs: one component of the forces is not determined.

use crate::{
    contact::{
        elimination::{eliminate, proximal},
        equations::{
            ContactProblem, DEPENDENT, MAX_UNKNOWNS, PHI, Slip, Solution, Y, multipliers,
            root_unknowns,
        },
        loads::loads,
    },
    error::Termination,
    model::contact_mode::ContactMode,
};

/// A pivot may be as small as this times its scale where no small forces satisfy the equations: two digits of the force
/// that it determines are left.
const CONTRADICTORY: f64 = 1e-14;

/// Two solutions whose forces differ by less than this part of the load are the same one.
const SAME: f64 = 1e-6;

impl ContactProblem {
    /// Solution for the given mode.
    ///
    /// # Errors
    /// `Singular` where the motion of the root is not determined, or the forces of sticking feet have no
    /// correct digit; `NotFinite`.
    pub fn solve(&self, mode: ContactMode, slip: Slip) -> Result<Solution, Termination> {
        let (solution, regular) = self.regular(mode, slip);
        if regular {
            return Ok(solution);
        }
        self.solve_dependent(mode, slip)
    }

    /// Solution where the mode does not determine motion and forces uniquely: not `regular`. The sum of the squares of
    /// the loads on the ends of the soles and of the forces along the ice is least, whichever foot is the root. Where
    /// friction alone makes the equations singular, the free foot carries about half of the load, and the inconsistent
    /// part may stay.
    ///
    /// # Errors
    /// As for `solve`.
    #[inline(never)]
    pub fn solve_dependent(&self, mode: ContactMode, slip: Slip) -> Result<Solution, Termination> {
        let (root, n_root) = root_unknowns(mode.support);
        let (held, n_held) = multipliers(mode.free);
        let n = n_root + n_held;
        let scale = (n_root, self.mobility(n_held));
        let equations = self.equations::<MAX_UNKNOWNS>(mode, slip);
        let (_, outcome) = eliminate(equations, n, scale, DEPENDENT);
        match outcome.result() {
            Err(Termination::Singular) if n_held > 0 => {}
            result => result?,
        }
        let components = (&root[..n_root], &held[..n_held]);
        let start = self.half_load(&held[..n_held]);
        let (mut x, satisfied) = proximal(equations, n, scale, start)?;
        // With sliding friction the equations may be at a singular point of it, where forces stay finite.
        let without_friction = slip.support == 0.0 && slip.free == 0.0;
        let frictionless = self.equations::<MAX_UNKNOWNS>(mode, Slip::default());
        let (_, outcome) = eliminate(frictionless, n, scale, DEPENDENT);
        if satisfied && outcome.result() == Err(Termination::Singular) {
            // Nearest to another start there is another solution, if there is one.
            let mut start = start;
            if let Some(last) = start[..n_held].last_mut() {
                *last += self.b.amax();
            }
            let (other, _) = proximal(equations, n, scale, start)?;
            let solutions = [x, other].map(|x| self.solution(components, (mode, slip), &x));
            let least = self.least_between(mode, &solutions);
            for (x, other) in x.iter_mut().zip(other) {
                *x += least * (other - *x);
            }
        } else if without_friction && !satisfied {
            // Legs that are bent a little resist each other with large forces, on which a foot slips or lifts off.
            let (eliminated, outcome) = eliminate(equations, n, scale, CONTRADICTORY);
            outcome.result()?;
            x = eliminated;
        }
        let mut solution = self.solution(components, (mode, slip), &x);
        solution.a_free = self.free_motion(&solution);
        Ok(solution)
    }

    /// Where on the line from the first solution to the second the sum of squares is least; 0 if they are the same.
    fn least_between(&self, mode: ContactMode, solutions: &[Solution; 2]) -> f64 {
        let [first, second] = solutions.each_ref().map(|solution| {
            let [support, free] = loads(self.lever, mode, solution);
            let along = [solution.f_root[Y], solution.lam[Y]];
            [support, free, along].concat()
        });
        let (mut product, mut square) = (0.0, 0.0);
        for (first, second) in first.iter().zip(&second) {
            product += first * (second - first);
            square += (second - first) * (second - first);
        }
        let same = SAME * self.b.amax();
        let is_another = square > same * same;
        if is_another { -product / square } else { 0.0 }
    }

    /// Multipliers with which the free foot carries half of the load.
    fn half_load(&self, held: &[usize]) -> [f64; 3] {
        let mut half = [0.0; 3];
        for (half, &m) in half.iter_mut().zip(held) {
            *half = if m == PHI { 0.0 } else { -0.5 * self.b[m] };
        }
        half
    }
}
