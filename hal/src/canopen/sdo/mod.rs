//! Service data objects: read and write of single objects, for set-up and diagnosis.
//!
//! Expedited transfer both ways (up to four bytes), and segmented upload for strings. Nothing that we set up is longer
//! than four bytes, so a segmented download is refused with [`Abort::COMMAND`].

mod client;
mod codec;
mod server;

pub use client::{Client, Outcome, TEXT_MAX};
pub use codec::{Request, Response};
pub use server::Server;

/// Why a transfer was refused (CiA 301, table 22); unlisted codes of other vendors pass through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort(pub u32);

impl Abort {
    /// Toggle bit not alternated.
    pub const TOGGLE: Self = Self(0x0503_0000);
    /// SDO protocol timed out.
    pub const TIMEOUT: Self = Self(0x0504_0000);
    /// Command specifier not valid or unknown.
    pub const COMMAND: Self = Self(0x0504_0001);
    /// Out of memory: the answer is longer than its buffer.
    pub const MEMORY: Self = Self(0x0504_0005);
    /// Unsupported access to an object.
    pub const ACCESS: Self = Self(0x0601_0000);
    /// Attempt to read a write-only object.
    pub const WRITE_ONLY: Self = Self(0x0601_0001);
    /// Attempt to write a read-only object.
    pub const READ_ONLY: Self = Self(0x0601_0002);
    /// Object does not exist in the dictionary.
    pub const NO_OBJECT: Self = Self(0x0602_0000);
    /// Object cannot be mapped to the PDO.
    pub const UNMAPPABLE: Self = Self(0x0604_0041);
    /// Mapped objects would exceed the PDO's length.
    pub const PDO_LENGTH: Self = Self(0x0604_0042);
    /// Data type does not match, length of service parameter does not match.
    pub const LENGTH: Self = Self(0x0607_0010);
    /// Sub-index does not exist.
    pub const NO_SUB: Self = Self(0x0609_0011);
    /// Value out of range.
    pub const RANGE: Self = Self(0x0609_0030);
    /// Refused in the present device state.
    pub const STATE: Self = Self(0x0800_0022);
}
