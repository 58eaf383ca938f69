//! Poses, rotations and the f32 functions they need. The ground floor.

mod pose;
pub mod rotation;
pub mod trig;

pub use pose::Pose;
