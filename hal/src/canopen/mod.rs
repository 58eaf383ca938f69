//! CANopen (CiA 301) without any input or output of its own: bytes in, bytes out, time as a number.
//!
//! - [`cob`]: which identifier is which service; [`nmt`], [`sync`], [`emcy`], [`heartbeat`]: the small services;
//! - [`object`]: addresses and values of an object dictionary, and [`object::Device`], what a node is beyond its bus;
//! - [`sdo`]: read and write of objects, both ends; [`pdo`]: mapping and transmission of process data;
//! - [`slave`]: all of these joined into a node, for drives, camera and I/O alike.

pub mod cob;
pub mod emcy;
pub mod heartbeat;
pub mod nmt;
pub mod object;
pub mod pdo;
pub mod sdo;
pub mod slave;
pub mod sync;
