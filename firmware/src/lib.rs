//! What runs on the controller and in the camera.
//!
//! Floors from the ground up; a room imports only what stands below it: [`geometry`] → `arm` → `servo` and `vision` →
//! `job` → `safety` → `cycle`. SI units, f32 throughout; no allocation, no unbounded loop, no clock, no I/O.
#![no_std]

pub mod geometry;
pub mod vision;
