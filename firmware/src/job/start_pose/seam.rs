//! Where the seam lies beside the grey image's line, from the lit points on it.

/// Standard deviations of the seam's place (m) and direction (rad) in a grey image: of an edge, and of the line that a bend's bottom is; and of a
/// lit point across the seam, m.
const EDGE_SIGMAS: [f32; 2] = [0.06e-3, 0.4e-3];
const LINE_SIGMAS: [f32; 2] = [0.03e-3, 1.0e-3];
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
