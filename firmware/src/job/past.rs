//! Where the arm was: a ring of past cycles, so that a sighting is used with the pose at its exposure, never the pose at arrival.
//!
//! A stamp names the SYNC that triggered the exposure; its middle comes a little later, by the camera's trigger and half the time that it is
//! open. Between the two cycles about that instant joints are taken to turn evenly: at 6 rad/s² that is off by a·T²/8, 0.02 mrad.

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

    /// The moment `delay` cycles after the SYNC with this counter, and how many cycles ago that SYNC was; `None` if it is gone, or never was.
    /// The moment has the counter of the last SYNC before it.
    pub fn at(&self, stamp: u8, delay: f32) -> Option<(Moment<N>, u8)> {
        if stamp == 0 || stamp > SYNC_OVERFLOW {
            return None;
        }
        let newest = self.moments.get(self.newest)?.sync;
        let back = (newest as usize + SYNC_OVERFLOW as usize - stamp as usize) % SYNC_OVERFLOW as usize;
        let own = self.ago(back).filter(|moment| moment.sync == stamp)?;
        if delay == 0.0 {
            return Some((*own, back as u8));
        }
        let ago = back as f32 - delay;
        if !(0.0..PAST as f32).contains(&ago) {
            return None;
        }
        let whole = ago as usize;
        let (after, mut moment) = (self.ago(whole)?, *self.ago(whole + 1)?);
        let share = 1.0 - (ago - whole as f32);
        for (joint, after) in moment.joints.iter_mut().zip(&after.joints) {
            *joint += (after - *joint) * share;
        }
        moment.station += (after.station - moment.station) * share;
        Some((moment, back as u8))
    }

    /// The moment `cycles` ago, if it is kept.
    fn ago(&self, cycles: usize) -> Option<&Moment<N>> {
        let place = (self.newest + PAST).checked_sub(cycles).filter(|_| cycles < PAST)? % PAST;
        self.moments.get(place).filter(|moment| moment.sync != 0)
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
        let at = |stamp| past.at(stamp, 0.0).map(|(m, age)| (m.joints[0], age));
        assert_eq!(
            [at(5), at(240), at(182)],
            [Some((244.0, 0)), Some((239.0, 5)), Some((181.0, 63))]
        );
    }

    #[test]
    fn an_exposure_in_the_middle_of_a_cycle_has_the_joints_in_the_middle() {
        let past = ring(245);
        let at = |stamp, delay| past.at(stamp, delay).map(|(m, age)| (m.joints[0], m.sync, age));
        assert_eq!(at(240, 0.25), Some((239.25, 240, 5)));
        assert_eq!(
            at(240, 1.5),
            Some((240.5, 1, 5)),
            "the cycle after, across the overflow"
        );
        assert_eq!(
            at(240, -0.5),
            Some((238.5, 239, 5)),
            "a camera that opens before the SYNC"
        );
        assert_eq!(at(240, 5.0), Some((244.0, 4, 5)));
        assert_eq!(at(240, 5.1), None, "not over yet");
        assert_eq!(at(240, f32::NAN), None);
        assert_eq!(at(182, -0.5), None, "the cycle before is gone");
    }

    #[test]
    fn a_stamp_older_than_the_ring_or_in_the_future_finds_nothing() {
        let past = ring(245);
        assert_eq!(past.at(181, 0.0), None, "64 cycles ago is overwritten");
        assert_eq!(past.at(6, 0.0), None, "not yet exposed");
        assert_eq!(past.at(0, 0.0), None, "zero is no counter");
        assert_eq!(past.at(255, 0.0), None, "nor is what lies over the overflow");
        assert_eq!(ring(3).at(240, 0.0), None, "before power-up");
    }
}
