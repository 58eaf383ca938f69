//! Frames from one priority to a higher one, without a lock and without `unsafe`.
//!
//! One context puts, one takes; either may interrupt the other. A slot is three atomic words, so even a second producer
//! could at worst garble frames. Full means lost: the newest are refused, and the putter is told.

use super::frames::FRAMES_MAX;
use crate::can::Frame;
use core::sync::atomic::{AtomicU32, Ordering};

/// Slots, a power of two: indices run freely and wrap with their type.
const SLOTS: u32 = FRAMES_MAX as u32;
const _: () = assert!(SLOTS.is_power_of_two());

/// The queue.
pub struct Fifo {
    slots: [[AtomicU32; 3]; SLOTS as usize],
    /// Frames ever put; written by the putter alone.
    put: AtomicU32,
    /// Frames ever taken; written by the taker alone.
    taken: AtomicU32,
}

impl Fifo {
    /// An empty queue.
    pub const fn new() -> Self {
        Self {
            slots: [const { [const { AtomicU32::new(0) }; 3] }; SLOTS as usize],
            put: AtomicU32::new(0),
            taken: AtomicU32::new(0),
        }
    }

    fn slot(&self, at: u32) -> Option<&[AtomicU32; 3]> {
        self.slots.get((at % SLOTS) as usize)
    }

    /// Puts a frame; false if there is no room for it.
    pub fn put(&self, frame: &Frame) -> bool {
        let put = self.put.load(Ordering::Relaxed);
        // Acquire: the taker has read a slot before it counts it as taken.
        if put.wrapping_sub(self.taken.load(Ordering::Acquire)) >= SLOTS {
            return false;
        }
        let Some(slot) = self.slot(put) else { return false };
        for (slot, word) in slot.iter().zip(frame.to_words()) {
            slot.store(word, Ordering::Relaxed);
        }
        // Release: whoever sees the count sees the slot.
        self.put.store(put.wrapping_add(1), Ordering::Release);
        true
    }

    /// Takes the oldest frame.
    pub fn take(&self) -> Option<Frame> {
        let taken = self.taken.load(Ordering::Relaxed);
        if taken == self.put.load(Ordering::Acquire) {
            return None;
        }
        let frame = self.frame(taken);
        self.taken.store(taken.wrapping_add(1), Ordering::Release);
        frame
    }

    /// Takes all frames that are there now, oldest first, at half of what one at a time costs; what comes in the meantime stays for the next time.
    pub fn drain(&self, mut to: impl FnMut(Frame)) {
        let put = self.put.load(Ordering::Acquire);
        let mut taken = self.taken.load(Ordering::Relaxed);
        while taken != put {
            if let Some(frame) = self.frame(taken) {
                to(frame);
            }
            taken = taken.wrapping_add(1);
        }
        self.taken.store(put, Ordering::Release);
    }

    fn frame(&self, at: u32) -> Option<Frame> {
        let words = self.slot(at)?.each_ref().map(|word| word.load(Ordering::Relaxed));
        Frame::from_words(words)
    }
}

impl Default for Fifo {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::sync::Arc;
    use std::thread;

    fn numbered(n: u32) -> Frame {
        Frame::data((n % 0x800) as u16, &u64::from(n).to_le_bytes()[..1 + (n % 8) as usize]).unwrap()
    }

    #[test]
    fn sixty_four_frames_fit_and_the_next_is_refused() {
        let fifo = Fifo::new();
        for n in 0..64 {
            assert!(fifo.put(&numbered(n)));
        }
        assert!(!fifo.put(&numbered(64)));
        for n in 0..4 {
            assert_eq!(fifo.take(), Some(numbered(n)));
        }
        let mut rest = 4..64;
        fifo.drain(|frame| assert_eq!(Some(frame), rest.next().map(numbered)));
        assert_eq!(rest.len(), 0);
        assert_eq!(fifo.take(), None);
    }

    #[test]
    fn frames_arrive_whole_and_in_order_while_both_ends_are_at_work() {
        let fifo = Arc::new(Fifo::new());
        let far = Arc::clone(&fifo);
        let putter = thread::spawn(move || {
            for n in 0..100_000 {
                while !far.put(&numbered(n)) {
                    thread::yield_now();
                }
            }
        });
        for n in 0..100_000 {
            let frame = loop {
                match fifo.take() {
                    Some(frame) => break frame,
                    None => thread::yield_now(),
                }
            };
            assert_eq!(frame, numbered(n));
        }
        putter.join().unwrap();
    }
}
