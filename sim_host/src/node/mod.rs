//! The nodes of the cell on the bus: servo drives, camera, I/O.
//!
//! Each is a `hal` slave with an application of its own, and meets the controller on the bus only. The runner hands it
//! frames and time, and gives it what stands for the physical world: encoder readings, images seen, buttons pressed.

pub mod camera;
pub mod drive;
pub mod io;
mod nodes;
#[cfg(test)]
mod tests;

pub use nodes::Nodes;
