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
