//! The newest value from one priority to another: nothing queues, nothing locks, no `unsafe`.
//!
//! One context puts. Whoever takes may stand above or below it: a value is written into the half that nobody reads, and a
//! value that was overwritten while it was read is read again. Above the putter the first try always succeeds.

use core::sync::atomic::{AtomicU32, Ordering, fence};

/// Tries of a reader. Each that fails was overtaken by two newer values, and the putter comes once in a timer event.
const TRIES: u32 = 4;

/// A mailbox for a value of `W` words.
pub struct Mailbox<const W: usize> {
    /// Value number n stands in half n mod 2.
    halves: [[AtomicU32; W]; 2],
    /// Number of the newest; zero is none. Written by the putter alone.
    newest: AtomicU32,
}

impl<const W: usize> Mailbox<W> {
    /// Without a value.
    pub const fn new() -> Self {
        Self {
            halves: [const { [const { AtomicU32::new(0) }; W] }; 2],
            newest: AtomicU32::new(0),
        }
    }

    fn half(&self, number: u32) -> &[AtomicU32; W] {
        let [even, odd] = &self.halves;
        if number.is_multiple_of(2) { even } else { odd }
    }

    /// Puts a value in place of the one before. One context only.
    pub fn put(&self, value: &[u32; W]) {
        let number = match self.newest.load(Ordering::Relaxed).wrapping_add(1) {
            0 => 2, // zero is none; the half is the same
            number => number,
        };
        // Whoever sees a word of this value sees that the one before is no longer two behind.
        fence(Ordering::Release);
        for (place, word) in self.half(number).iter().zip(value) {
            place.store(*word, Ordering::Relaxed);
        }
        self.newest.store(number, Ordering::Release);
    }

    /// The newest value; none if there is none yet, or if newer ones came faster than they could be read.
    pub fn newest(&self) -> Option<[u32; W]> {
        for _ in 0..TRIES {
            let number = self.newest.load(Ordering::Acquire);
            if number == 0 {
                return None;
            }
            let value = self.half(number).each_ref().map(|word| word.load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if self.newest.load(Ordering::Relaxed) == number {
                return Some(value);
            }
        }
        None
    }
}

impl<const W: usize> Default for Mailbox<W> {
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

    #[test]
    fn the_newest_value_is_there_as_often_as_one_looks_and_older_ones_are_not() {
        let mailbox = Mailbox::new();
        assert_eq!(mailbox.newest(), None);
        mailbox.put(&[1, 2]);
        mailbox.put(&[3, 4]);
        assert_eq!(mailbox.newest(), Some([3, 4]));
        assert_eq!(mailbox.newest(), Some([3, 4]));
    }

    #[test]
    fn numbers_that_wrap_leave_no_gap() {
        let mailbox = Mailbox::new();
        mailbox.newest.store(u32::MAX - 1, Ordering::Relaxed);
        for value in 0..5 {
            mailbox.put(&[value]);
            assert_eq!(mailbox.newest(), Some([value]));
        }
    }

    #[test]
    fn a_value_is_read_whole_and_never_an_older_one_than_before_while_it_is_written() {
        let mailbox = Arc::new(Mailbox::<8>::new());
        let far = Arc::clone(&mailbox);
        let putter = thread::spawn(move || (1..=300_000).for_each(|n| far.put(&[n; 8])));
        let mut last = 0;
        while last < 300_000 {
            if let Some(value) = mailbox.newest() {
                assert_eq!(value, [value[0]; 8]);
                assert!(value[0] >= last);
                last = value[0];
            }
        }
        putter.join().unwrap();
    }
}
