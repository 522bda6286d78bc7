//! Prefetch instructions.

/// Cache line [bytes].
const LINE: usize = 64;

/// Prefetch all cache lines of `what`. This has no effect other than on the time of the first access.
#[inline(always)]
pub fn prefetch<T: ?Sized>(what: &T) {
    let start = std::ptr::from_ref(what).cast::<u8>();
    let before = start as usize % LINE;
    for offset in (0..before + size_of_val(what)).step_by(LINE) {
        prefetch_line(start.wrapping_add(offset).wrapping_sub(before));
    }
}

/// Prefetch the cache line that holds an address.
#[inline(always)]
pub fn prefetch_line(at: *const u8) {
    // SAFETY: a prefetch does not access memory architecturally, so any address is valid.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(at.cast());
    }
    #[cfg(target_arch = "aarch64")]
    unsafe {
        std::arch::asm!("prfm pldl1keep, [{}]", in(reg) at, options(nostack, readonly, preserves_flags));
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = at;
}
