//! Selection of the mode after an event, from accelerations and forces.

use crate::{
    contact::{conditions::Tolerance, mode_query::ModeQuery, mode_selection::select},
    error::Termination,
    events::{
        EventHandler, REST, SLOW_LANDING,
        guard::{FORCE_SLACK, Guard},
    },
    model::{
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact},
        friction::FrictionMode,
    },
    rhs::{StepContext, sole_points::SolePoints},
};

/// When an end lands, others this close to the ice land with it [m],
const CLOSE: f64 = 1e-9;
/// and others this close if they are slow.
const HOVERING: f64 = 1e-8;

impl EventHandler<'_> {
    /// Ends that are about to land at the same instant as one at a height of `landed` land together with it. One by
    /// one they would land without end, and in the order of their rounding errors.
    pub(super) fn with_close_ends(
        &self,
        mode: ContactMode,
        sole_points: &SolePoints,
        landed: f64,
    ) -> ContactMode {
        self.with_ends(mode, sole_points, |gap, speed| {
            let above = gap - landed.max(0.0);
            above <= CLOSE || above <= HOVERING && speed.abs() <= SLOW_LANDING
        })
    }

    /// An end that has opened at this instant may close again: the torques may have changed since.
    pub(super) fn with_resting_ends(&self, mode: ContactMode) -> ContactMode {
        self.with_ends(mode, &self.sole_points(), |gap, speed| {
            gap <= CLOSE && speed.abs() <= REST
        })
    }

    /// The mode, with every end closed for which `closed(height, vertical velocity)` is true.
    fn with_ends(
        &self,
        mode: ContactMode,
        sole_points: &SolePoints,
        closed: impl Fn(f64, f64) -> bool,
    ) -> ContactMode {
        let ends = sole_points.closed_ends(self.model, closed);
        let with = |foot: Foot, touch: SoleContact, which: usize| {
            let friction_mode = match foot.touch {
                SoleContact::Air => {
                    let [along, _] = sole_points.speeds[which][usize::from(!touch.heel())];
                    self.model.friction.mode_at(along, REST)
                }
                _ => foot.friction_mode,
            };
            let heel = foot.touch.heel() || touch.heel();
            let toe = foot.touch.toe() || touch.toe();
            Foot::new(SoleContact::of(heel, toe), friction_mode)
        };
        ContactMode {
            support: with(mode.support, ends.0, SUPPORT),
            free: with(mode.free, ends.1, FREE),
        }
    }

    /// Select the mode in which the motion continues and set it. `mode` has the closed ends, `sliding` the
    /// friction modes of feet that already slide, `ended` the mode that has ended and its guard.
    ///
    /// # Errors
    /// `Jam` or `Singular` where no mode is consistent.
    pub fn select_mode(
        &mut self,
        mode: ContactMode,
        sliding: [Option<FrictionMode>; 2],
        ended: Option<(ContactMode, Guard)>,
    ) -> Result<(), Termination> {
        self.update_frame(mode);
        self.factor();
        let context = StepContext::of(self.model, self.state, self.residual);
        let (q, v) = (self.state.q, self.state.v);
        self.eval.assemble_loads(self.model, &q, &v, &context);
        let force = FORCE_SLACK * self.model.weight();
        let tolerance = Tolerance {
            force,
            motion: 10.0 * force / self.model.mass(),
        };
        let closed = [mode.support.touch, mode.free.touch];
        let mut query = ModeQuery::new(closed, sliding, mode, tolerance);
        if let Some((before, guard)) = ended {
            query.excluded = Some(before);
            match guard {
                Guard::ConeForward(which) | Guard::ConeBackward(which) => {
                    query.must_slide = Some(which);
                }
                Guard::Load(which, end) if self.model.contact.is_push_only => {
                    query.may_load[which] = closed[which].with(end, false);
                    // An end that may close again must not count as the nearer choice.
                    query.reference = before;
                }
                _ => {}
            }
        }
        let problem = &self.eval.factored.problem;
        let mut selected = select(self.model, problem, &query).map(|(mode, _)| mode);
        if ended.is_some() {
            // A guard that triggered slightly early: the end stays loaded, the other foot slides, or only the old
            // mode is consistent and soon ends again.
            for excluded in [query.excluded, None] {
                if selected == Err(Termination::Jam) {
                    let relaxed = ModeQuery {
                        may_load: closed,
                        must_slide: None,
                        excluded,
                        ..query
                    };
                    selected = select(self.model, problem, &relaxed).map(|(mode, _)| mode);
                }
            }
        }
        match selected {
            Ok(mode) => self.set_mode(mode),
            Err(Termination::Jam) => self.stop_wedged_foot(mode, sliding)?,
            Err(cause) => return Err(cause),
        }
        Ok(())
    }
}
