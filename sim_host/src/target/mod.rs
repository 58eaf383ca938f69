//! The controller on an emulated Cortex-M, in lock step with the cell.
//!
//! [`emulator`] runs QEMU with an image and speaks with its board; [`controller`] makes of it a controller with the calls of
//! [`firmware::controller::Controller`]; [`camera`] likewise a camera node; [`cost`] is what a cycle takes, there or in process;
//! [`image`] finds the image; [`region`] lays out its parameters; [`figures`] and [`vision`] say what the boards measured of themselves; [`node`] is
//! either that controller or the one in process; [`core`] is the core alone, for replays, and [`net`] the neural seam finder alone.

pub mod camera;
pub mod controller;
pub mod core;
pub mod cost;
pub mod emulator;
pub mod figures;
pub mod image;
pub mod net;
pub mod node;
pub mod region;
pub mod vision;

#[cfg(test)]
mod tests;
