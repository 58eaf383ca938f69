//! The search for a seam's other leg, where it turns off more sharply than it is followed on the move.
//!
//! The sensor stands past the seam's last point over a sheet without a seam. From over the seam it is swung about that point, straight on first
//! and then to either side, as far as 100°: on a circle about the point the other leg is crossed nearly squarely by a tool that points outwards,
//! wherever it leads. Sightings in one place are taken for it, and the sensor is led along it, inwards; what it sees then gives the leg's
//! direction and, with the leg behind, the corner. Last it is led over the corner, tool turned half way there, so that the bend is taught as
//! well. Always raised, for the nozzle is not on the seam. Where the leg is, is said in Σ_E: at the last point, x along the seam, z the sheet's
//! normal. How the arm gets from place to place is the job's business.

use super::course::Course;
use super::seam::{CLOSE, Seam, TURN_SLOPE};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use crate::geometry::trig::sin_cos;
use crate::job::correction::Use;
use crate::job::stance::Stance;
use nalgebra::{Matrix3, Vector3};

/// Radius of the circle on which the slit is swung, m: the corner may lie 10 mm past the last point and beside the tool's axis, the view reaches 15.
const CIRCLE: f32 = 0.030;
/// Angle between two places on it, rad: 25°; what lies between is seen on the way.
const STEP: f32 = 0.436;
/// The places, in such steps: to the left, back, to the right.
const PLACES: [i8; 11] = [0, 1, 2, 3, 4, 2, 0, -1, -2, -3, -4];
/// Where the left is left for the right, on the way back.
const BACK: usize = 6;

/// Sightings of the swing that are kept, those of half a second.
const KEPT: usize = 16;
/// So many of them within that distance (m) of one another are a leg: the slit passes it in half a second, and one in a thousand is wrong.
const AGREE: usize = 5;
const NEAR: f32 = 0.005;

/// The leg is traced from so far beyond the place where it was seen to so far before it, m.
const TRACE: [f32; 2] = [0.015, 0.015];
/// Points on a line that make it one.
const TRACED: u8 = 6;

/// Where along the leg behind the corner may be, m past the last point: wrong sightings may have led on past it.
const CORNER: [f32; 2] = [-0.030, 0.025];
/// Sine of the turn below which legs are in line, and the corner is half way between what was seen of them, 15°.
const IN_LINE: f32 = 0.26;
/// Least way before the corner, and that past it, over which the sensor is led round it, m: R5 and the edge of the view.
const BEFORE: f32 = 0.006;
pub(super) const BEYOND: f32 = 0.012;
/// Places on that way.
const ROUND: u8 = 4;

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    /// Straight up.
    Up,
    /// To a place of the swing.
    Swing,
    /// To where the trace begins.
    Out,
    /// Along it.
    In,
    /// To this place of the way round the corner.
    Round(u8),
}

/// A corner, Σ_E.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Where the legs meet, m.
    point: Vector3<f32>,
    /// Unit direction of the other leg.
    ahead: Vector3<f32>,
}

impl Corner {
    /// Where the line that is traced inwards by `course`, from the point `first`, meets the leg behind, if it does.
    fn of(course: &Course, first: &Vector3<f32>) -> Option<Self> {
        let seen = course.at(0.0).point;
        let ahead = unit(&(first - seen))?;
        let point = if ahead.y.abs() > IN_LINE {
            seen - ahead * (seen.y / ahead.y)
        } else {
            seen * 0.5
        };
        let [from, to] = CORNER;
        // Beyond the corner along the leg, and within the swing; false for what is no number.
        let way = (seen - point).dot(&ahead);
        let met = point.x > from && point.x < to && way > 0.0 && way < 2.0 * CIRCLE;
        met.then_some(Self { point, ahead })
    }
}

/// What is next.
#[derive(Clone, Copy, Debug)]
pub enum Next {
    /// A place to go to, T_b_n.
    Go(Pose),
    /// The other leg is found, and the sensor over it.
    Found,
}

