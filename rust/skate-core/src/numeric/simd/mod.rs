//! SIMD registers as scalars: eight lanes with AVX-512, four with AVX2, two with NEON.
//!
//! The available width is detected at run time; see `Width`. Values of these types exist only on processors
//! that have the registers, because only `Width::run` creates them. All code on them is inlined into one
//! function with the target features enabled; otherwise registers would be passed through memory.

mod register;
#[cfg(test)]
mod tests;

use crate::numeric::scalar::Scalar;
#[cfg(target_arch = "aarch64")]
use register::Two;
#[cfg(target_arch = "x86_64")]
use register::{F64x4, F64x8};

/// Generic computation that runs with any lane count.
pub trait SimdTask {
    /// Mark it `#[inline(always)]`, and everything it calls on `T`.
    fn run<T: Scalar>(self);
}

/// Number of lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    One,
    Two,
    Four,
    Eight,
}

impl Width {
    /// Whether this processor has registers of that width.
    pub fn is_available(self) -> bool {
        match self {
            Self::One => true,
            #[cfg(target_arch = "aarch64")]
            Self::Two => true,
            #[cfg(target_arch = "x86_64")]
            Self::Four => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Eight => {
                is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
            }
            #[allow(unreachable_patterns)]
            _ => false,
        }
    }

    /// All widths available on this processor, the widest last.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> {
        let all = [Self::One, Self::Two, Self::Four, Self::Eight];
        all.into_iter().filter(|width| width.is_available())
    }

    /// The width with `lanes` lanes, if it is available.
    pub fn of(lanes: usize) -> Option<Self> {
        Self::all().find(|width| width.lanes() == lanes)
    }

    /// The widest available width.
    pub fn widest() -> Self {
        Self::all().next_back().unwrap_or(Self::One)
    }

    pub fn lanes(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// Run a task with this many lanes.
    ///
    /// # Panics
    /// If the processor does not have such registers.
    pub fn run(self, task: impl SimdTask) {
        assert!(self.is_available(), "no registers of {self:?} lanes here");
        match self {
            // SAFETY: the processor has what the function was compiled for.
            #[cfg(target_arch = "x86_64")]
            Self::Eight => unsafe { run_avx512(task) },
            #[cfg(target_arch = "x86_64")]
            Self::Four => unsafe { run_avx2(task) },
            #[cfg(target_arch = "aarch64")]
            Self::Two => task.run::<F64x2>(),
            _ => task.run::<f64>(),
        }
    }
}

/// Run a scalar closure, compiled with AVX2 enabled if the processor has it.
#[inline(always)]
pub fn with_avx2<R>(task: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if Width::Four.is_available() {
        // SAFETY: the processor has what the function was compiled for.
        return unsafe { run_with_avx2(task) };
    }
    task()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_with_avx2<R>(task: impl FnOnce() -> R) -> R {
    task()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn run_avx512(task: impl SimdTask) {
    task.run::<F64x8>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(task: impl SimdTask) {
    task.run::<F64x4>();
}
