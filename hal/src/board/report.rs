//! What an image says of itself through the trace port at each timer event.
//!
//! Times are counts of the board's [`CycleCounter`](super::counter::CycleCounter).

use super::histogram::Histogram;
use crate::process::{Inputs, Outputs};
use crate::stage::STAGES;
use crate::{wire_enum, wire_struct};

/// From one timer event to the next, µs: half of the 5 ms cycle.
pub const HALF_US: u32 = 2500;

/// Which of the two timer events of a period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Event {
    /// The period's start: SYNC.
    #[default]
    Sync,
    /// Half a period later: the control cycle.
    Cycle,
}

wire_enum!(Event { Sync, Cycle });

/// When a timer event was served.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Which.
    pub event: Event,
    /// From the timer's zero to the first reading in the task.
    pub latency: u32,
    /// The counter at that reading.
    pub start: u32,
    /// From that reading until the last frame was handed to the bus.
    pub busy: u32,
    /// Cycles that were late or missed since the event before.
    pub overruns: u8,
}

wire_struct!(Timing {
    event: Event,
    latency: u32,
    start: u32,
    busy: u32,
    overruns: u8,
});

/// What follows the [`Timing`] of a control cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleReport<const N: usize> {
    /// What the cycle read.
    pub inputs: Inputs<N>,
    /// What it wrote.
    pub outputs: Outputs<N>,
    /// Hash (FNV-1a) over the byte forms of all outputs since power-up, as the image counts it.
    pub hash: u64,
    /// Counts of each [`Stage`](crate::stage::Stage), in the order of their numbers; zeros from an image that does not tell them apart.
    pub stages: [u32; STAGES],
}

wire_struct!(CycleReport<const N: usize> { inputs: Inputs<N>, outputs: Outputs<N>, hash: u64, stages: [u32; STAGES] });

/// The image's own distributions since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruments {
    /// Error of the time from one start to the next of the same event, absolute.
    pub start_error: Histogram,
    /// From the timer's zero to the first reading.
    pub latency: Histogram,
    /// Busy time of the SYNC event.
    pub sync: Histogram,
    /// Busy time of the control cycle.
    pub cycle: Histogram,
    /// Deepest stack, bytes: up to the first timer event, and since; zero where nobody looked.
    pub stack: [u32; 2],
    /// Rounds of work that the load has done: as background task, and in idle.
    pub load: [u32; 2],
    /// Last start of each event.
    last: [Option<u32>; 2],
}

wire_struct!(Instruments {
    start_error: Histogram,
    latency: Histogram,
    sync: Histogram,
    cycle: Histogram,
    stack: [u32; 2],
    load: [u32; 2],
    last: [Option<u32>; 2],
});

impl Instruments {
    /// Nothing measured yet.
    pub const fn new() -> Self {
        Self {
            start_error: Histogram::new(),
            latency: Histogram::new(),
            sync: Histogram::new(),
            cycle: Histogram::new(),
            stack: [0; 2],
            load: [0; 2],
            last: [None; 2],
        }
    }

    /// Takes all that `other` took.
    pub fn merge(&mut self, other: &Self) {
        self.start_error.merge(&other.start_error);
        self.latency.merge(&other.latency);
        self.sync.merge(&other.sync);
        self.cycle.merge(&other.cycle);
        for (deepest, other) in self.stack.iter_mut().zip(other.stack) {
            *deepest = (*deepest).max(other);
        }
        for (rounds, more) in self.load.iter_mut().zip(other.load) {
            *rounds = rounds.saturating_add(more);
        }
    }

    /// Takes the timing of an event that comes every `period` counts.
    pub fn add(&mut self, timing: &Timing, period: u32) {
        let (busy, last) = match timing.event {
            Event::Sync => (&mut self.sync, &mut self.last[0]),
            Event::Cycle => (&mut self.cycle, &mut self.last[1]),
        };
        busy.add(timing.busy);
        self.latency.add(timing.latency);
        if let Some(last) = last.replace(timing.start) {
            let elapsed = timing.start.wrapping_sub(last);
            self.start_error.add(elapsed.abs_diff(period));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_errors_are_counted_between_starts_of_the_same_event_and_across_the_counters_wrap() {
        let mut instruments = Instruments::default();
        for (event, start) in [
            (Event::Sync, u32::MAX - 999),
            (Event::Cycle, 300),
            (Event::Sync, 1005),
            (Event::Cycle, 2300),
            (Event::Sync, 3000),
        ] {
            instruments.add(
                &Timing {
                    event,
                    latency: 3,
                    start,
                    busy: 40,
                    overruns: 0,
                },
                2000,
            );
        }
        assert_eq!(instruments.start_error.count(), 3);
        assert_eq!(
            (instruments.start_error.least(), instruments.start_error.greatest),
            (0, 5)
        );
        assert_eq!(instruments.sync.count(), 3);
        assert_eq!(instruments.cycle.count(), 2);
    }
}
