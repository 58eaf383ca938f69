//! Where the seam lies beside the grey image's line, from the lit points on it.

/// Standard deviation of an edge's or a line's place in a grey image that none of its stretches shows (m): how it is lit all along. With it and
/// [`OF_STATED`] times what the image says, 300 rendered harsh lap joints have errors of one standard deviation.
const PLACE_SIGMA: f32 = 0.035e-3;
/// Standard deviations of place and direction against what the image says of them.
const OF_STATED: [f32; 2] = [2.0, 1.3];
/// Standard deviation of a lit point across the seam, m. Moderate lap joints and lips have 0.05 to 0.06 mm, vees 0.09 mm, harsh lap joints 0.09 mm; more,
/// since the sections of one part err together by what it is bent. Only ratios count: with all at what moderate sheets have, starts are as good.
const ASIDE_SIGMA: f32 = 0.12e-3;

/// The straight line that the lit points lie on, beside the grey image's: shift and turn by least squares, with how well those are known.
pub(super) struct SeamLine {
    /// Normal equations of shift (m) and turn (rad), in units of a lit point's weight: 1, distance and its square, summed.
    normal: [f32; 3],
    right: [f32; 2],
}

impl SeamLine {
    /// The grey image's own, with the standard deviations of place (m) and direction (rad) that it states.
    pub(super) fn in_grey(stated: [f32; 2]) -> Self {
        let [place, direction] = stated;
        let [place, direction] = [place * OF_STATED[0], direction * OF_STATED[1]];
        let weight = |variance: f32| ASIDE_SIGMA * ASIDE_SIGMA / variance;
        Self {
            normal: [
                weight(PLACE_SIGMA * PLACE_SIGMA + place * place),
                0.0,
                weight(direction * direction),
            ],
            right: [0.0; 2],
        }
    }

    /// A lit point `ahead` (m) of the corner and `aside` (m) of the line.
    pub(super) fn add(&mut self, ahead: f32, aside: f32) {
        let [ones, firsts, seconds] = &mut self.normal;
        let [zeroth, first] = &mut self.right;
        *ones += 1.0;
        *firsts += ahead;
        *seconds += ahead * ahead;
        *zeroth += aside;
        *first += ahead * aside;
    }

    /// By how much (m) the line lies to the left at the corner, and turns to the left, rad.
    pub(super) fn aside(&self) -> (f32, f32) {
        let ([n, a, aa], [s, sa]) = (self.normal, self.right);
        let determinant = n * aa - a * a;
        ((aa * s - a * sa) / determinant, (n * sa - a * s) / determinant)
    }

    /// Variance of that turn, rad².
    pub(super) fn turn_variance(&self) -> f32 {
        let [n, a, aa] = self.normal;
        ASIDE_SIGMA * ASIDE_SIGMA * n / (n * aa - a * a)
    }
}
