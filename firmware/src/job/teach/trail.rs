//! The trail that the nozzle follows: the seam as it was seen a sensor's lead ahead, kept until the nozzle has passed.
//!
//! Knots stand a fixed distance apart, each put down when enough of the seam beyond it was seen; the oldest make room for the newest.

use super::course::{Ahead, Course};
use crate::geometry::rotation::unit;
use nalgebra::Vector3;

/// Distance between knots, m; the cubic between them is off by less than 0.1 µm on R150.
const SPACING: f32 = 0.005;
/// Knots kept, 0.2 m: two leads and a half.
const KNOTS: usize = 40;
/// Length of the course beyond a knot that must have been seen when it is put down, m: half of what the course is fitted over.
const BEYOND: f32 = 0.010;

/// One knot, Σ_B.
#[derive(Clone, Copy, Debug)]
struct Knot {
    point: Vector3<f32>,
    tangent: Vector3<f32>,
    normal: Vector3<f32>,
}

impl Knot {
    const NONE: Self = Self {
        point: Vector3::new(0.0, 0.0, 0.0),
        tangent: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// A place on the trail, Σ_B.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Point of the seam, m.
    pub point: Vector3<f32>,
    /// Unit normal of the sheet.
    pub normal: Vector3<f32>,
}

/// The trail.
#[derive(Clone, Debug)]
pub struct Trail {
    knots: [Knot; KNOTS],
    /// Knots put down so far; the newest is at this count, less one, modulo [`KNOTS`].
    count: usize,
    /// Distance of the first knot ever, m.
    first: f32,
}

impl Trail {
    /// Without a knot.
    pub const EMPTY: Self = Self {
        knots: [Knot::NONE; KNOTS],
        count: 0,
        first: 0.0,
    };

    /// Starts anew, in place because it is large: with the straight run-in of a nozzle at `from` (m, Σ_B; distance `first`) to the first point seen
    /// at `to`, `lead` further on. `normal` is the sheet's at the start.
    pub fn start(&mut self, first: f32, from: Vector3<f32>, to: Vector3<f32>, lead: f32, normal: Vector3<f32>) {
        let chord = to - from;
        let knot = Knot {
            point: from,
            tangent: unit(&chord).unwrap_or(chord),
            normal,
        };
        self.count = 0;
        self.first = first;
        let mut along = 0.0;
        for _ in 0..KNOTS {
            if along >= lead {
                break;
            }
            self.put(Knot {
                point: from + chord * (along / lead),
                ..knot
            });
            along += SPACING;
        }
    }

    fn put(&mut self, knot: Knot) {
        if let Some(place) = self.knots.get_mut(self.count % KNOTS) {
            *place = knot;
            self.count += 1;
        }
    }

    /// Distance of the newest knot, m.
    fn last(&self) -> f32 {
        self.first + self.count.saturating_sub(1) as f32 * SPACING
    }

    /// Puts down the next knot if the course is known far enough beyond it; at most one, so that a cycle's work is bounded.
    pub fn extend(&mut self, course: &Course, normal: &Vector3<f32>) {
        let next = self.last() + SPACING;
        let ahead = next - course.station();
        if ahead <= -BEYOND {
            let Ahead { point, tangent } = course.at(ahead);
            self.put(Knot {
                point,
                tangent,
                normal: *normal,
            });
        }
    }

    /// The seam at distance `s`, m: on the trail, and past its newest knot on the course.
    pub fn at(&self, s: f32, course: &Course, normal: &Vector3<f32>) -> Spot {
        let position = (s - self.first) * (1.0 / SPACING);
        let newest = self.count.saturating_sub(1);
        if position >= newest as f32 {
            return Spot {
                point: course.at(s - course.station()).point,
                normal: *normal,
            };
        }
        let oldest = self.count.saturating_sub(KNOTS);
        let position = position.max(oldest as f32);
        let index = position as usize;
        let u = position - index as f32;
        let knot = |index: usize| self.knots.get(index % KNOTS).unwrap_or(&self.knots[0]);
        let (a, b) = (knot(index), knot(index + 1));
        let (u2, u3) = (u * u, u * u * u);
        let rise = 3.0 * u2 - 2.0 * u3;
        let ends = a.tangent * (u3 - 2.0 * u2 + u) + b.tangent * (u3 - u2);
        Spot {
            point: a.point + (b.point - a.point) * rise + ends * SPACING,
            normal: a.normal + (b.normal - a.normal) * u,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::length;
    use crate::geometry::trig::sin_cos;

    #[test]
    fn the_nozzle_is_led_along_what_was_seen_a_lead_ahead() {
        let arc = |s: f32| {
            let (sin, cos) = sin_cos(s / 0.150);
            Vector3::new(0.150 * sin, 0.150 * (1.0 - cos), 0.0)
        };
        let normal = Vector3::z();
        let mut course = Course::new(0.0, arc(0.0), Vector3::x());
        let mut trail = Trail::EMPTY;
        trail.start(-0.080, Vector3::new(-0.080, 0.0, 0.0), arc(0.0), 0.080, normal);
        let mut s = 0.0;
        while s < 0.4 {
            s += 0.002;
            let point = arc(s);
            let (ahead, _) = course.locate(&point);
            course.take(ahead, &point);
            trail.extend(&course, &normal);
            let tip = trail.at(s - 0.080, &course, &normal).point;
            let away = if s < 0.080 {
                tip.y
            } else {
                length(&(tip - Vector3::new(0.0, 0.150, 0.0))) - 0.150
            };
            // Where the straight run-in ends and the arc begins the fit rounds the step in curvature.
            assert!(away.abs() < 0.2e-3, "{away} m off at {s}");
        }
    }
}
