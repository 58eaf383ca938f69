//! A path is prepared: its stations laid, its headings turned for the sensor, its corners found and its speed capped.

use super::corner::{CORNERS, Corner};
use super::{SPACING, STATIONS, Station, TaughtPath, direction};
use crate::geometry::rotation::length;
use nalgebra::Vector3;

/// A path that turns by more than this from one station to the next has them at half the distance, rad: 20°. R5 is then off by 0.04 mm at most,
/// where it begins and ends.
const TURN_LIMIT: f32 = 0.35;

/// Least distance into the seam of the first frame, m: a part can end where its seam starts, and the slit's light runs aslant.
const FIRST_LOOK: f32 = 0.004;

/// Distance to either side over which the heading is averaged, m: ±25 mm turn the tool at 0.3 m/s with a third of the wrist's
/// acceleration, and move the sensor off the seam by less than 1.5 mm.
const EASING: f32 = 0.025;

/// Furthest along the path that the sensor's place over it is searched for, m: two leads of 80 mm.
const LEAD_REACH: f32 = 0.160;

/// How a path is to be travelled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Speed along the seam, m/s.
    pub speed: f32,
    /// Acceleration and braking along the path, m/s².
    pub acceleration: f32,
    /// Highest centripetal acceleration of the tip, m/s²: the path slows down where it is bent more.
    pub centripetal: f32,
    /// Highest rate at which the tool is turned about its own axis, rad/s: the path slows down where its heading turns faster.
    pub turn_rate: f32,
    /// Distance from tip to sensor, m.
    pub lead: f32,
}

/// Why a path was not accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathError {
    /// Fewer than two points.
    TooShort,
    /// Run-in, seam and run-out need more than [`STATIONS`] stations: longest seam that is possible, m.
    TooLong(f32),
    /// More than [`CORNERS`] stops are needed.
    TooManyCorners,
    /// A stretch that the sensor cannot see on the way, from and to (m), is longer than [`super::corner::UNSEEN`].
    Unseen(f32, f32),
}

impl TaughtPath {
    /// Prepares the path through `seam(s)`, which gives point, tangent and normal (Σ_B) for any s in 0..=`length`; run-in and
    /// run-out are straight extensions of the ends: long enough for the sensor to pass the start before the nozzle does, and to brake.
    pub fn new(
        length: f32,
        travel: &Travel,
        mut seam: impl FnMut(f32) -> ([f32; 3], [f32; 3], [f32; 3]),
    ) -> Result<Self, PathError> {
        if length < 2.0 * SPACING {
            return Err(PathError::TooShort);
        }
        let spacing = spacing(length, &mut seam);
        let brake = travel.speed * travel.speed / (2.0 * travel.acceleration);
        // At the start of the run-in the sensor stands over the first millimetres of the seam: the first frame is taken at rest, and
        // the nozzle has the whole lead to come up to speed.
        let before = (((travel.lead - FIRST_LOOK) / spacing) as usize).max((brake / spacing) as usize + 1);
        let after = (brake / spacing) as usize + 2;
        let count = before + (length / spacing) as usize + 1 + after;
        if count > STATIONS {
            return Err(PathError::TooLong((STATIONS - before - 1 - after) as f32 * spacing));
        }
        let first = -(before as f32) * spacing;
        let mut path = Self {
            stations: [Station::default(); STATIONS],
            count: count as u16,
            first,
            length,
            spacing,
            per_metre: 1.0 / spacing,
            corners: [Corner::NONE; CORNERS],
        };
        for (index, station) in path.stations.iter_mut().take(count).enumerate() {
            let s = first + index as f32 * spacing;
            let inside = s.max(0.0).min(length);
            let (point, tangent, normal) = seam(inside);
            let extended = Vector3::from(point) + Vector3::from(tangent) * (s - inside);
            *station = Station {
                point: extended.into(),
                tangent,
                normal,
                heading: tangent,
                speed_squared: 0.0,
            };
        }
        path.turn_headings(travel.lead);
        path.corners = path.find_corners(travel.lead)?;
        path.limit_speed(travel);
        Ok(path)
    }

    /// Turns each heading toward the point of the path that lies `lead` away, so that the sensor sees the seam it is to measure.
    fn turn_headings(&mut self, lead: f32) {
        let count = self.count as usize;
        let mut headings = [[0.0; 3]; STATIONS];
        for (index, heading) in headings.iter_mut().take(count).enumerate() {
            let s = self.station(index);
            let here = self.place(s);
            let away = |far: &Vector3<f32>| length(&(far - here.point));
            let chord = self
                .reach(s, lead, away)
                .map_or(here.tangent, |there| there.point - here.point);
            let flat = chord - here.normal * chord.dot(&here.normal);
            *heading = direction(flat).into();
        }
        // The chord turns abruptly where the nozzle passes a bend; the heading need not: it is averaged over the stations around.
        let easing = (EASING / self.spacing + 0.5) as usize;
        for (index, station) in self.stations.iter_mut().take(count).enumerate() {
            let around = headings
                .iter()
                .take(count.min(index + easing + 1))
                .skip(index.saturating_sub(easing));
            let sum = around.fold(Vector3::zeros(), |sum, heading| sum + Vector3::from(*heading));
            let normal = Vector3::from(station.normal);
            station.heading = direction(sum - normal * sum.dot(&normal)).into();
        }
    }

    /// Where, from `s` on, a measure of the path's points first comes to `lead` (m), to a fraction of half a spacing; straight on past the end.
    pub(super) fn reach(&self, s: f32, lead: f32, measure: impl Fn(&Vector3<f32>) -> f32) -> Option<Reached> {
        let steps = (2.0 * LEAD_REACH / self.spacing + 0.5) as usize;
        let (mut near, mut before) = (self.place(s).point, 0.0);
        for step in 1..=steps {
            let there = s + step as f32 * 0.5 * self.spacing;
            let far = self.place_extended(there);
            let measured = measure(&far);
            if measured >= lead {
                let part = (lead - before) / (measured - before);
                return Some(Reached {
                    station: there - (1.0 - part) * 0.5 * self.spacing,
                    point: near + (far - near) * part,
                });
            }
            (near, before) = (far, measured);
        }
        None
    }
}

/// A place ahead on a path: its distance, m, and the point there.
pub(super) struct Reached {
    pub station: f32,
    pub point: Vector3<f32>,
}

/// Distance between the stations of a seam, m.
fn spacing(whole: f32, seam: &mut impl FnMut(f32) -> ([f32; 3], [f32; 3], [f32; 3])) -> f32 {
    let steps = (whole / SPACING) as usize;
    let mut before = Vector3::from(seam(0.0).1);
    let mut turns = (1..=steps).map(|step| {
        let tangent = Vector3::from(seam(step as f32 * SPACING).1);
        length(&(tangent - core::mem::replace(&mut before, tangent)))
    });
    if turns.any(|turn| turn > TURN_LIMIT) {
        0.5 * SPACING
    } else {
        SPACING
    }
}
