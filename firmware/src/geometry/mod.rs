//! Poses, rotations and the f32 functions they need. The ground floor.

mod pose;

pub use pose::Pose;
