//! Everything the controller is wired to, and what runs, scores and reports it.

pub mod model;
pub mod plant;
