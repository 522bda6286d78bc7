//! Fuzz target; see the library.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    skate_fuzz::run_input(bytes);
});
