//! Which timer event it is: SYNC and control cycle in turn, by the clock and not by counting interrupts.
//!
//! A tick that comes while another one waits to be served is lost to the interrupt controller. Were the events merely
//! taken in turn, a lost one would swap SYNC and cycle for ever. So the free-running counter says how many ticks have
//! passed, and what was late or missed is counted for [`Inputs::overruns`](crate::process::Inputs::overruns).

use super::report::{Event, HALF_US};

/// A timer event that begins later than this after its time is late, µs. Assumed: of half a cycle, 2.5 ms, the frames of
/// eight nodes take 1.1 ms on the bus and the control cycle 0.65 ms at the emulated 15.6 MHz.
const LATE_US: u32 = 500;

/// Follows the timer events of a counter that counts `HALF` from one to the next.
#[derive(Clone, Copy, Debug)]
pub struct Beat<const HALF: u32> {
    /// The timer's last zero, as a count.
    zero: Option<u32>,
    event: Event,
}

impl<const HALF: u32> Beat<HALF> {
    /// Before the first event, which is SYNC.
    pub const fn new() -> Self {
        Self {
            zero: None,
            event: Event::Cycle,
        }
    }

    /// An event begins with the counter at `start`, `latency` counts after the timer's zero: which event it is, and how many cycles were
    /// late or missed since the one before.
    pub fn begin(&mut self, start: u32, latency: u32) -> (Event, u8) {
        let zero = start.wrapping_sub(latency);
        let passed = self
            .zero
            .replace(zero)
            .map_or(1, |last| (zero.wrapping_sub(last).wrapping_add(HALF / 2)) / HALF);
        self.event = match (self.event, passed % 2) {
            (Event::Sync, 1) | (Event::Cycle, 0) => Event::Cycle,
            _ => Event::Sync,
        };
        let missed = passed / 2; // of passed − 1 missed events each second one begins a cycle that there was not
        let late = u32::from(missed == 0 && latency > HALF / HALF_US * LATE_US);
        (self.event, (missed + late).min(u32::from(u8::MAX)) as u8)
    }
}

impl<const HALF: u32> Default for Beat<HALF> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Event::{Cycle, Sync};

    const HALF: u32 = 62_500; // 2.5 ms at 25 MHz

    /// Events served at these µs since the first tick, which comes as the counter wraps.
    fn serve<const N: usize>(times_us: [u32; N]) -> [(Event, u8); N] {
        let mut beat = Beat::<HALF>::new();
        times_us.map(|us| beat.begin((us * 25).wrapping_sub(70_000), us * 25 % HALF))
    }

    #[test]
    fn events_come_in_turn_and_a_little_lateness_counts_nothing() {
        assert_eq!(
            serve([0, 2500, 5001, 7999, 10_000]),
            [(Sync, 0), (Cycle, 0), (Sync, 0), (Cycle, 0), (Sync, 0)]
        );
    }

    #[test]
    fn a_late_event_is_counted_and_those_after_it_are_themselves() {
        assert_eq!(
            serve([0, 3100, 5000, 7500]),
            [(Sync, 0), (Cycle, 1), (Sync, 0), (Cycle, 0)]
        );
    }

    #[test]
    fn missed_events_never_swap_sync_and_cycle() {
        // A stall over the tick at 2.5 ms until after that at 5, then one over 10, 12.5 and 15 until after that at 17.5.
        assert_eq!(
            serve([0, 5400, 7500, 17_600, 20_000]),
            [(Sync, 0), (Sync, 1), (Cycle, 0), (Cycle, 2), (Sync, 0)]
        );
    }
}
