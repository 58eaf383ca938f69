//! Everything the controller is wired to, and what runs, scores and reports it.

pub mod candump;
pub mod cell;
pub mod log;
pub mod whole_file;
