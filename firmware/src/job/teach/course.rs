//! The course of an unknown seam: where it goes on, from the points that the sensor saw.
//!
//! In: seam points in Σ_B, as they are seen. Out: point and direction of the seam by distance from the newest one, a little way ahead and a
//! little way behind. A quadratic in the distance is fitted to all points with weights that fall off with distance, by least squares; its
//! curvature is drawn towards zero (a ridge), or noise would throw the extrapolation about by millimetres (spec, chapter 4). The sums of the
//! fit are carried along from point to point, so that a point costs the same however many were seen.

use crate::geometry::rotation::unit;
use crate::geometry::trig::sqrt;
use nalgebra::Vector3;

/// Distance in which the weight of a point falls to 1/e, m: four points at 0.1 m/s and 35 ms, and short against R150.
const FADE: f32 = 0.015;

/// The ridge, in units of one point's weight, on the quadratic's coefficient over [`FADE`]: a seam noise of 0.15 mm against curvatures of
/// 10/m as the scale of what is to be expected (R150 has 6.7/m), (0.15 mm / (FADE²·10/m / 2))².
const RIDGE: f32 = 0.018;

/// Weight of the start's direction, as two points behind the first that lie on it: less than one point's.
const START_WEIGHT: f32 = 0.3;
/// Where those two lie, in units of [`FADE`].
const START_BEHIND: [f32; 2] = [-0.5, -1.5];

/// Furthest that the quadratic is carried on past the newest point, m; from there the course is straight.
const CURVED: f32 = 0.020;

/// A place on the course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    /// Point of the seam, m, Σ_B.
    pub point: Vector3<f32>,
    /// Unit tangent.
    pub tangent: Vector3<f32>,
}

/// The fit, about the newest point: offset + slope·x + bend·x², x in units of `FADE` from it.
#[derive(Clone, Debug)]
pub struct Course {
    /// Distance of the newest point along the seam, m.
    station: f32,
    /// The newest point, where the fit's coordinates begin, m, Σ_B.
    origin: Vector3<f32>,
    /// Σ w·xᵏ, k = 0..=4.
    moments: [f32; 5],
    /// Σ w·xᵏ·(point − origin), k = 0..=2.
    sums: [Vector3<f32>; 3],
    offset: Vector3<f32>,
    slope: Vector3<f32>,
    bend: Vector3<f32>,
}

