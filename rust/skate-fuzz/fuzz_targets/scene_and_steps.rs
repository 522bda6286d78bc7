//! Bytes to a scene and steps; see the library.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    skate_fuzz::play(bytes);
});
