//! Everything the controller is wired to, and what runs, scores and reports it.

pub mod camera;
pub mod cell;
