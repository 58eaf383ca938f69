//! The run log, `.tlog`: everything the core read and wrote, cycle by cycle, so that a run can be stepped again.
//!
//! All numbers are little-endian, values in the byte form of [`hal::wire`]:
//!
//! | part | bytes |
//! |---|---|
//! | header | magic (8), version u16, axes u8, bytes of one `Inputs` u16, of one `Outputs` u16, |
//! | | of the core's parameters u32, of the description u32; |
//! | | the parameters in their byte form; the description, JSON in UTF-8; FNV-1a of the header so far (8) |
//! | each cycle | `Inputs` (120), running hash (8), `Outputs` (75), running hash (8), [`Trail`] of its stages (81), its hash (8) |
//! | trailer | number of cycles u64, final running hash (8), end mark (8) |
//!
//! The running hash is FNV-1a over the parameters and every input and output up to there; the description is not in it, nor are the
//! trails: the hash of a trail is FNV-1a over the running hash and it.
//! FNV-1a maps its state one to one at each step, so that no change of a single byte can leave it the same: damage is
//! always seen, and always at its own cycle. One cycle takes 300 bytes: 60 kB for a second at 5 ms.

mod read;
mod replay;
mod write;

use hal::process::{Inputs, Outputs};
use hal::stage::Trail;
use hal::wire::{Fnv64, Sink, Wire};
use hal::wire_struct;

pub use read::{Damage, Log};
pub use replay::{Answer, Difference, ReplayReport, replay};
pub use write::LogWriter;

/// Axes of the arms that this simulator runs.
const AXES: usize = 6;

/// Begins a log. As in PNG: a byte over 127 and both line ends, so that a transfer as text is noticed.
const MAGIC: [u8; 8] = *b"\x89TLOG\r\n\x1a";
/// Ends a log.
const END: [u8; 8] = *b"TLOG.end";
/// Raised by every change of the layout or of the process image.
const VERSION: u16 = 2;

/// Bytes of a header before its two variable parts.
const HEAD_BYTES: usize = MAGIC.len() + Head::BYTES;
/// Bytes of a cycle.
const CYCLE_BYTES: usize = Inputs::<AXES>::BYTES + 8 + Outputs::<AXES>::BYTES + 8 + Trail::BYTES + 8;
/// Bytes of the trailer.
const TRAILER_BYTES: usize = 8 + 8 + END.len();

/// The sizes that a header begins with, after the magic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Head {
    version: u16,
    axes: u8,
    inputs: u16,
    outputs: u16,
    parameters: u32,
    description: u32,
}

wire_struct!(Head {
    version: u16,
    axes: u8,
    inputs: u16,
    outputs: u16,
    parameters: u32,
    description: u32
});

impl Head {
    /// This program's, for variable parts of these lengths.
    fn new(parameters: u32, description: u32) -> Self {
        Self {
            version: VERSION,
            axes: AXES as u8,
            inputs: Inputs::<AXES>::BYTES as u16,
            outputs: Outputs::<AXES>::BYTES as u16,
            parameters,
            description,
        }
    }
}

/// The running hash of a run, for those who want the hash and no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunHash(Fnv64);

impl RunHash {
    /// Of a run with these parameters, in their byte form, before its first cycle.
    pub fn new(parameters: &[u8]) -> Self {
        let mut hash = Fnv64::default();
        hash.put(parameters);
        Self(hash)
    }

    /// Takes in the inputs or the outputs of a cycle.
    pub fn take(&mut self, value: &impl Wire) {
        value.write(&mut self.0);
    }

    /// Hash of a trail at this place of the run.
    fn of_trail(&self, trail: &Trail) -> u64 {
        let mut hash = self.0;
        trail.write(&mut hash);
        hash.0
    }

    /// The hash so far.
    pub fn value(&self) -> u64 {
        self.0.0
    }
}

/// A growing buffer as a [`Sink`].
#[derive(Default)]
struct Buffer(Vec<u8>);

impl Sink for Buffer {
    fn put(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }
}

/// The byte form of a value.
pub fn bytes_of(value: &impl Wire) -> Vec<u8> {
    let mut buffer = Buffer::default();
    value.write(&mut buffer);
    buffer.0
}

#[cfg(test)]
mod tests;
