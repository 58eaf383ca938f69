//! What to do next: the jobs, and what they keep of the path and of the past.

pub mod access;
pub mod aim;
pub mod correction;
pub mod exposure;
pub mod measure;
pub mod mount;
pub mod past;
pub mod path;
pub mod phase;
pub mod round;
pub mod seal;
pub mod shuttle;
pub mod stance;
pub mod start_pose;
pub mod survey;
pub mod task;
pub mod teach;
pub mod transit;
pub mod wish;
pub mod witness;
