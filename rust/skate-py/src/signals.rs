//! Signals during long calls: Ctrl-C and the handlers that Python has installed.

use pyo3::prelude::*;
use skate_core::numeric::stack::with_stack;
use std::{
    cell::{Cell, RefCell},
    time::{Duration, Instant},
};

/// Time between two checks for signals.
const PERIOD: Duration = Duration::from_millis(50);
/// The clock is read at every call of `go_on` at first, and at every 32nd if the calls follow quickly.
const QUICK: Duration = Duration::from_millis(2);
const MAX_SKIPPED: u32 = 32;

/// Run `work` without the interpreter's lock. It calls the function that it gets from time to time, on this thread,
/// and stops soon after that has returned false.
///
/// # Errors
/// What a signal handler has raised, such as `KeyboardInterrupt`. Only Python's main thread runs handlers.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&dyn Fn() -> bool) -> T + Send,
) -> PyResult<T> {
    let (done, raised) = py.detach(|| {
        let signals = Signals::default();
        let done = with_stack(|| work(&|| signals.go_on()));
        (done, signals.raised.into_inner())
    });
    raised.map_or(Ok(done), Err)
}

#[derive(Default)]
struct Signals {
    raised: RefCell<Option<PyErr>>,
    /// Calls until the clock is read again, and between two readings.
    left: Cell<u32>,
    skipped: Cell<u32>,
    /// Times of the last reading and of the last check.
    read: Cell<Option<Instant>>,
    checked: Cell<Option<Instant>>,
}

impl Signals {
    fn go_on(&self) -> bool {
        if let Some(left) = self.left.get().checked_sub(1) {
            self.left.set(left);
            return true;
        }
        self.raised.borrow().is_none() && self.read_clock()
    }

    fn read_clock(&self) -> bool {
        let now = Instant::now();
        let Some(read) = self.read.replace(Some(now)) else {
            self.checked.set(Some(now));
            return true;
        };
        let skipped = match now - read {
            passed if passed < QUICK => (2 * self.skipped.get()).clamp(1, MAX_SKIPPED),
            _ => 0,
        };
        self.skipped.set(skipped);
        self.left.set(skipped);
        let due = self
            .checked
            .get()
            .is_none_or(|checked| now - checked >= PERIOD);
        if !due {
            return true;
        }
        self.checked.set(Some(now));
        let raised = Python::attach(|py| py.check_signals()).err();
        if raised.is_none() {
            return true;
        }
        self.raised.replace(raised);
        self.left.set(0);
        false
    }
}
