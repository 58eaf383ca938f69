//! The boards that the images run on, and what every board shares with whoever stands at its other end.
//!
//! A board offers the same few handles under the same names, so that an image names no board; `chosen` is the one
//! that the build's feature chooses. They are a periodic
//! tick, a free-running counter ([`counter::CycleCounter`]), a CAN port in two halves, a trace port,
//! a region with the parameters, and what to do when idle. Registers, and with them `unsafe`, are touched nowhere else.
//!
//! What needs no register stands here for both ends: [`frames`] and [`report`] say what travels between an emulated board and
//! the program that plays its surroundings, [`fifo`] hands frames and [`mailbox`] the newest value from one priority
//! to another, [`parameters`] says how the parameter region is laid out, [`beat`] which timer event it is, [`histogram`] how a
//! distribution is kept in constant memory, [`load`] how a board is kept busy to see what that does to the tick.

pub mod beat;
pub mod counter;
pub mod crop;
pub mod fifo;
pub mod frames;
pub mod histogram;
pub mod load;
pub mod m_can;
pub mod mailbox;
#[cfg(all(feature = "mps2", target_os = "none"))]
#[allow(
    unsafe_code,
    reason = "registers, the vector table and the semihosting trap; each use says why it is sound"
)]
pub mod mps2;
#[cfg(all(feature = "nucleo-h743", target_os = "none"))]
#[allow(
    unsafe_code,
    reason = "registers, message memory and the vector table; each use says why it is sound"
)]
pub mod nucleo_h743;
#[cfg(all(any(feature = "mps2", feature = "nucleo-h743"), target_os = "none"))]
#[allow(unsafe_code, reason = "the proof of no panic names a function that does not exist")]
mod panic;
pub mod parameters;
pub mod report;
#[cfg(all(any(feature = "mps2", feature = "nucleo-h743"), target_os = "none"))]
#[allow(unsafe_code, reason = "memory below the stack; each use says why it is sound")]
pub mod stack;
#[cfg(all(any(feature = "mps2", feature = "nucleo-h743"), target_os = "none"))]
mod vector;

#[cfg(all(feature = "mps2", target_os = "none"))]
pub use mps2 as chosen;
#[cfg(all(feature = "nucleo-h743", not(feature = "mps2"), target_os = "none"))]
pub use nucleo_h743 as chosen;

#[cfg(all(feature = "mps2", feature = "nucleo-h743", target_os = "none"))]
compile_error!("an image runs on one board: choose one of the features mps2 and nucleo-h743");
