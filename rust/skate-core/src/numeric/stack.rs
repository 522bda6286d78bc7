//! Stack of calls with large frames: registers of simulations, copies of a simulation, derivatives.

/// More than any call needs [bytes].
pub const STACK: usize = 1 << 20;

/// Make a call on this thread's stack, or on one from the heap where this thread has less than `STACK` left.
pub fn with_stack<R>(call: impl FnOnce() -> R) -> R {
    // Inlined, its frames would be part of the caller's.
    #[inline(never)]
    fn apart<R>(call: impl FnOnce() -> R) -> R {
        call()
    }
    #[cfg(target_family = "wasm")]
    return apart(call);
    #[cfg(not(target_family = "wasm"))]
    stacker::maybe_grow(STACK, 2 * STACK, || apart(call))
}
