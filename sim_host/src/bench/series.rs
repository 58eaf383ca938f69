//! A quantity measured in every cycle: exact median and greatest value.

/// The values, in the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Series(Vec<u64>);

impl Series {
    /// Takes a value.
    pub fn take(&mut self, value: u64) {
        self.0.push(value);
    }

    /// The value that half of all do not exceed; zero if there is none.
    pub fn median(&self) -> u64 {
        let mut sorted = self.0.clone();
        let middle = sorted.len().saturating_sub(1) / 2;
        if sorted.is_empty() {
            0
        } else {
            *sorted.select_nth_unstable(middle).1
        }
    }

    /// The greatest value; zero if there is none.
    pub fn max(&self) -> u64 {
        self.0.iter().copied().max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_a_value_that_came_and_half_do_not_exceed() {
        let of = |values: &[u64]| {
            let mut series = Series::default();
            values.iter().for_each(|value| series.take(*value));
            (series.median(), series.max())
        };
        assert_eq!(of(&[]), (0, 0));
        assert_eq!(of(&[7]), (7, 7));
        assert_eq!(of(&[9, 1, 5, 3]), (3, 9));
        assert_eq!(of(&[9, 1, 5, 3, 4]), (4, 9));
    }
}
