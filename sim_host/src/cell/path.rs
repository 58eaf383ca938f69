//! Nominal seam geometry in the work frame Σ_W, by arc length.
//!
//! Σ_W stands at the seam's start: x along its first tangent, z out of the sheet toward the nozzle, y to the left. Every
//! path is planar (z = 0) and turns left, toward +y. Before its start and past its end a path goes on along its end
//! tangents. Metres, radians, f64. Placing the part on the robot is the business of `T_b_w`.

use nalgebra::Vector3;

/// Inside radius of a corner, m. Assumed, because the paper draws the 165° corner sharp and folded sheet of
/// 0.6 mm is not: eight times the thickness is an ordinary press radius.
pub const CORNER_RADIUS_M: f64 = 0.005;

/// A point of a seam with its frame: tangent `t`, sheet normal `n` out of the sheet, `b = n × t` to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamFrame {
    /// The seam point, m.
    pub p: Vector3<f64>,
    /// Unit tangent, in the direction of travel.
    pub t: Vector3<f64>,
    /// Unit vector in the sheet's tangent plane across the seam, to the left of travel.
    pub b: Vector3<f64>,
    /// Unit sheet normal, out of the sheet toward the nozzle.
    pub n: Vector3<f64>,
}

/// A stretch of constant curvature.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Arc length at its start, m.
    s: f64,
    /// Its own length, m; infinite for the run-out past the end.
    length: f64,
    /// Curvature, 1/m, positive to the left.
    curvature: f64,
    /// Start point, m.
    x: f64,
    y: f64,
    /// Heading at the start, rad from the x axis, and its sine and cosine.
    heading: f64,
    sin: f64,
    cos: f64,
}

impl Piece {
    /// Point and heading at `along` metres from the piece's start.
    fn at(&self, along: f64) -> (f64, f64, f64) {
        if self.curvature == 0.0 {
            return (self.x + along * self.cos, self.y + along * self.sin, self.heading);
        }
        let heading = self.heading + self.curvature * along;
        let (sin, cos) = heading.sin_cos();
        (
            self.x + (sin - self.sin) / self.curvature,
            self.y + (self.cos - cos) / self.curvature,
            heading,
        )
    }

    /// Distance along the piece of its point nearest to (`x`, `y`), within `[first, length]`.
    fn nearest(&self, x: f64, y: f64, first: f64) -> f64 {
        let (dx, dy) = (x - self.x, y - self.y);
        let (ahead, left) = (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin);
        let along = if self.curvature == 0.0 {
            ahead
        } else {
            // Angle travelled about the arc's centre, which lies 1/curvature to the left; in (−π, π], then moved by one
            // turn if that brings it nearer to the arc's middle.
            let turn = (self.curvature * ahead).atan2(1.0 - self.curvature * left);
            let middle = 0.5 * self.curvature * self.length;
            let turns = ((turn - middle) / std::f64::consts::TAU).round();
            (turn - turns * std::f64::consts::TAU) / self.curvature
        };
        along.max(first).min(self.length)
    }
}

/// A nominal seam.
#[derive(Clone, Debug)]
pub struct SeamPath {
    pieces: Vec<Piece>,
    length: f64,
}

impl SeamPath {
    /// 500 mm straight.
    pub fn straight() -> Self {
        Self::of(&[(0.500, 0.0)])
    }

    /// 50 mm straight, half a circle of radius 150 mm, 50 mm straight.
    pub fn arc() -> Self {
        Self::of(&[(0.050, 0.0), HALF_CIRCLE_R150, (0.050, 0.0)])
    }

    /// The paper's panel (4.6): 280 mm straight, half a circle of radius 150 mm, 120 mm straight, a corner of 165°
    /// (15° to the left, radius [`CORNER_RADIUS_M`]), 120 mm straight.
    pub fn panel() -> Self {
        Self::of(&[
            (0.280, 0.0),
            HALF_CIRCLE_R150,
            (0.120, 0.0),
            turn_left(15.0),
            (0.120, 0.0),
        ])
    }

    /// 250 mm straight, a corner of 90° to the left, radius [`CORNER_RADIUS_M`], 250 mm straight.
    pub fn corner() -> Self {
        Self::of(&[(0.250, 0.0), turn_left(90.0), (0.250, 0.0)])
    }

    /// Lays (length, curvature) stretches end to end, then a straight run-out.
    fn of(stretches: &[(f64, f64)]) -> Self {
        let mut pieces = Vec::with_capacity(stretches.len() + 1);
        let (mut s, mut x, mut y, mut heading) = (0.0, 0.0, 0.0, 0.0);
        let run_out = (f64::INFINITY, 0.0);
        for &(length, curvature) in stretches.iter().chain([&run_out]) {
            let piece = Piece {
                s,
                length,
                curvature,
                x,
                y,
                heading,
                sin: f64::sin(heading),
                cos: f64::cos(heading),
            };
            pieces.push(piece);
            if length.is_finite() {
                s += length;
                (x, y, heading) = piece.at(length);
            }
        }
        Self { pieces, length: s }
    }

