//! Where the seam lies beside the grey image's line, from the lit points on it.

/// Standard deviations of an edge's place (m) and direction (rad) in a grey image. Over 300 rendered moderate lap joints the place has 0.03 mm and the
/// direction 0.35 mrad; on harsh ones, for which it is taken, the place has 0.06 mm.
const EDGE_SIGMAS: [f32; 2] = [0.06e-3, 0.4e-3];
/// The same of the line that a bend's bottom is. Over 300 moderate vees it is 0.016 mm and 0.65 mrad: half as much again and more, for worse light.
const LINE_SIGMAS: [f32; 2] = [0.03e-3, 1.0e-3];
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
    /// The grey image's own, of a `bend` or of an edge.
    pub(super) fn in_grey(bend: bool) -> Self {
        let [place, direction] = if bend { LINE_SIGMAS } else { EDGE_SIGMAS };
        let weight = |sigma: f32| (ASIDE_SIGMA / sigma) * (ASIDE_SIGMA / sigma);
        Self {
            normal: [weight(place), 0.0, weight(direction)],
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
}
