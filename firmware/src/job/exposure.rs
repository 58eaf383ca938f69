//! When the camera is to expose: a burst each vision period, so that sightings can confirm each other, and at once another burst while what
//! one of the slits saw is not confirmed.
//!
//! That does not wait for the burst's last sighting. A lone one's witness must be near by, and with the wait the next image was up to 18 mm
//! further on: with one slit, a strong bend was passed for 42 mm with nothing known of it. And a camera that takes 40 ms for an image
//! never came to the second burst.
//!
//! A camera whose images take long is not asked for more than it has room for: what it would not take is asked for when it has handed an
//! image back. So a slow one is kept busy, and gives as many sightings as it can.

use super::past::SYNC_OVERFLOW;
use hal::camera::IN_FLIGHT;

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
    /// Slits that have spoken of this burst, a bit each, and in the upper half those that were confirmed.
    spoken: u8,
    /// Exposures of this burst that were commanded.
    commanded: u8,
    /// Cycles since the last that was commanded.
    since: u8,
    /// Of each exposure whose sighting has not come, cycles until it is given up; zero is a free place.
    under_way: [u8; IN_FLIGHT],
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
            spoken: 0,
            commanded: 0,
            since: u8::MAX,
            under_way: [0; IN_FLIGHT],
        }
    }

    /// A sighting by `slit` came, `age` cycles after its exposure; `confirmed` if another agrees with it.
    pub fn sighted(&mut self, slit: u8, age: u8, confirmed: bool) {
        self.age = age;
        let bit = 1_u8.wrapping_shl(u32::from(slit));
        self.spoken |= if confirmed { bit | bit << 4 } else { bit };
        if slit == 0 {
            // The camera hands back the oldest first.
            let oldest = self.under_way.iter_mut().filter(|left| **left > 0).min();
            if let Some(left) = oldest {
                *left = 0;
            }
        }
    }

    /// One cycle on in bursts: SYNC count of the exposure to command in it, zero for none. `period` in cycles.
    pub fn next(&mut self, period: u8, sync: u8) -> u8 {
        let over = self.commanded == BURST && self.since >= STEP;
        let settled = self.spoken != 0 && self.spoken >> 4 == self.spoken & 0xf;
        if over && !settled || self.clock >= period {
            self.clock = 0;
            self.spoken = 0;
            self.commanded = 0;
        }
        self.clock = self.clock.saturating_add(1);
        self.command(self.commanded < BURST, sync)
    }

    /// One cycle on outside of bursts: the same of an exposure that is `wanted` now; zero if it has to wait.
    pub fn command(&mut self, wanted: bool, sync: u8) -> u8 {
        for left in &mut self.under_way {
            *left = left.saturating_sub(1);
        }
        let due = wanted && self.since >= STEP;
        self.since = self.since.saturating_add(1);
        let Some(place) = self.under_way.iter_mut().find(|left| due && **left == 0) else {
            return 0;
        };
        // An image takes twice the age if it waits for another. What was not heard of by then was not taken, or its frame is lost.
        *place = (2 * AHEAD + STEP).saturating_add(self.age.saturating_mul(2));
        self.commanded = self.commanded.saturating_add(1);
        self.since = 1;
        (sync + AHEAD - 1) % SYNC_OVERFLOW + 1
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
        let settled = exposed(49, |exposures, _| exposures.sighted(0, 4, true));
        assert_eq!(settled, [2, 5, 8, 22, 25, 28, 42, 45, 48]);
    }

    #[test]
    fn a_burst_that_settled_nothing_goes_over_into_another() {
        let in_vain = exposed(20, |exposures, sync| {
            if [6, 9, 12, 15, 18].contains(&sync) {
                exposures.sighted(0, 4, false);
            }
        });
        assert_eq!(in_vain, [2, 5, 8, 11, 14, 17, 20]);
    }

    #[test]
    fn so_is_one_in_which_what_one_slit_saw_was_not_confirmed() {
        let half = exposed(20, |exposures, sync| {
            if [6, 9, 12, 15, 18].contains(&sync) {
                exposures.sighted(0, 4, true);
                exposures.sighted(1, 4, false);
            }
        });
        assert_eq!(half, [2, 5, 8, 11, 14, 17, 20]);
    }

    #[test]
    fn a_camera_that_is_full_is_asked_when_it_has_handed_an_image_back() {
        // 40 ms for an image, one after the other: they come 8 cycles apart, however they were asked for.
        let mut due = Vec::new();
        let counts = exposed(60, |exposures, sync| {
            if let Some(at) = due.iter().position(|at| *at == sync) {
                due.remove(at);
                exposures.sighted(0, 8, true);
                exposures.sighted(1, 8, true);
            }
            let (last, under_way) = (due.last().copied().unwrap_or(0), exposures.under_way);
            assert!(under_way.iter().filter(|left| **left > 0).count() == due.len());
            let mut ahead = *exposures;
            let next = ahead.next(20, sync);
            if next != 0 {
                due.push(next.max(last) + 8);
            }
        });
        assert_eq!(counts, [2, 5, 11, 22, 27, 35, 43, 51, 59]);
    }

    #[test]
    fn an_exposure_of_which_nothing_is_heard_is_given_up_after_twice_the_time_that_a_sighting_takes() {
        assert_eq!(exposed(50, |_, _| ()), [2, 5, 23, 26, 44, 47]);
    }

    #[test]
    fn periods_that_are_no_multiple_of_the_step_do_not_bring_exposures_closer() {
        let mut exposures = Exposures::default();
        let next = |sync| {
            exposures.sighted(0, 1, true);
            exposures.next(4, sync)
        };
        let counts: Vec<u8> = (1..=16).map(next).filter(|count| *count != 0).collect();
        assert_eq!(counts, [2, 5, 8, 11, 14, 17]);
    }

    #[test]
    fn the_count_overflows_from_240_to_1() {
        assert_eq!(Exposures::default().next(20, 240), 1);
        assert_eq!(Exposures::default().next(20, 239), 240);
    }
}
