//! A step of a batch with the derivatives of every action.

use crate::{
    batch::{Autoreset, Batch, Outcome, chunk_size, in_chunks, lock, memory, run_on},
    error::Invalid,
    task::ActionDerivatives,
};
use std::sync::{Mutex, PoisonError};

impl Batch {
    /// `step` with derivatives: of the action of each episode, None where it has ended the motion, the
    /// motion is stiff, or the step has reset the episode instead. Observations and outcomes have the bits of
    /// `step`.
    ///
    /// # Errors
    /// As `step`, as `Task::check_derivatives`, and where the memory does not suffice; then nothing has changed.
    pub fn step_differentiated(
        &mut self,
        actions: &[f64],
        observations: &mut [f32],
        outcomes: &mut [Outcome],
        go_on: &dyn Fn() -> bool,
    ) -> Result<Vec<Option<ActionDerivatives>>, Invalid> {
        self.task.check_derivatives()?;
        memory::check_derivatives(&self.task, self.episodes.len())?;
        let n = self.episodes.len();
        let threads = self.threads.min(n);
        self.ready = false;
        let mut derivatives = vec![None; n];
        let chunk = chunk_size(n, threads);
        let (task, autoreset) = (&self.task, self.autoreset);
        let chunks = in_chunks(
            task,
            chunk,
            &mut self.episodes,
            actions,
            observations,
            outcomes,
        );
        let chunks = Mutex::new(chunks.zip(derivatives.chunks_mut(chunk)));
        let done = Mutex::new(Ok(()));
        run_on(threads, go_on, |go_on| {
            let next = || lock(&chunks).next();
            while let Some((steps, derivatives)) = next() {
                for (step, by) in steps.zip(derivatives) {
                    if !go_on() {
                        return;
                    }
                    let stepped = step.run(task, autoreset, |episode, action| {
                        let result;
                        (result, *by) = episode.step_differentiated(task, action)?;
                        Ok(result)
                    });
                    if stepped.is_err() {
                        *lock(&done) = stepped;
                    }
                }
            }
        });
        done.into_inner().unwrap_or_else(PoisonError::into_inner)?;
        self.ready = self.autoreset != Autoreset::Disabled;
        Ok(derivatives)
    }
}
