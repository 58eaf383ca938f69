//! The stages of a control cycle, and how each one's cost and result are told from the others'.
//!
//! The cycle says where one stage ends and the next begins ([`Stopwatch::lap`]) and what came out of it
//! ([`Stopwatch::result`]); who wants to know the times brings [`Laps`] on a counter, who wants to know the results a [`Trail`], and
//! everybody else `()`, which costs no instruction. None of them changes anything, so outputs are the same bits in every case.

use crate::board::counter::CycleCounter;
use crate::wire::{Fnv64, Sink, Wire};
use crate::{wire_enum, wire_struct};

/// What a stretch of the cycle is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Stage {
    /// Frames of the bus into the process image.
    #[default]
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

wire_enum!(Stage {
    Decode,
    Estimate,
    Hold,
    Kinematics,
    Solve,
    FeedForward,
    Servo,
    Safety,
    Encode
});

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

    /// As people write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decode => "decode",
            Self::Estimate => "estimate",
            Self::Hold => "hold",
            Self::Kinematics => "kinematics",
            Self::Solve => "solve",
            Self::FeedForward => "feed-forward",
            Self::Servo => "servo",
            Self::Safety => "safety",
            Self::Encode => "encode",
        }
    }
}

/// Is told at the end of each stretch what it was for.
pub trait Stopwatch {
    /// What ran since the last call was `stage`.
    fn lap(&mut self, stage: Stage);

    /// This came out of `stage`, and is what the next stage will read: a test may change it.
    #[inline(always)]
    fn result(&mut self, _stage: Stage, _value: &mut impl Wire) {}
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

/// Results that a trail tells apart: a cycle along the seam has fourteen.
pub const MARKS_MAX: usize = 16;

/// What came out of one stage, however many values in turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mark {
    /// The stage.
    pub stage: Stage,
    /// Hash of all bits of the values: FNV-1a, both halves of its 64 bits.
    pub digest: u32,
}

wire_struct!(Mark {
    stage: Stage,
    digest: u32
});

/// What came out of the stages of one cycle, in the order in which they ran: two runs of the same cycle that differ in one bit of one
/// stage's result differ from that stage's mark on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trail {
    marks: [Mark; MARKS_MAX],
    count: u8,
}

wire_struct!(Trail {
    marks: [Mark; MARKS_MAX],
    count: u8
});

impl Trail {
    /// The marks.
    pub fn marks(&self) -> &[Mark] {
        self.marks.get(..usize::from(self.count)).unwrap_or(&self.marks)
    }

    /// The first stage whose result is another than in `other`; where one trail has ended, the other's next.
    pub fn first_difference(&self, other: &Self) -> Option<Stage> {
        let mut pairs = self.marks().iter().zip(other.marks());
        if let Some((mark, _)) = pairs.find(|(a, b)| a != b) {
            return Some(mark.stage);
        }
        let (mine, others) = (self.marks().len(), other.marks().len());
        let next = self.marks().get(others).or_else(|| other.marks().get(mine));
        next.map(|mark| mark.stage)
    }
}

impl Stopwatch for Trail {
    fn lap(&mut self, _: Stage) {}

    fn result(&mut self, stage: Stage, value: &mut impl Wire) {
        let last = self.marks().last().copied();
        let count = match last {
            // Several values of one stage, or more stages than there is room for: one mark.
            Some(mark) if mark.stage == stage || self.marks().len() == MARKS_MAX => self.count,
            _ => self.count + 1,
        };
        let mut hash = Fnv64::default();
        if count == self.count {
            last.write(&mut hash);
        }
        value.write(&mut hash);
        self.count = count;
        if let Some(mark) = self.marks.get_mut(usize::from(count).wrapping_sub(1)) {
            *mark = Mark {
                stage,
                digest: (hash.0 >> 32) as u32 ^ hash.0 as u32,
            };
        }
    }
}

/// A trail of a cycle, and if asked for a deliberate error in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Witness {
    /// The trail.
    pub trail: Trail,
    /// The last bit of the first value that comes out of this stage is to be flipped, once.
    pub flip: Option<Stage>,
}

impl Stopwatch for Witness {
    fn lap(&mut self, _: Stage) {}

    fn result(&mut self, stage: Stage, value: &mut impl Wire) {
        if self.flip == Some(stage) {
            self.flip = None;
            flip_last_bit(value);
        }
        self.trail.result(stage, value);
    }
}

/// Of the first number in it: little-endian, its first byte's lowest bit. A value of over 256 bytes stays as it is.
fn flip_last_bit(value: &mut impl Wire) {
    let mut bytes = Bytes(heapless::Vec::new());
    value.write(&mut bytes);
    if let Some(first) = bytes.0.first_mut() {
        *first ^= 1;
    }
    // A kind of value whose first byte is a code may have no such code: it is then half written, which is an error too.
    let _ = value.fill(&mut bytes.0.as_slice());
}

struct Bytes(heapless::Vec<u8, 256>);

impl Sink for Bytes {
    fn put(&mut self, bytes: &[u8]) {
        let _ = self.0.extend_from_slice(bytes); // what does not fit makes the value unreadable
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

    fn trail(results: &[(Stage, f32)]) -> Trail {
        let mut trail = Trail::default();
        for (stage, value) in results {
            trail.result(*stage, &mut { *value });
        }
        trail
    }

    #[test]
    fn the_first_stage_with_another_bit_is_named_also_when_it_ran_before() {
        let one = [
            (Stage::Safety, 1.0),
            (Stage::Kinematics, 2.0),
            (Stage::Kinematics, 3.0),
            (Stage::Solve, 4.0),
            (Stage::Safety, 5.0),
        ];
        assert_eq!(trail(&one).marks().len(), 4);
        assert_eq!(trail(&one).first_difference(&trail(&one)), None);
        for (place, (stage, value)) in one.into_iter().enumerate() {
            let mut other = one;
            other[place] = (stage, f32::from_bits(value.to_bits() ^ 1));
            assert_eq!(
                trail(&one).first_difference(&trail(&other)),
                Some(stage),
                "result {place}"
            );
        }
        assert_eq!(trail(&one).first_difference(&trail(&one[..3])), Some(Stage::Solve));
        assert_eq!(trail(&one[..3]).first_difference(&trail(&one)), Some(Stage::Solve));
    }

    #[test]
    fn more_results_than_there_is_room_for_still_tell_that_they_differ() {
        let mut many = [(Stage::Hold, 0.0); 2 * MARKS_MAX];
        for (place, (stage, value)) in many.iter_mut().enumerate() {
            *stage = if place % 2 == 0 { Stage::Hold } else { Stage::Solve };
            *value = place as f32;
        }
        let whole = trail(&many);
        assert_eq!(whole.marks().len(), MARKS_MAX);
        many[MARKS_MAX + 3].1 += 1.0;
        assert!(whole.first_difference(&trail(&many)).is_some());
    }

    #[test]
    fn a_flip_is_in_the_last_bit_of_the_next_result_of_its_stage_and_only_there() {
        let mut witness = Witness {
            flip: Some(Stage::Solve),
            ..Witness::default()
        };
        let mut values = [1.0_f32, 2.0];
        witness.result(Stage::Hold, &mut values);
        assert_eq!(values, [1.0, 2.0]);
        witness.result(Stage::Solve, &mut values);
        assert_eq!(values, [f32::from_bits(1.0_f32.to_bits() ^ 1), 2.0]);
        let flipped = values;
        witness.result(Stage::Solve, &mut values);
        assert_eq!(values, flipped);
    }
}
