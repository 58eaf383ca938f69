//! The seam as far as it is known: takes in what follows on, and leaves out what does not.

use super::course::Course;
use super::trail::Trail;
use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use crate::job::correction::Use;
use nalgebra::Vector3;

/// A sighting follows on if it lies within this of the course, m: four standard deviations on an ordinary surface …
pub(super) const CLOSE: f32 = 0.5e-3;
/// … and this much more per distance from the newest point, m/m: what R150 bends away from a straight course in 15 mm.
const CLOSE_SLOPE: f32 = 0.05;
/// Tangent of the sharpest turn that is followed on the move, 20°: within it two sightings that agree with each other are believed against the
/// course.
pub(super) const TURN_SLOPE: f32 = 0.36;
/// Furthest behind the newest point that a point is still of use to the course, m: the second slit's distance and a frame's way.
const BEHIND: f32 = 0.030;

/// Share of the difference that the normal takes up with each point: smoothed over about 25 mm.
const NORMAL_SHARE: f32 = 0.15;
/// Cosine of the largest difference that is still taken for the sheet's slope, 15°.
const NORMAL_REACH: f32 = 0.966;

/// The seam as far as it is known.
#[derive(Clone, Debug)]
pub struct Seam {
    /// Where it goes on.
    pub course: Course,
    /// Where the nozzle goes.
    pub trail: Trail,
    /// Normal of the sheet at the newest points.
    pub normal: Vector3<f32>,
    /// A sighting off the course, at this distance, that waits for another that agrees with it.
    waiting: Option<(f32, Vector3<f32>)>,
}

impl Seam {
    /// Nothing yet.
    pub const EMPTY: Self = Self {
        course: Course::EMPTY,
        trail: Trail::EMPTY,
        normal: Vector3::new(0.0, 0.0, 0.0),
        waiting: None,
    };

    /// Starts anew, in place because it is large: from `first` (m, Σ_B), `station` along the seam, with the nozzle at `nozzle` (T_b_n) `behind` metres
    /// before that.
    #[inline(never)]
    pub fn start(&mut self, station: f32, first: Vector3<f32>, nozzle: &Pose, behind: f32) {
        self.course = Course::new(station, first, nozzle.r.column(0).into());
        self.normal = nozzle.r.column(2).into();
        self.waiting = None;
        self.trail.start(station - behind, nozzle.p, first, behind, self.normal);
    }

    /// Takes in a point of the seam if it follows on.
    pub fn take(&mut self, point: &Vector3<f32>, across: &Vector3<f32>) -> Use {
        let (ahead, off) = self.course.locate(point);
        let away = length(&off);
        let reach = ahead.max(0.0);
        if ahead < -BEHIND {
            return Use::OffPath;
        }
        if away <= CLOSE + CLOSE_SLOPE * reach {
            self.waiting = None;
            self.add(ahead, point, across);
            return Use::Used;
        }
        let within = away <= CLOSE + TURN_SLOPE * ahead.abs(); // false for what is no number
        if !within {
            return Use::Outlier;
        }
        if ahead < 0.0 {
            // Where the seam bends, the course does not reach back to what lies before it.
            return Use::OffPath;
        }
        let station = self.course.station() + ahead;
        let before = self.waiting.replace((station, *point));
        let agrees = |(then, other): &(f32, Vector3<f32>)| {
            let (_, aside) = self.course.locate(other);
            length(&(off - aside)) <= CLOSE + TURN_SLOPE * (station - then).abs() && station > *then
        };
        let Some((then, other)) = before.filter(agrees) else {
            return Use::Waiting;
        };
        self.waiting = None;
        // A bend: what lies before it says little of where the seam goes on.
        self.course.turn();
        self.course.take(then - self.course.station(), &other);
        let (ahead, _) = self.course.locate(point);
        self.add(ahead, point, across);
        Use::Used
    }

    fn add(&mut self, ahead: f32, point: &Vector3<f32>, across: &Vector3<f32>) {
        self.course.take(ahead, point);
        let tangent = self.course.at(0.0).tangent;
        let normal = unit(&tangent.cross(across)).unwrap_or(self.normal);
        if normal.dot(&self.normal) > NORMAL_REACH {
            let mixed = self.normal + (normal - self.normal) * NORMAL_SHARE;
            self.normal = unit(&mixed).unwrap_or(self.normal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::trig::{atan2, sin_cos};
    use crate::job::teach::course::Ahead;
    use crate::job::teach::ending::{Ending, Outcome};

    /// A seam with a corner of `degrees` to the left after 0.1 m, R5, seen each 7 mm (0.2 m/s and 35 ms).
    fn follow(degrees: f32) -> (Seam, Option<f32>) {
        const RADIUS: f32 = 0.005;
        let turn = degrees.to_radians();
        let corner = |s: f32| {
            let (sin, cos) = sin_cos(((s - 0.1) / RADIUS).max(0.0).min(turn));
            let past = (s - 0.1 - RADIUS * turn).max(0.0);
            Vector3::new(
                s.min(0.1) + RADIUS * sin + past * cos,
                RADIUS * (1.0 - cos) + past * sin,
                0.0,
            )
        };
        let nozzle = Pose {
            p: Vector3::new(-0.08, 0.0, 0.0),
            ..Pose::identity()
        };
        let mut seam = Seam::EMPTY;
        seam.start(0.0, corner(0.0), &nozzle, 0.08);
        let mut refused = None;
        for step in 1..40 {
            let s = 0.007 * step as f32;
            if seam.take(&corner(s), &Vector3::y()) == Use::Outlier {
                refused = refused.or(Some(s));
            }
        }
        (seam, refused)
    }

    #[test]
    fn a_corner_of_15_degrees_is_followed_on_the_move() {
        let (seam, refused) = follow(15.0);
        assert_eq!(refused, None);
        let Ahead { tangent, .. } = seam.course.at(0.0);
        let heading = atan2(tangent.y, tangent.x).to_degrees();
        assert!((heading - 15.0).abs() < 0.5, "{heading}°");
    }

    #[test]
    fn the_second_slit_may_see_the_place_before_a_corner_that_the_course_has_turned_at() {
        let (mut seam, _) = follow(15.0);
        // 15 mm behind the newest point, and 1 mm off its course.
        let Ahead { point, tangent } = seam.course.at(-0.015);
        let beside = Vector3::z().cross(&tangent) * 1e-3;
        assert_eq!(seam.take(&(point + beside), &Vector3::y()), Use::OffPath);
        assert_eq!(seam.take(&(point + beside * 8.0), &Vector3::y()), Use::Outlier);
    }

    #[test]
    fn a_corner_of_90_degrees_is_no_course_of_the_seam_and_loses_it() {
        let (seam, refused) = follow(90.0);
        assert!(refused.is_some_and(|s| (0.1..0.13).contains(&s)), "{refused:?}");
        assert!(seam.course.station() < 0.115, "{} m", seam.course.station());
        let ending = Ending::default();
        assert_eq!(ending.judge(0.17, seam.course.station()), Outcome::Lost);
    }
}