/// One search.
#[derive(Clone, Debug)]
pub struct Search {
    leg: Leg,
    /// Σ_E: T_b_e.
    end: Pose,
    /// Distance of the last point along the seam, m.
    station: f32,
    /// Index of the place of the swing.
    place: usize,
    /// Places were out of the arm's reach.
    barred: bool,
    sightings: [Vector3<f32>; KEPT],
    count: usize,
    /// Where sightings agree, and the sum of the tool's directions at all of them: about that of the leg, which is seen from where it is nearly
    /// square to the slit.
    seen: Option<Vector3<f32>>,
    headings: Vector3<f32>,
    /// The trace, its first point, and the points in it.
    course: Option<Course>,
    first: Vector3<f32>,
    traced: u8,
    corner: Option<Corner>,
}

impl Search {
    /// Past the end of `seam`.
    pub fn new(seam: &Seam) -> Self {
        /// Where the direction of the leg is taken, m before the last point: none of its bend is in that.
        const BEHIND: [f32; 2] = [0.035, 0.015];
        let station = seam.course.station();
        let [far, near] = BEHIND.map(|behind| seam.trail.at(station - behind, &seam.course, &seam.normal).point);
        let chord = near - far;
        let flat = chord - seam.normal * chord.dot(&seam.normal);
        let ahead = seam.course.at(0.0);
        let x = unit(&flat).unwrap_or(ahead.tangent);
        Self {
            leg: Leg::Up,
            end: Pose {
                r: Matrix3::from_columns(&[x, seam.normal.cross(&x), seam.normal]),
                p: ahead.point,
            },
            station,
            place: 0,
            barred: false,
            sightings: [Vector3::zeros(); KEPT],
            count: 0,
            seen: None,
            headings: Vector3::zeros(),
            course: None,
            first: Vector3::zeros(),
            traced: 0,
            corner: None,
        }
    }

    /// The sensor has been led to where it was to be: where to next?
    pub fn next(&mut self, stance: &Stance) -> Result<Next, Fault> {
        self.leg = match (self.leg, self.seen) {
            (Leg::Up, _) => Leg::Swing,
            (Leg::Swing, Some(_)) => Leg::Out,
            (Leg::Swing, None) => self.swing_on(self.place + 1)?,
            (Leg::Out, _) => Leg::In,
            (Leg::In, _) => {
                let course = self.course.take().filter(|_| self.traced >= TRACED);
                self.corner = course.and_then(|course| Corner::of(&course, &self.first));
                self.traced = 0;
                if self.corner.is_some() {
                    Leg::Round(0)
                } else {
                    // Whatever that was, it does not lead on from here.
                    self.seen = None;
                    self.headings = Vector3::zeros();
                    self.count = 0;
                    self.swing_on(self.place + 1)?
                }
            }
            (Leg::Round(place), _) if place < ROUND => Leg::Round(place + 1),
            (Leg::Round(_), _) => return Ok(Next::Found),
        };
        Ok(Next::Go(self.end * self.pose(stance, 1.0)))
    }

    /// The arm cannot turn there: what lies to this side will not be seen.
    pub fn bar(&mut self) -> Result<(), Fault> {
        if self.leg != Leg::Swing {
            return Err(Fault::CannotTurn);
        }
        self.barred = true;
        // What is next is the other side.
        self.place = if self.place < BACK { BACK } else { PLACES.len() } - 1;
        Ok(())
    }

    fn swing_on(&mut self, place: usize) -> Result<Leg, Fault> {
        self.place = place;
        if place < PLACES.len() {
            Ok(Leg::Swing)
        } else if self.barred {
            Err(Fault::CannotTurn)
        } else {
            Err(Fault::SeamLost)
        }
    }

    /// Where the nozzle is to be, T_e_n, with this share of its stance.
    fn pose(&self, stance: &Stance, share: f32) -> Pose {
        let (look, ahead) = self.aim();
        let flat = Vector3::new(ahead.x, ahead.y, 0.0);
        let x = unit(&flat).unwrap_or(Vector3::x());
        stance.over(&look, &x, &Vector3::z(), share)
    }

