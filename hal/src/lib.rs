//! The edge of the controller: everything that touches a wire, and nothing that decides.
//!
//! - [`board`]: the boards that images run on, the only part that touches registers;
//! - [`can`]: the frame that travels, on `embedded-can`'s traits;
//! - [`process`]: the process image, what one control cycle reads ([`process::Inputs`]) and writes ([`process::Outputs`]);
//! - [`stage`]: the stages of a control cycle, and how each one's cost is told from the others';
//! - [`wire`]: the fixed-size byte form of the process image and of parameters, for logs, hashes and channels.
#![no_std]

pub mod board;
pub mod camera;
pub mod can;
pub mod canopen;
pub mod cia402;
pub mod io;
pub mod master;
pub mod process;
pub mod stage;
pub mod telemetry;
pub mod wire;
