//! Everything the controller is wired to, and what runs, scores and reports it.
//!
//! [`cell`] (the true part), [`plant`] (the arm) and [`camera`] are the world; [`node`] and [`bus`] are what the controller is wired to;
//! [`seal`] and [`teach`] run a job in it and keep the score, many times over as a [`campaign`]; [`jitter`] measures the cycle's timing,
//! [`latency`] the camera's; [`log`], [`candump`] and [`report`] are what a run leaves; [`calibration`] finds the camera and its place;
//! [`mod@bench`] counts what the cycle costs; [`cli`] is the command line.

pub mod bench;
pub mod bus;
pub mod calibration;
pub mod camera;
pub mod campaign;
pub mod candump;
pub mod cell;
pub mod cli;
pub mod image_file;
pub mod jitter;
pub mod latency;
pub mod log;
pub mod model;
pub mod node;
pub mod plant;
pub mod progress;
pub mod report;
pub mod seal;
pub mod table;
pub mod target;
pub mod taught;
pub mod teach;
pub mod training;
pub mod whole_file;