    /// What the slit is to be over, and which way the tool points, Σ_E.
    fn aim(&self) -> (Vector3<f32>, Vector3<f32>) {
        match (self.leg, self.seen, self.corner) {
            (Leg::Out | Leg::In, Some(seen), _) => {
                let outward = self.outward();
                let [beyond, before] = TRACE;
                let way = if self.leg == Leg::Out { beyond } else { -before };
                (seen + outward * way, outward)
            }
            (Leg::Round(place), _, Some(Corner { point, ahead })) => {
                let (behind, f) = (Vector3::x(), f32::from(place) * (1.0 / ROUND as f32));
                let way = point.x.max(BEFORE);
                // A parabola within the corner, from the last point to past it.
                let (from, to) = (point - behind * way, point + ahead * BEYOND);
                let look = from * ((1.0 - f) * (1.0 - f)) + point * (2.0 * f * (1.0 - f)) + to * (f * f);
                (look, behind * (1.0 - f) + ahead * f)
            }
            _ => {
                let turn = PLACES.get(self.place).map_or(0.0, |place| f32::from(*place) * STEP);
                let (sin, cos) = sin_cos(turn);
                let outward = Vector3::new(cos, sin, 0.0);
                (outward * CIRCLE, outward)
            }
        }
    }

    /// About the direction of the leg that is seen.
    fn outward(&self) -> Vector3<f32> {
        unit(&self.headings).unwrap_or(Vector3::x())
    }

    /// Takes in a sighting at `point` with the tool pointing to `heading`, Σ_B: of use if it is of the bend, which is to be taught.
    pub fn take(&mut self, point: &Vector3<f32>, heading: &Vector3<f32>) -> Use {
        let to_end = self.end.inverse();
        let point = to_end * *point;
        match self.leg {
            Leg::Swing => {
                self.headings += to_end.r * heading;
                self.gather(point);
            }
            Leg::In => self.trace(point),
            Leg::Round(place) if place > 0 => return Use::Used,
            _ => {}
        }
        Use::Waiting
    }

    fn gather(&mut self, point: Vector3<f32>) {
        let others = self.sightings.iter().take(self.count);
        let near = others.filter(|other| length(&(point - **other)) < NEAR);
        let (sum, count) = near.fold((point, 1), |(sum, count), other| (sum + other, count + 1));
        if count >= AGREE {
            self.seen = Some(sum * (1.0 / count as f32));
        }
        if let Some(place) = self.sightings.get_mut(self.count % KEPT) {
            *place = point;
        }
        self.count += 1;
    }

    fn trace(&mut self, point: Vector3<f32>) {
        if let Some(course) = &mut self.course {
            let (ahead, off) = course.locate(&point);
            if length(&off) <= CLOSE + TURN_SLOPE * ahead.abs() {
                course.take(ahead, &point);
                self.traced = self.traced.saturating_add(1);
                return;
            }
            if self.traced > 2 {
                return;
            }
        }
        // The first, or the first was wrong.
        self.course = Some(Course::new(0.0, point, -self.outward()));
        self.first = point;
        self.traced = 1;
    }