    /// Length of the seam, m.
    pub fn length(&self) -> f64 {
        self.length
    }

    fn piece(&self, s: f64) -> &Piece {
        let index = self.pieces.iter().rposition(|piece| piece.s <= s).unwrap_or(0);
        &self.pieces[index]
    }

    /// The seam's frame at arc length `s`, m; off its ends the end tangents go on.
    pub fn at(&self, s: f64) -> SeamFrame {
        let piece = self.piece(s);
        let (x, y, heading) = piece.at(s - piece.s);
        let (sin, cos) = heading.sin_cos();
        SeamFrame {
            p: Vector3::new(x, y, 0.0),
            t: Vector3::new(cos, sin, 0.0),
            b: Vector3::new(-sin, cos, 0.0),
            n: Vector3::z(),
        }
    }

    /// Curvature at arc length `s`, 1/m, positive to the left.
    pub fn curvature(&self, s: f64) -> f64 {
        self.piece(s).curvature
    }

    /// Arc length of the seam point nearest to (`x`, `y`) of Σ_W, and the signed distance to the left of it, m.
    pub fn project(&self, x: f64, y: f64) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for (index, piece) in self.pieces.iter().enumerate() {
            let first = if index == 0 { f64::NEG_INFINITY } else { 0.0 };
            let along = piece.nearest(x, y, first);
            let (px, py, heading) = piece.at(along);
            let (dx, dy) = (x - px, y - py);
            let distance = dx.hypot(dy);
            if distance < best.1.abs() {
                let left = dy * heading.cos() - dx * heading.sin();
                best = (piece.s + along, distance.copysign(left));
            }
        }
        best
    }
}

/// A corner to the left by `degrees`, radius [`CORNER_RADIUS_M`]: (length, curvature).
fn turn_left(degrees: f64) -> (f64, f64) {
    (degrees.to_radians() * CORNER_RADIUS_M, 1.0 / CORNER_RADIUS_M)
}

/// Half a circle of radius 150 mm to the left: (length, curvature).
const HALF_CIRCLE_R150: (f64, f64) = (0.150 * std::f64::consts::PI, 1.0 / 0.150);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn paths() -> [SeamPath; 4] {
        [
            SeamPath::straight(),
            SeamPath::arc(),
            SeamPath::panel(),
            SeamPath::corner(),
        ]
    }

    #[test]
    fn lengths_are_the_papers() {
        let [straight, arc, panel, corner] = paths();
        assert!((straight.length() - 0.5).abs() < 1e-12);
        assert!((arc.length() - (0.1 + 0.15 * PI)).abs() < 1e-12);
        assert!((corner.length() - (0.5 + 0.0025 * PI)).abs() < 1e-12);
        assert!((panel.length() - (0.52 + 0.15 * PI + 0.005 * PI / 12.0)).abs() < 1e-12);
    }

    #[test]
    fn the_panel_ends_after_a_half_turn_and_fifteen_degrees() {
        let panel = SeamPath::panel();
        let end = panel.at(panel.length());
        let heading = end.t.y.atan2(end.t.x);
        assert!((heading - (-165_f64).to_radians()).abs() < 1e-9, "{heading} rad");
        // Straight back for 120 mm at y = 300 mm, then 120 mm at 15° toward −y.
        assert!(
            (end.p.y - (0.300 - 0.120 * 15_f64.to_radians().sin())).abs() < 2e-4,
            "{} m",
            end.p.y
        );
    }

    #[test]
    fn an_arc_never_leaves_its_circle() {
        let arc = SeamPath::arc();
        for step in 0..=100 {
            let s = 0.05 + 0.15 * PI * f64::from(step) / 100.0;
            let radius = (arc.at(s).p - Vector3::new(0.05, 0.15, 0.0)).norm();
            assert!((radius - 0.15).abs() < 1e-12, "{radius} m at {s} m");
        }
    }

    #[test]
    fn before_its_start_a_seam_goes_back_along_its_first_tangent() {
        for path in paths() {
            let frame = path.at(-0.02);
            assert_eq!((frame.p.x, frame.p.y), (-0.02, 0.0));
        }
    }

    proptest! {
        #[test]
        fn frames_are_right_handed_and_point_and_tangent_agree(which in 0_usize..4, s in -0.05_f64..1.1) {
            let path = &paths()[which];
            let (here, next) = (path.at(s), path.at(s + 1e-7));
            prop_assert!((here.n.cross(&here.t) - here.b).norm() < 1e-12);
            prop_assert!(((next.p - here.p) / 1e-7 - here.t).norm() < 1e-4);
        }

        #[test]
        fn projecting_a_point_beside_the_seam_returns_its_station(
            which in 0_usize..4, s in -0.05_f64..1.1, left in -0.0045_f64..0.0045,
        ) {
            let path = &paths()[which];
            let frame = path.at(s);
            let point = frame.p + frame.b * left;
            let (found, across) = path.project(point.x, point.y);
            prop_assert!((found - s).abs() < 1e-9, "{} m for {} m", found, s);
            prop_assert!((across - left).abs() < 1e-9);
        }
    }
}
