//! A plain link to the program that started the emulator, for an image that is no node on a bus: values in their byte form,
//! each waited for.

use super::semihosting::{Pipes, stop};
use super::timer::Counter;
use crate::board::counter::CycleCounter;
use crate::wire::{Sink, Wire};
use heapless::Vec;

/// Longest value, bytes.
const LONGEST: usize = 512;

/// The link, and the board's counter, for nothing else is open.
pub struct Link {
    pipes: Pipes,
    counter: Counter,
}

impl Link {
    /// Opens it. The shim must not be open: both use the same pipes.
    pub fn open() -> Self {
        Self {
            pipes: Pipes::open(),
            // SAFETY: timer 1 is the board's counter, and no board is open.
            counter: unsafe { Counter::start() },
        }
    }

    /// The count now.
    pub fn now(&self) -> u32 {
        self.counter.now()
    }

    /// Sends a value; stops the emulator if it is longer than 512 bytes or nobody takes it any more.
    pub fn send(&mut self, value: &impl Wire) {
        let mut bytes = Bytes(Vec::new());
        value.write(&mut bytes);
        self.pipes.write(&bytes.0);
    }

    /// Waits for as many bytes as these; stops the emulator if nothing comes any more.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        self.pipes.read(bytes);
    }

    /// Waits for a value; stops the emulator if what comes is none, or nothing comes any more.
    pub fn receive<T: Wire>(&mut self) -> T {
        let mut bytes = [0; LONGEST];
        let Some(bytes) = bytes.get_mut(..T::BYTES) else { stop() };
        self.fill(bytes);
        match T::read(&mut &*bytes) {
            Some(value) => value,
            None => stop(),
        }
    }
}

struct Bytes(Vec<u8, LONGEST>);

impl Sink for Bytes {
    fn put(&mut self, bytes: &[u8]) {
        if self.0.extend_from_slice(bytes).is_err() {
            stop()
        }
    }
}
