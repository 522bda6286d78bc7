//! Numbers, vectors, spatial algebra and SIMD registers. Nothing here knows of robots.

pub mod checksum;
pub mod planar;
pub mod prefetch;
pub mod scalar;
pub mod simd;
pub mod spatial;
pub mod trig;
pub mod vec3;
