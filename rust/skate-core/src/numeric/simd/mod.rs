//! Vector registers as numbers: eight lanes with AVX-512, four with AVX2, two with NEON.
//!
//! Which of them a processor has is asked once, at run time; see `Width`. A value of such a type exists
//! only where the processor has its registers: `Width::run` alone makes them. All that works on them is
//! inlined into one function that the compiler makes for such a processor, or it would go through memory.

mod register;
#[cfg(test)]
mod tests;

use crate::numeric::scalar::Scalar;
#[cfg(target_arch = "aarch64")]
use register::Two;
#[cfg(target_arch = "x86_64")]
use register::{F64x4, F64x8};

/// Something to compute with as many lanes as there are.
pub trait SimdTask {
    /// To be inlined always, and all that it calls and that works on `T`.
    fn run<T: Scalar>(self);
}

/// How many lanes to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Width {
    One,
    Two,
    Four,
    Eight,
}

impl Width {
    /// Does this processor have registers of that width?
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

    /// Every width that this processor has, the widest last.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> {
        let all = [Self::One, Self::Two, Self::Four, Self::Eight];
        all.into_iter().filter(|width| width.is_available())
    }

    /// That of so many lanes, where this processor has it.
    pub fn of(lanes: usize) -> Option<Self> {
        Self::all().find(|width| width.lanes() == lanes)
    }

    /// The widest that this processor has.
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

    /// Do some work with so many lanes.
    ///
    /// # Panics
    /// Where the processor does not have them.
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

/// Do some work with one number at a time, in a copy of the code for newer processors where this is one.
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
