//! When the camera is to expose: a burst each vision period, so that sightings can confirm each other, and at once another burst when
//! one settled nothing.

use super::past::SYNC_OVERFLOW;

/// Cycles between the exposures of a burst: at 0.3 m/s the sensor is 4.5 mm further each time, so speckle, glints and ghosts are others, and the
/// seam is the same. After three cycles a first image that was lost is already being taken again.
const STEP: u8 = 3;

/// Exposures of a burst: two that agree make a correction, and the third is there when one of them is lost, refused or wrong.
const BURST: u8 = 3;

/// Cycles from a command to expose to the exposure: as every RPDO, it acts on the next SYNC.
const AHEAD: u8 = 1;

/// Cycles from an exposure to its sighting, until the first one shows how long this camera takes.
const UNKNOWN_AGE: u8 = 8;

/// The schedule.
#[derive(Clone, Copy, Debug)]
pub struct Exposures {
    /// Cycles into the vision period.
    clock: u8,
    /// Age at which the newest sighting came, cycles.
    age: u8,
    /// This burst has made or confirmed a correction.
    settled: bool,
}

impl Default for Exposures {
    fn default() -> Self {
        Self::new()
    }
}

impl Exposures {
    /// A burst is due at once.
    pub const fn new() -> Self {
        Self {
            clock: 0,
            age: UNKNOWN_AGE,
            settled: false,
        }
    }

    /// A sighting came, `age` cycles after its exposure; `settled` if it made or confirmed a correction.
    pub fn sighted(&mut self, age: u8, settled: bool) {
        self.age = age;
        self.settled |= settled;
    }

    /// One cycle on: SYNC count of the exposure to command in it, zero for none. `period` in cycles.
    pub fn next(&mut self, period: u8, sync: u8) -> u8 {
        let last = STEP * (BURST - 1);
        let in_vain = !self.settled && self.clock > last.saturating_add(AHEAD).saturating_add(self.age);
        if in_vain || self.clock >= period {
            self.clock = 0;
            self.settled = false;
        }
        let due = self.clock <= last && self.clock.is_multiple_of(STEP);
        self.clock += 1;
        if due { (sync + AHEAD - 1) % SYNC_OVERFLOW + 1 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn exposed(cycles: u8, mut each: impl FnMut(&mut Exposures, u8)) -> Vec<u8> {
        let mut exposures = Exposures::default();
        let mut counts = Vec::new();
        for sync in 1..=cycles {
            each(&mut exposures, sync);
            counts.push(exposures.next(20, sync));
        }
        counts.retain(|count| *count != 0);
        counts
    }

    #[test]
    fn a_burst_is_exposed_each_period_on_the_next_syncs() {
        let settled = exposed(49, |exposures, _| exposures.sighted(4, true));
        assert_eq!(settled, [2, 5, 8, 22, 25, 28, 42, 45, 48]);
    }

    #[test]
    fn a_burst_that_settled_nothing_is_followed_by_another_as_soon_as_its_last_sighting_is_in() {
        let in_vain = exposed(20, |exposures, sync| {
            if sync == 6 {
                exposures.sighted(4, false);
            }
        });
        assert_eq!(in_vain, [2, 5, 8, 14, 17, 20], "the last, exposed at 8, came with 12");
    }

    #[test]
    fn the_count_overflows_from_240_to_1() {
        assert_eq!(Exposures::default().next(20, 240), 1);
        assert_eq!(Exposures::default().next(20, 239), 240);
    }
}
