//! How far a pose stream is off: in pixels, and against a reference trajectory.

pub mod align;
pub mod associate;
pub mod by_age;
pub mod held;
pub mod interval;
pub mod pixel;
pub mod plane;
pub mod quaternion_order;
pub mod rotation_offset;
pub mod rpe;
pub mod student;
pub mod trajectory;
