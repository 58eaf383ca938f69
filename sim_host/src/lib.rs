//! Everything the controller is wired to, and what runs, scores and reports it.
pub mod bus;
pub mod node;
