//! Scalars, vectors, spatial algebra and SIMD registers. This layer does not depend on the robot model.

pub mod checksum;
pub mod dual;
pub mod elementary;
pub mod planar;
pub mod prefetch;
pub mod random;
pub mod scalar;
pub mod simd;
pub mod spatial;
pub mod stack;
pub mod trig;
pub mod twist;
pub mod vec3;
