//! A distribution of counts in constant memory, kept where it is measured and read by whoever asks.
//!
//! Bins are exact up to [`STEPS`] and then [`STEPS`] to the octave: a percentile read from them is at most 1/16 high.
//! Least and greatest are exact.

use crate::wire_struct;

/// Bins to the octave.
pub const STEPS: usize = 16;
/// log2 of [`STEPS`].
const STEPS_LOG2: u32 = 4;
/// Values from 2^[`OCTAVES_END`] share the last bin: 0.67 s at 25 MHz, a hundred cycles and more.
const OCTAVES_END: u32 = 24;
/// All bins.
pub const BINS: usize = STEPS * (OCTAVES_END - STEPS_LOG2 + 1) as usize;

/// The distribution of a non-negative quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Histogram {
    /// Distance of the least value from `u32::MAX`, zero before the first: an empty histogram is all zeros, and takes no flash.
    below: u32,
    /// Greatest value.
    pub greatest: u32,
    /// Values per bin; stays at the type's maximum rather than wrap.
    pub bins: [u32; BINS],
}

wire_struct!(Histogram {
    below: u32,
    greatest: u32,
    bins: [u32; BINS]
});

impl Histogram {
    /// Without a value.
    pub const fn new() -> Self {
        Self {
            below: 0,
            greatest: 0,
            bins: [0; BINS],
        }
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

/// Bin of a value.
fn bin(value: u32) -> usize {
    if value < STEPS as u32 {
        return value as usize;
    }
    let octave = 31 - value.leading_zeros(); // 4 and up
    if octave >= OCTAVES_END {
        return BINS - 1;
    }
    let step = (value >> (octave - STEPS_LOG2)) as usize - STEPS;
    STEPS * (octave - STEPS_LOG2 + 1) as usize + step
}

/// Greatest value of a bin.
fn top(bin: usize) -> u32 {
    if bin < STEPS {
        return bin as u32;
    }
    let (octave, step) = ((bin / STEPS - 1) as u32, (bin % STEPS) as u32);
    ((STEPS as u32 + step + 1) << octave) - 1
}

impl Histogram {
    /// Takes a value.
    pub fn add(&mut self, value: u32) {
        let below = u32::MAX - value;
        self.below = if below > self.below { below } else { self.below };
        self.greatest = if value > self.greatest { value } else { self.greatest };
        if let Some(count) = self.bins.get_mut(bin(value)) {
            *count = count.saturating_add(1);
        }
    }

    /// Least value, `u32::MAX` before the first.
    pub fn least(&self) -> u32 {
        u32::MAX - self.below
    }

    /// Takes all that `other` took.
    pub fn merge(&mut self, other: &Self) {
        self.below = self.below.max(other.below);
        self.greatest = self.greatest.max(other.greatest);
        for (count, more) in self.bins.iter_mut().zip(&other.bins) {
            *count = count.saturating_add(*more);
        }
    }

    /// The bins that hold values: greatest value that a bin takes, and how many it holds.
    pub fn taken(&self) -> impl Iterator<Item = (u32, u32)> {
        let all = self.bins.iter().enumerate().map(|(at, count)| (top(at), *count));
        all.filter(|(_, count)| *count > 0)
    }

    /// Values taken.
    pub fn count(&self) -> u64 {
        self.bins.iter().map(|count| u64::from(*count)).sum()
    }

    /// The value that at least the share `per_million` of all values does not exceed, at most 1/16 high; zero if empty.
    pub fn percentile(&self, per_million: u32) -> u32 {
        // Rounded up: a share of even one value counts that value in.
        let wanted = (self.count() * u64::from(per_million)).div_ceil(1_000_000);
        let mut seen = 0;
        for (at, count) in self.bins.iter().enumerate() {
            seen += u64::from(*count);
            if seen >= wanted && seen > 0 {
                return top(at).min(self.greatest).max(self.least());
            }
        }
        0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn every_value_up_to_sixteen_million_is_in_a_bin_that_ends_at_most_a_sixteenth_above_it() {
        for value in (0..1 << OCTAVES_END).step_by(7) {
            let end = top(bin(value));
            assert!(
                end >= value && end - value <= value / 16,
                "{value} in a bin up to {end}"
            );
        }
        assert_eq!(bin((1 << OCTAVES_END) - 1), BINS - 1);
    }

    #[test]
    fn an_empty_histogram_has_percentile_zero() {
        assert_eq!(Histogram::default().percentile(500_000), 0);
    }

    proptest! {
        #[test]
        fn percentiles_are_those_of_the_sorted_values_within_a_sixteenth(
            values in proptest::collection::vec(0u32..2_000_000, 1..400), per_million in 0u32..=1_000_000,
        ) {
            let mut histogram = Histogram::default();
            values.iter().for_each(|value| histogram.add(*value));
            let mut sorted: Vec<u32> = values;
            sorted.sort_unstable();
            let rank = (sorted.len() as u64 * u64::from(per_million)).div_ceil(1_000_000).max(1) as usize;
            let exact = sorted[rank - 1];
            let read = histogram.percentile(per_million);
            prop_assert!(read >= exact && read - exact <= exact / 16, "{read} for {exact}");
            prop_assert_eq!(histogram.greatest, *sorted.last().unwrap());
            prop_assert_eq!(histogram.least(), sorted[0]);
            prop_assert_eq!(histogram.taken().map(|(_, count)| count).sum::<u32>(), sorted.len() as u32);
            // Two halves merge to the whole.
            let (mut one, mut other) = (Histogram::default(), Histogram::default());
            sorted.iter().enumerate().for_each(|(at, value)| if at % 2 == 0 { one.add(*value) } else { other.add(*value) });
            one.merge(&other);
            prop_assert_eq!(one, histogram);
        }
    }
}
