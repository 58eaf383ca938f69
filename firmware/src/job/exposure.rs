//! When the camera is to expose: a pair each vision period, and once more when a frame was refused or a sighting stays unconfirmed.

use super::past::SYNC_OVERFLOW;

/// Cycles between the two exposures of a pair: at 0.3 m/s the sensor is 4.5 mm further, so speckle, glints and ghosts are others, and the seam
/// is the same.
/// After three cycles a first image that was lost is already taken again.
const PAIR: u8 = 3;

/// Cycles from a command to expose to the exposure: as every RPDO, it acts on the next SYNC.
const AHEAD: u8 = 1;

/// The schedule.
#[derive(Clone, Copy, Debug, Default)]
pub struct Exposures {
    /// Cycles into the vision period.
    clock: u8,
    /// Cycles for which a sighting has waited for its second.
    waited: u8,
    /// Cycles that it may wait before another exposure is asked for.
    patience: u8,
    /// One more is wanted as soon as can be.
    more: bool,
}

impl Exposures {
    /// A frame was refused: another is wanted at once.
    pub fn ask_again(&mut self) {
        self.more = true;
    }

    /// A sighting came, `age` cycles after its exposure: its second may take as long, and no longer.
    pub fn sighted(&mut self, age: u8) {
        self.waited = 0;
        self.patience = age.saturating_add(1);
    }

    /// One cycle on: SYNC count of the exposure to command in it, zero for none. `period` in cycles; `waiting` is true while a sighting is
    /// unconfirmed.
    pub fn next(&mut self, period: u8, sync: u8, waiting: bool) -> u8 {
        let due = self.clock == 0 || self.clock == PAIR;
        self.clock = if self.clock + 1 >= period { 0 } else { self.clock + 1 };
        self.waited = if waiting { self.waited.saturating_add(1) } else { 0 };
        if self.waited > self.patience {
            self.more = true;
            self.waited = 0;
        }
        if due || self.more {
            self.more = false;
            (sync + AHEAD - 1) % SYNC_OVERFLOW + 1
        } else {
            0
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn exposed(cycles: u8, mut each: impl FnMut(&mut Exposures, u8) -> bool) -> Vec<u8> {
        let mut exposures = Exposures::default();
        let mut counts = Vec::new();
        for sync in 1..=cycles {
            let waiting = each(&mut exposures, sync);
            counts.push(exposures.next(20, sync, waiting));
        }
        counts.retain(|count| *count != 0);
        counts
    }

    #[test]
    fn a_pair_is_exposed_each_period_on_the_next_sync() {
        assert_eq!(exposed(45, |_, _| false), [2, 5, 22, 25, 42, 45]);
    }

    #[test]
    fn a_refused_frame_is_taken_again_at_once_and_a_lonely_sighting_gets_company() {
        let again = exposed(20, |exposures, sync| {
            if sync == 9 {
                exposures.ask_again();
            }
            false
        });
        assert_eq!(again, [2, 5, 10]);
        let lonely = exposed(20, |exposures, sync| {
            if sync == 8 {
                exposures.sighted(4);
            }
            sync >= 8
        });
        assert_eq!(lonely, [2, 5, 14, 20], "and again when that one does not come either");
    }

    #[test]
    fn the_count_overflows_from_240_to_1() {
        assert_eq!(Exposures::default().next(20, 240, false), 1);
        assert_eq!(Exposures::default().next(20, 239, false), 240);
    }
}