    /// Where the seam's other leg is first seen, m in Σ_B; the nozzle's pose that far behind on the sheet, T_b_n; and the distance along the seam at
    /// which the nozzle comes to the corner, m, a little before that first point.
    pub fn found(&self, stance: &Stance) -> Option<(Vector3<f32>, Pose, f32)> {
        let Corner { point, ahead } = self.corner?;
        let nozzle = self.end * self.pose(stance, 0.0);
        Some((self.end * (point + ahead * BEYOND), nozzle, self.station + point.x))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::geometry::trig::atan2;

    const PARAMS: Stance = Stance {
        raise: 0.006,
        look: 0.075,
        lean: 0.0,
    };

    /// A seam along x that was seen up to the origin, in a tilted sheet.
    fn seam() -> Seam {
        let tilt = crate::geometry::rotation::rot_x(0.3);
        let at = |s: f32| Pose {
            r: tilt,
            p: Vector3::new(0.4 + s, -0.1, 0.2),
        };
        let mut seam = Seam::EMPTY;
        seam.start(-0.05, at(-0.05).p, &at(-0.13), 0.08);
        for step in 1..=25 {
            let point = at(-0.05 + 0.002 * step as f32).p;
            assert_eq!(seam.take(&point, &tilt.column(1).into()), Use::Used);
            seam.trail.extend(&seam.course, &seam.normal);
        }
        seam
    }

    /// What the slit of a nozzle at `nozzle` (T_e_n) shows of a leg from `corner` on towards `ahead`, Σ_E: within 13 mm beside the middle, and
    /// within 25° of square.
    fn sight(nozzle: &Pose, corner: &Vector3<f32>, ahead: &Vector3<f32>) -> Option<Vector3<f32>> {
        let (x, y): (Vector3<f32>, Vector3<f32>) = (nozzle.r.column(0).into(), nozzle.r.column(1).into());
        let square = ahead.dot(&x);
        let along = (PARAMS.look - (corner - nozzle.p).dot(&x)) / square;
        let point = corner + ahead * along;
        let beside = (point - nozzle.p).dot(&y);
        (square > 0.906 && along > 0.0 && beside.abs() < 0.013).then_some(point)
    }

    /// Searches for a leg that turns off by `degrees` 6 mm past the last point; places beyond `reach` (rad) are out of the arm's.
    fn search(degrees: f32, reach: f32) -> Result<Corner, Fault> {
        let mut search = Search::new(&seam());
        let (sin, cos) = sin_cos(degrees.to_radians());
        let (corner, ahead) = (Vector3::new(0.006, 0.0, 0.0), Vector3::new(cos, sin, 0.0));
        let mut from = search.pose(&PARAMS, 1.0);
        for _ in 0..40 {
            let Next::Go(_) = search.next(&PARAMS)? else {
                return Ok(search.corner.unwrap());
            };
            let to = search.pose(&PARAMS, 1.0);
            if atan2(to.r.m21, to.r.m11).abs() > reach {
                search.bar()?;
                continue;
            }
            for step in 1..=12 {
                let f = step as f32 / 12.0;
                let x = from.r.column(0) * (1.0 - f) + to.r.column(0) * f;
                let x = unit(&Vector3::from(x)).unwrap();
                let way = Pose {
                    r: Matrix3::from_columns(&[x, Vector3::z().cross(&x), Vector3::z()]),
                    p: from.p + (to.p - from.p) * f,
                };
                if let Some(point) = sight(&way, &corner, &ahead) {
                    // One in ten is wrong.
                    let wrong = if step == 7 { 0.006 } else { 0.0 };
                    let aside = Vector3::z().cross(&ahead) * wrong;
                    search.take(&(search.end * (point + aside)), &(search.end.r * x));
                }
            }
            from = to;
        }
        panic!("no end of the search at {degrees}°")
    }

    #[test]
    fn a_leg_to_either_side_is_found_where_it_is() {
        for degrees in [-100.0f32, -90.0, -45.0, -30.0, 30.0, 60.0, 90.0, 100.0] {
            let Corner { point, ahead } = search(degrees, 4.0).unwrap();
            let turn = atan2(ahead.y, ahead.x).to_degrees();
            assert!((turn - degrees).abs() < 1.0, "{turn}° of {degrees}°");
            let off = length(&(point - Vector3::new(0.006, 0.0, 0.0)));
            assert!(off < 1e-3, "the corner {off} m off at {degrees}°");
        }
    }

    #[test]
    fn a_seam_that_goes_nowhere_is_lost_and_a_side_that_the_arm_cannot_turn_to_is_told_apart() {
        assert_eq!(search(170.0, 4.0).err(), Some(Fault::SeamLost));
        assert_eq!(search(90.0, 0.5).err(), Some(Fault::CannotTurn));
        // What the other side has is found all the same.
        assert!(search(-30.0, 1.0).is_ok());
    }
}
