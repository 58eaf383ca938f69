//! What runs on the controller and in the camera.
//!
//! Floors from the ground up; a room imports only what stands below it: [`geometry`] → [`arm`] → [`servo`] and `vision` →
//! [`job`] → [`safety`] → [`cycle`] → [`controller`]; `vision` → [`camera`]. [`fault`] is the data that job and safety speak of.
//! SI units, f32 throughout; no allocation, no unbounded loop, no clock, no I/O.
#![no_std]
#![forbid(unsafe_code)]

pub mod arm;
pub mod camera;
pub mod controller;
pub mod cycle;
pub mod fault;
pub mod geometry;
pub mod job;
pub mod safety;
pub mod servo;
pub mod vision;