impl Course {
    /// Of nothing.
    pub const EMPTY: Self = Self {
        station: 0.0,
        origin: Vector3::new(0.0, 0.0, 0.0),
        moments: [0.0; 5],
        sums: [Vector3::new(0.0, 0.0, 0.0); 3],
        offset: Vector3::new(0.0, 0.0, 0.0),
        slope: Vector3::new(0.0, 0.0, 0.0),
        bend: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Begins at `point` (m, Σ_B) at distance `station`, towards the unit vector `direction`.
    pub fn new(station: f32, point: Vector3<f32>, direction: Vector3<f32>) -> Self {
        let mut course = Self {
            station,
            origin: point,
            slope: direction * FADE,
            ..Self::EMPTY
        };
        course.add(1.0, 0.0, Vector3::zeros());
        for x in START_BEHIND {
            course.add(START_WEIGHT, x, direction * (FADE * x));
        }
        course
    }

    /// Distance of the newest point, m.
    pub fn station(&self) -> f32 {
        self.station
    }

    /// The course `ahead` metres past the newest point; negative is behind it, where it holds for about `FADE`.
    pub fn at(&self, ahead: f32) -> Ahead {
        let x = ahead.min(CURVED) * (1.0 / FADE);
        let slope = self.slope + self.bend * (2.0 * x);
        let beyond = (ahead - CURVED).max(0.0) * (1.0 / FADE);
        Ahead {
            point: self.origin + self.offset + (self.slope + self.bend * x) * x + slope * beyond,
            tangent: unit(&slope).unwrap_or(slope),
        }
    }

    /// Distance of `point` past the newest one along the course, m, and its way off the course there, m.
    pub fn locate(&self, point: &Vector3<f32>) -> (f32, Vector3<f32>) {
        // Along the tangent, in true metres whatever length the fit gives its slope: 15 mm on R150 come out 25 µm short.
        let ahead = self.at(0.0).tangent.dot(&(point - self.origin));
        let place = self.at(ahead);
        let off = point - place.point;
        (ahead, off - place.tangent * place.tangent.dot(&off))
    }

    /// Takes in a point `ahead` metres past the newest one, as [`Self::locate`] says.
    pub fn take(&mut self, ahead: f32, point: &Vector3<f32>) {
        if ahead > 0.0 {
            self.advance(ahead, point - self.origin);
        }
        self.add(1.0, ahead.min(0.0) * (1.0 / FADE), point - self.origin);
        self.fit();
    }

    /// Moves the fit's coordinates on by `ahead` to the new point, `shift` from the old one, and fades what lies behind.
    fn advance(&mut self, ahead: f32, shift: Vector3<f32>) {
        let d = ahead * (1.0 / FADE);
        let fade = 1.0 / (1.0 + d + 0.5 * d * d);
        let [m0, m1, m2, m3, m4] = self.moments;
        let [v0, v1, v2] = self.sums;
        let (v0, v1, v2) = (v0 - shift * m0, v1 - shift * m1, v2 - shift * m2);
        let d2 = d * d;
        self.moments = [
            m0,
            m1 - d * m0,
            m2 - 2.0 * d * m1 + d2 * m0,
            m3 - 3.0 * d * m2 + 3.0 * d2 * m1 - d2 * d * m0,
            m4 - 4.0 * d * m3 + 6.0 * d2 * m2 - 4.0 * d2 * d * m1 + d2 * d2 * m0,
        ]
        .map(|moment| moment * fade);
        self.sums = [v0, v1 - v0 * d, v2 - v1 * (2.0 * d) + v0 * d2].map(|sum| sum * fade);
        self.origin += shift;
        self.station += ahead;
    }

    /// The seam bends here: most of the weight of what lies behind is dropped, and the course goes on from the newest point.
    pub fn turn(&mut self) {
        const KEPT: f32 = 0.2;
        self.moments = self.moments.map(|moment| moment * KEPT);
        self.sums = self.sums.map(|sum| sum * KEPT);
    }

    #[inline(never)] // in no hurry
    fn add(&mut self, weight: f32, x: f32, offset: Vector3<f32>) {
        let mut power = weight;
        for (k, moment) in self.moments.iter_mut().enumerate() {
            *moment += power;
            if let Some(sum) = self.sums.get_mut(k) {
                *sum += offset * power;
            }
            power *= x;
        }
    }

    /// Solves the normal equations by Cholesky's method; the ridge keeps the last pivot positive, and what rounding makes of the others is
    /// held off zero.
    fn fit(&mut self) {
        const LEAST: f32 = 1e-4;
        let [m0, m1, m2, m3, m4] = self.moments;
        let [v0, v1, v2] = self.sums;
        let l00 = sqrt(m0.max(LEAST));
        let (l10, l20) = (m1 / l00, m2 / l00);
        let l11 = sqrt((m2 - l10 * l10).max(LEAST));
        let l21 = (m3 - l20 * l10) / l11;
        let l22 = sqrt((m4 + RIDGE - l20 * l20 - l21 * l21).max(LEAST));
        let y0 = v0 * (1.0 / l00);
        let y1 = (v1 - y0 * l10) * (1.0 / l11);
        let y2 = (v2 - y0 * l20 - y1 * l21) * (1.0 / l22);
        self.bend = y2 * (1.0 / l22);
        self.slope = (y1 - self.bend * l21) * (1.0 / l11);
        self.offset = (y0 - self.bend * l20 - self.slope * l10) * (1.0 / l00);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::geometry::rotation::length;
    use crate::geometry::trig::sin_cos;

    /// 100 mm straight, then R150 to the left, in a plane; arc length in m.
    fn seam(s: f32) -> Vector3<f32> {
        let (sin, cos) = sin_cos((s - 0.1).max(0.0) / 0.150);
        Vector3::new(s.min(0.1) + 0.150 * sin, 0.150 * (1.0 - cos), 0.2)
    }

    /// A plain congruential stream of noise within ±1.
    fn noise(state: &mut u32) -> f32 {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*state >> 8) as f32 / 8_388_608.0 - 1.0
    }

    /// The largest error of the extrapolation by `ahead` over line and arc, for points each `pitch` with noise of ±`amplitude` (m).
    fn worst(pitch: f32, amplitude: f32, ahead: f32) -> f32 {
        let mut course = Course::new(0.0, seam(0.0), Vector3::x());
        let (mut state, mut worst, mut s) = (7, 0.0f32, 0.0);
        while s < 0.4 {
            s += pitch;
            let away = Vector3::new(0.0, noise(&mut state), noise(&mut state)) * amplitude;
            let point = seam(s) + away;
            let (distance, _) = course.locate(&point);
            course.take(distance, &point);
            let (_, off) = course.locate(&seam(s + ahead));
            worst = worst.max(length(&off));
        }
        worst
    }

    #[test]
    fn a_line_and_an_arc_of_150_mm_are_extrapolated_by_the_latency_of_0_2_m_per_s() {
        // 7 mm between points, and as much again until the next is in.
        let error = worst(0.007, 0.0, 0.014);
        // At the beginning of the arc, whose curvature is not yet known; the sensor's view reaches 12 mm.
        assert!(error < 1.8e-3, "{error} m");
    }

    #[test]
    fn noise_is_not_thrown_about_by_the_extrapolation() {
        // ±0.3 mm is 0.17 mm rms, the two-slit sensor's printed noise: an unregularised quadratic gave 3 mm.
        let error = worst(0.0035, 0.3e-3, 0.007);
        assert!(error < 1.0e-3, "{error} m");
    }

    #[test]
    fn the_distance_counts_along_the_seam() {
        let mut course = Course::new(0.0, seam(0.0), Vector3::x());
        for step in 1..=100 {
            let point = seam(step as f32 * 4e-3);
            let (distance, _) = course.locate(&point);
            course.take(distance, &point);
        }
        assert!((course.station() - 0.4).abs() < 1e-3, "{} m", course.station());
    }
}
