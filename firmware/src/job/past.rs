//! Where the arm was: a ring of past cycles, so that a sighting is used with the pose at its exposure, never the pose at arrival.

/// Cycles kept, 0.32 s: more than any camera that the job can use takes for a frame.
pub const PAST: usize = 64;

/// SYNC counters run 1..=240 (object 0x1019).
pub const SYNC_OVERFLOW: u8 = 240;

/// One past cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment<const N: usize> {
    /// SYNC counter; zero is an unused place.
    pub sync: u8,
    /// Measured joint angles latched at that SYNC, rad.
    pub joints: [f32; N],
    /// Distance of the nozzle's reference along the path at that SYNC, m.
    pub station: f32,
}

/// The ring.
#[derive(Clone, Debug, PartialEq)]
pub struct Past<const N: usize> {
    moments: [Moment<N>; PAST],
    newest: usize,
}

impl<const N: usize> Default for Past<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Past<N> {
    /// No cycle yet.
    pub const fn new() -> Self {
        Self {
            moments: [Moment {
                sync: 0,
                joints: [0.0; N],
                station: 0.0,
            }; PAST],
            newest: 0,
        }
    }

    /// Adds this cycle over the oldest.
    pub fn push(&mut self, moment: Moment<N>) {
        self.newest = (self.newest + 1) % PAST;
        if let Some(place) = self.moments.get_mut(self.newest) {
            *place = moment;
        }
    }

    /// The cycle whose SYNC had this counter, and how many cycles ago it was; `None` if it is gone, or never was.
    pub fn at(&self, stamp: u8) -> Option<(&Moment<N>, u8)> {
        let newest = self.moments.get(self.newest)?.sync;
        if stamp == 0 || stamp > SYNC_OVERFLOW {
            return None;
        }
        let back = (newest as usize + SYNC_OVERFLOW as usize - stamp as usize) % SYNC_OVERFLOW as usize;
        if back >= PAST {
            return None;
        }
        let moment = self.moments.get((self.newest + PAST - back) % PAST)?;
        (moment.sync == stamp).then_some((moment, back as u8))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(cycles: u32) -> Past<1> {
        let mut past = Past::default();
        for cycle in 0..cycles {
            let sync = (cycle % SYNC_OVERFLOW as u32) as u8 + 1;
            past.push(Moment {
                sync,
                joints: [cycle as f32],
                station: 0.0,
            });
        }
        past
    }

    #[test]
    fn a_stamp_finds_the_joints_of_its_own_cycle_across_the_counters_overflow() {
        let past = ring(245); // the newest has counter 5, cycle 244
        assert_eq!(past.at(5).map(|(m, age)| (m.joints[0], age)), Some((244.0, 0)));
        assert_eq!(past.at(240).map(|(m, age)| (m.joints[0], age)), Some((239.0, 5)));
        assert_eq!(past.at(182).map(|(m, age)| (m.joints[0], age)), Some((181.0, 63)));
    }

    #[test]
    fn a_stamp_older_than_the_ring_or_in_the_future_finds_nothing() {
        let past = ring(245);
        assert_eq!(past.at(181), None, "64 cycles ago is overwritten");
        assert_eq!(past.at(6), None, "not yet exposed");
        assert_eq!(past.at(0), None, "zero is no counter");
        assert_eq!(past.at(255), None, "nor is what lies over the overflow");
        assert_eq!(ring(3).at(240), None, "before power-up");
    }
}
