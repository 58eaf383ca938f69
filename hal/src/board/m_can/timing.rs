//! Bit timing: from clock and bit rate to the time quanta of a bit.

/// A bit as quanta: one to synchronise, `before` the sample point, `after` it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    /// Clocks per quantum, 1..=512.
    pub prescaler: u16,
    /// Quanta from the synchronisation to the sample point, 2..=256.
    pub before: u16,
    /// Quanta from the sample point to the bit's end, 2..=128.
    pub after: u16,
    /// Quanta by which a bit may be stretched or cut to follow the sender, at most `after`.
    pub jump: u16,
}

impl BitTiming {
    /// The finest quanta with which a bit lasts exactly `clock_hz / bit_hz` and is sampled exactly at the share
    /// `sample_per_mille` of it; `None` if there are none. The jump is as wide as it may be: CANopen asks for nothing
    /// narrower, and it is what tolerates the most difference of clocks.
    pub const fn new(clock_hz: u32, bit_hz: u32, sample_per_mille: u32) -> Option<Self> {
        if bit_hz == 0 || !clock_hz.is_multiple_of(bit_hz) || sample_per_mille > 1000 {
            return None;
        }
        let clocks = clock_hz / bit_hz;
        let mut prescaler = 1;
        while prescaler <= 512 {
            let quanta = clocks / prescaler;
            // A bit has at most 1 + 256 + 128 quanta; more would also overflow the product.
            if quanta * prescaler == clocks && quanta <= 385 && (quanta * sample_per_mille).is_multiple_of(1000) {
                let sample = quanta * sample_per_mille / 1000;
                let (before, after) = (sample.saturating_sub(1), quanta - sample);
                if before >= 2 && before <= 256 && after >= 2 && after <= 128 {
                    return Some(Self {
                        prescaler: prescaler as u16,
                        before: before as u16,
                        after: after as u16,
                        jump: after as u16,
                    });
                }
            }
            prescaler += 1;
        }
        None
    }

    /// The register NBTP.
    pub const fn register(self) -> u32 {
        (self.jump as u32 - 1) << 25
            | (self.prescaler as u32 - 1) << 16
            | (self.before as u32 - 1) << 8
            | (self.after as u32 - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_megabit_from_80_mhz_is_80_quanta_sampled_after_the_70th() {
        let timing = BitTiming::new(80_000_000, 1_000_000, 875).unwrap();
        let expected = BitTiming {
            prescaler: 1,
            before: 69,
            after: 10,
            jump: 10,
        };
        assert_eq!(timing, expected);
        assert_eq!(timing.register(), 9 << 25 | 68 << 8 | 9);
    }

    #[test]
    fn a_slow_bus_takes_a_coarser_quantum() {
        // 640 clocks to a bit: 320 quanta would have 279 before the sample point, over 256.
        let timing = BitTiming::new(80_000_000, 125_000, 875).unwrap();
        assert_eq!((timing.prescaler, timing.before, timing.after), (4, 139, 20));
    }

    #[test]
    fn what_cannot_be_exact_is_refused() {
        assert_eq!(BitTiming::new(80_000_000, 300_000, 875), None); // no whole number of clocks
        assert_eq!(BitTiming::new(2_000_000, 1_000_000, 500), None); // two clocks to a bit
        assert_eq!(BitTiming::new(80_000_000, 1_000_000, 999), None); // between two quanta
        assert_eq!(BitTiming::new(80_000_000, 0, 875), None);
    }

    proptest! {
        #[test]
        fn a_bit_lasts_what_it_should_and_fits_the_register(
            clock in 1u32..=160, bit_khz in prop::sample::select(&[10u32, 20, 50, 125, 250, 500, 800, 1000][..]),
            sample in 500u32..=900,
        ) {
            let (clock_hz, bit_hz) = (clock * 1_000_000, bit_khz * 1000);
            if let Some(BitTiming { prescaler, before, after, jump }) = BitTiming::new(clock_hz, bit_hz, sample) {
                let quanta = 1 + u32::from(before) + u32::from(after);
                prop_assert_eq!(u32::from(prescaler) * quanta * bit_hz, clock_hz);
                prop_assert_eq!((1 + u32::from(before)) * 1000, quanta * sample);
                prop_assert!(prescaler <= 512 && (2..=256).contains(&before) && (2..=128).contains(&after) && jump <= after);
            }
        }
    }
}
