//! The stages of a control cycle, and how each one's cost is told from the others'.
//!
//! The cycle says where one stage ends and the next begins ([`Stopwatch::lap`]); who wants to know brings [`Laps`] on a counter, and
//! everybody else `()`, which costs no instruction. Nothing is measured but time, so outputs are the same bits either way.

use crate::board::counter::CycleCounter;

/// What a stretch of the cycle is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Frames of the bus into the process image.
    Decode,
    /// Where the arm is and was, and where the seam is: counts to joint angles, sightings to deviations.
    Estimate,
    /// Where the job wants the nozzle: its phase, the path, and the hold between corrections.
    Hold,
    /// Sines and cosines, tip and Jacobian.
    Kinematics,
    /// Damped inverse: the joint reference that follows.
    Solve,
    /// The model's torque for the reference motion.
    FeedForward,
    /// Position loops, and units of the drives.
    Servo,
    /// What is allowed.
    Safety,
    /// The process image into frames of the bus.
    Encode,
}

/// How many there are.
pub const STAGES: usize = 9;

impl Stage {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; STAGES] = [
        Self::Decode,
        Self::Estimate,
        Self::Hold,
        Self::Kinematics,
        Self::Solve,
        Self::FeedForward,
        Self::Servo,
        Self::Safety,
        Self::Encode,
    ];
}

/// Is told at the end of each stretch what it was for.
pub trait Stopwatch {
    /// What ran since the last call was `stage`.
    fn lap(&mut self, stage: Stage);
}

/// Nobody measures.
impl Stopwatch for () {
    #[inline(always)]
    fn lap(&mut self, _: Stage) {}
}

/// A stopwatch on a counter.
pub struct Laps<'a, C> {
    counter: &'a C,
    /// The counter at the end of the last stretch.
    last: u32,
    /// Counts per stage, in the order of [`Stage::ALL`].
    counts: [u32; STAGES],
}

impl<'a, C: CycleCounter> Laps<'a, C> {
    /// The first stretch began when the counter stood at `start`.
    pub fn since(counter: &'a C, start: u32) -> Self {
        Self {
            counter,
            last: start,
            counts: [0; STAGES],
        }
    }

    /// Counts per stage so far, in the order of [`Stage::ALL`].
    pub fn counts(&self) -> [u32; STAGES] {
        self.counts
    }
}

impl<C: CycleCounter> Stopwatch for Laps<'_, C> {
    #[inline(always)] // a call would cost as much again
    fn lap(&mut self, stage: Stage) {
        let now = self.counter.now();
        if let Some(counts) = self.counts.get_mut(stage as usize) {
            *counts = counts.wrapping_add(now.wrapping_sub(self.last));
        }
        self.last = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// Counts 100 at each look.
    struct Steps(Cell<u32>);

    impl CycleCounter for Steps {
        const HERTZ: u32 = 1;

        fn now(&self) -> u32 {
            self.0.set(self.0.get().wrapping_add(100));
            self.0.get()
        }
    }

    #[test]
    fn a_stage_that_comes_twice_adds_up_and_the_counters_wrap_costs_nothing() {
        let counter = Steps(Cell::new(u32::MAX - 150));
        let mut laps = Laps::since(&counter, counter.now());
        laps.lap(Stage::Safety);
        laps.lap(Stage::Encode);
        laps.lap(Stage::Safety);
        let mut expected = [0; STAGES];
        expected[Stage::Safety as usize] = 200;
        expected[Stage::Encode as usize] = 100;
        assert_eq!(laps.counts(), expected);
    }

    #[test]
    fn every_stage_stands_at_its_own_number() {
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, place);
        }
    }
}
