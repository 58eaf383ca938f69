//! A straight line through what the sections say at their distances from the corner, by weighted least squares.

/// The normal equations of its place at the corner and its slope, and with them how well those are known.
pub(super) struct Straight {
    /// Weight, times distance, times its square, summed.
    normal: [f32; 3],
    right: [f32; 2],
}

impl Straight {
    /// Zero at the corner and without a slope, with these variances; infinite where nothing is known.
    pub(super) fn known([place, slope]: [f32; 2]) -> Self {
        Self {
            normal: [1.0 / place, 0.0, 1.0 / slope],
            right: [0.0; 2],
        }
    }

    /// It runs through `value` at `ahead` (m) of the corner, with this variance.
    pub(super) fn add(&mut self, ahead: f32, value: f32, variance: f32) {
        let weight = 1.0 / variance;
        let [ones, firsts, seconds] = &mut self.normal;
        let [zeroth, first] = &mut self.right;
        *ones += weight;
        *firsts += weight * ahead;
        *seconds += weight * ahead * ahead;
        *zeroth += weight * value;
        *first += weight * ahead * value;
    }

    /// Its place at the corner, its slope, and that one's variance.
    #[inline(never)] // in no hurry
    pub(super) fn solve(&self) -> [f32; 3] {
        let ([n, a, aa], [s, sa]) = (self.normal, self.right);
        let inverse = 1.0 / (n * aa - a * a);
        [(aa * s - a * sa) * inverse, (n * sa - a * s) * inverse, n * inverse]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_before_counts_as_much_as_its_variance_says() {
        let mut line = Straight::known([f32::INFINITY, f32::INFINITY]);
        for ahead in [0.002, 0.014, 0.026] {
            line.add(ahead, 0.1e-3 + 0.01 * ahead, 1e-8);
        }
        let [place, slope, variance] = line.solve();
        assert!(
            (place - 0.1e-3).abs() < 1e-8 && (slope - 0.01).abs() < 1e-6,
            "{place} {slope}"
        );
        // σ²/Σ(x − x̄)²
        assert!((variance / (1e-8 / 2.88e-4) - 1.0).abs() < 1e-3, "{variance}");
        let mut level = Straight::known([f32::INFINITY, 1e-12]);
        level.add(0.002, 1e-4, 1e-8);
        level.add(0.014, 3e-4, 1e-8);
        let [place, slope, _] = level.solve();
        assert!((place - 2e-4).abs() < 1e-7 && slope.abs() < 1e-4, "{place} {slope}");
    }
}
