//! Asking the processor for what is about to be read, before its turn.

/// Bytes that come together.
const LINE: usize = 64;

/// Ask for all of `what`. It changes nothing but the time that its first use takes.
#[inline(always)]
pub fn prefetch<T: ?Sized>(what: &T) {
    let start = std::ptr::from_ref(what).cast::<u8>();
    let before = start as usize % LINE;
    for offset in (0..before + size_of_val(what)).step_by(LINE) {
        prefetch_line(start.wrapping_add(offset).wrapping_sub(before));
    }
}

/// Ask for what is around an address.
#[inline(always)]
pub fn prefetch_line(at: *const u8) {
    // SAFETY: these read nothing, and any address will do.
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
