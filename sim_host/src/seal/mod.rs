//! Sealing in the emulated cell: what is drawn, how one trial runs, how it is scored, and campaigns of trials.

pub mod ablation;
pub mod campaign;
pub mod cell;
pub mod lockstep;
pub mod recording;
mod register;
pub mod scenario;
pub mod score;
pub mod second;
pub mod setup;
pub mod trial;
mod watch;
pub mod words;
