//! A checksum of bytes.

/// FNV-1a (Fowler, Noll and Vo), modified to take eight bytes per round. Every round is invertible, so a
/// change of a single byte always changes the result.
pub fn checksum(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    let words = words.iter().chain([&last]);
    words.fold(0xcbf2_9ce4_8422_2325 ^ bytes.len() as u64, |sum, word| {
        // The rotation moves the high bits down, where the next multiplication spreads them.
        (sum ^ u64::from_le_bytes(*word))
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .rotate_left(32)
    })
}
