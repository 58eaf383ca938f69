//! Everything the controller is wired to, and what runs, scores and reports it.

pub mod candump;
pub mod calibration;
pub mod camera;
pub mod cell;
pub mod image_file;
pub mod log;
pub mod progress;
pub mod report;
pub mod table;
pub mod whole_file;
