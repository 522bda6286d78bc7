//! SIMD registers as scalars: eight lanes with AVX-512, four with AVX2, two with NEON.
//!
//! The available width is detected at run time; see `Width`. Values of these types exist only on processors that
//! have the registers, because only `Width::run` names the types. Code that computes with them is inlined into the
//! function that `Register::with_target_features` compiles for such processors; elsewhere each operation would be a
//! call that passes its operands through memory.

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod register;
#[cfg(test)]
mod tests;

use crate::numeric::scalar::Scalar;
#[cfg(target_arch = "aarch64")]
use register::F64x2;
#[cfg(target_arch = "x86_64")]
use register::{F64x4, F64x8};

/// A SIMD register.
pub trait Register: Scalar {
    /// Call `task` in a function that is compiled for processors with such registers. `task` and all functions in it
    /// that compute with `Self` must be `#[inline(always)]`.
    fn with_target_features<R>(task: impl FnOnce() -> R) -> R;
}

/// A computation for every width.
pub trait SimdTask {
    /// Compute without registers.
    fn run_scalar(self);
    /// Compute in registers.
    fn run_simd<T: Register>(self);
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
            #[cfg(target_arch = "x86_64")]
            Self::Eight => task.run_simd::<F64x8>(),
            #[cfg(target_arch = "x86_64")]
            Self::Four => task.run_simd::<F64x4>(),
            #[cfg(target_arch = "aarch64")]
            Self::Two => task.run_simd::<F64x2>(),
            _ => task.run_scalar(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl Register for F64x8 {
    #[inline(always)]
    fn with_target_features<R>(task: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx512f,avx512dq")]
        fn compiled<R>(task: impl FnOnce() -> R) -> R {
            task()
        }
        // SAFETY: values of this type exist only where the processor has such registers.
        unsafe { compiled(task) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Register for F64x4 {
    #[inline(always)]
    fn with_target_features<R>(task: impl FnOnce() -> R) -> R {
        // SAFETY: values of this type exist only where the processor has such registers.
        unsafe { run_with_avx2(task) }
    }
}

#[cfg(target_arch = "aarch64")]
impl Register for F64x2 {
    #[inline(always)]
    fn with_target_features<R>(task: impl FnOnce() -> R) -> R {
        run(task)
    }
}

/// A register of one lane, used where no others are available.
impl Register for f64 {
    #[inline(always)]
    fn with_target_features<R>(task: impl FnOnce() -> R) -> R {
        task()
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
    run(task)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_with_avx2<R>(task: impl FnOnce() -> R) -> R {
    task()
}

/// Run a closure in a function of its own, with the features that every processor of this architecture has.
#[inline(never)]
fn run<R>(task: impl FnOnce() -> R) -> R {
    task()
}
