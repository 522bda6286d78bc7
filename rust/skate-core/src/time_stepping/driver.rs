//! The sequence of steps of one simulation up to a given time. `StepDriver` requests one step after the other; the
//! caller computes it, alone or in SIMD lanes.

use crate::{
    error::Termination,
    model::contact_mode::ContactMode,
    sim::Simulation,
    time_stepping::{
        step_length::MIN_STEP,
        trial_steps::{MeanForces, Progress, StepRequest, TrialSteps},
    },
};

/// Driver of one simulation; see the module documentation.
#[derive(Debug, Clone)]
pub struct StepDriver {
    /// End time [s].
    until: f64,
    /// Length of a full step [s].
    full_length: f64,
    trials: TrialSteps,
    /// A step has begun.
    pub in_step: bool,
    /// Time to `until` at the start of the step [s].
    left: f64,
    /// Number of the last controller sample before the step.
    sample: i64,
    /// The controller has sampled the present state.
    sampled: bool,
}

impl StepDriver {
    /// Driver from the present state to the time `until`. Where it is inlined its large parts are copied once more.
    #[inline(never)]
    pub fn new(sim: &mut Simulation, until: f64) -> Self {
        let mut driver = Self {
            until,
            full_length: 0.0,
            trials: TrialSteps::new(sim),
            in_step: false,
            left: 0.0,
            sample: 0,
            sampled: false,
        };
        driver.start(sim, until);
        driver
    }

    /// Start anew for another simulation of the same structure. It has the same guards, which are kept.
    pub fn start(&mut self, sim: &mut Simulation, until: f64) {
        if sim.ended.is_none() && sim.state.t < until {
            sim.budget.add_call();
        }
        sim.prefetch_log();
        self.until = until;
        self.full_length = sim.model.scheme.full_step();
        (self.in_step, self.sampled) = (false, false);
        self.trials.previous = (sim.averaging_time > 0.0).then_some(MeanForces {
            forces: sim.eval.solution,
            h: sim.averaging_time,
        });
    }

    /// The next step to compute; None at the end time and after termination.
    #[inline(never)]
    pub fn next_request(&mut self, sim: &mut Simulation) -> Option<&StepRequest> {
        while !self.in_step && sim.ended.is_none() && sim.state.t < self.until {
            sim.ended = self.begin_step(sim).err();
        }
        (self.in_step && sim.ended.is_none()).then_some(&self.trials.request)
    }

    /// The requested step.
    pub fn request(&self) -> &StepRequest {
        &self.trials.request
    }

    /// Whether `process` needs the contact problem of the step.
    pub fn needs_contact_problem(&self) -> bool {
        self.trials.needs_contact_problem()
    }

    /// Continue after the requested step, which has ended in the contact mode `mode`.
    pub fn process(&mut self, sim: &mut Simulation, mode: Result<ContactMode, Termination>) {
        if mode == Err(Termination::NotFinite) && self.trials.shorten(sim) {
            return;
        }
        let done = mode.and_then(|mode| self.process_mode(sim, mode));
        sim.ended = done.err();
    }

    /// Set the contact forces at the end: the means over the last step, or if contacts or torques have changed since,
    /// the forces at the present state.
    pub fn finish(&self, sim: &mut Simulation) {
        if sim.ended.is_none() {
            match self.trials.previous {
                Some(means) => (sim.eval.solution, sim.averaging_time) = (means.forces, means.h),
                None => sim.ended = sim.evaluate().err(),
            }
        }
        sim.update_counters();
    }

    /// Begin a step, unless the end time is reached.
    fn begin_step(&mut self, sim: &mut Simulation) -> Result<(), Termination> {
        sim.stats.steps += 1;
        // A step checks the velocities at its end; events between two steps may change them.
        if self.trials.previous.is_none() {
            sim.check_velocities()?;
        }
        sim.charge()?;
        let left = self.until - sim.state.t;
        if left < MIN_STEP {
            sim.state.t = self.until;
            self.trials.previous = None;
            return Ok(());
        }
        let mut h = sim.time_step(left, self.full_length);
        let mut share = if sim.torque_jumped { 0.0 } else { h / left };
        sim.torque_jumped = false;
        self.sample = sim.sample_index();
        if !self.sampled {
            let sample = sim.time_to_noticed_sample();
            if sample < h {
                (h, share) = (sample, 1.0);
            }
        }
        self.left = left;
        self.trials.begin_step(sim, h, share, self.full_length)?;
        self.in_step = true;
        Ok(())
    }

    fn process_mode(&mut self, sim: &mut Simulation, mode: ContactMode) -> Result<(), Termination> {
        let Progress::Done(event) = self.trials.process(sim, mode)? else {
            return Ok(());
        };
        self.in_step = false;
        if event.is_none() && self.trials.h == self.left {
            sim.state.t = self.until;
        }
        if sim.sole_points.above_fall <= 0.0 {
            return Err(Termination::Fall);
        }
        self.trials.previous = event.is_none().then_some(MeanForces {
            forces: sim.eval.solution,
            h: self.trials.h,
        });
        if let Some(guard) = event {
            sim.land(guard)?;
        }
        self.sampled = sim.sample_index() > self.sample;
        if self.sampled {
            sim.sample();
        }
        Ok(())
    }
}
