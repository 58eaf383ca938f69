//! The taught path: what the nozzle is to follow, by distance.
//!
//! In: points that somebody taught, each with its distance along the path. Out: the nozzle's pose and allowed speed at any
//! distance s. A path is prepared once, before the job ([`TaughtPath::new`]); the cycle only looks up. The
//! nozzle is axisymmetric, so its heading is free: it is turned so that the sensor, a fixed lead ahead of the tip, stays over
//! the path (asin(lead / 2R) on an arc). Where no heading can do that ([`corner`]), the path has a stop, from which the sensor is led
//! over what it could not see. Corrections are not here: see [`super::correction`].

pub mod corner;
mod preparation;
mod speed;

use crate::geometry::Pose;
use crate::geometry::rotation::unit;
use corner::{CORNERS, Corner};
use hal::wire_struct;
use nalgebra::{Matrix3, Vector3};
pub use preparation::{PathError, Travel};

/// Most stations a path can hold: 2.5 m at 5 mm.
pub const STATIONS: usize = 512;

/// Distance between stations, m. On R150 the cubic between stations is off by less than 0.1 µm; a corner narrower than this is rounded
/// within it, by at most 0.2 mm at 15°.
pub const SPACING: f32 = 0.005;

/// Steps of the search for the place nearest to a point: each divides the error by ten or more on R150.
const PROJECTION_STEPS: usize = 3;

/// One point of a path, all in Σ_B.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Station {
    /// Position of the seam, m.
    pub point: [f32; 3],
    /// Unit tangent, along travel.
    pub tangent: [f32; 3],
    /// Unit normal of the sheet, out of it, toward the nozzle.
    pub normal: [f32; 3],
    /// Unit heading: x axis of the nozzle frame, from the tip toward the sensor.
    pub heading: [f32; 3],
    /// Square of the highest allowed speed, m²/s²: linear in s where the path brakes.
    pub speed_squared: f32,
}

wire_struct!(Station {
    point: [f32; 3],
    tangent: [f32; 3],
    normal: [f32; 3],
    heading: [f32; 3],
    speed_squared: f32
});

/// A prepared path with its run-in (s < 0) and run-out (s > length).
#[derive(Clone, Debug, PartialEq)]
pub struct TaughtPath {
    stations: [Station; STATIONS],
    count: u16,
    /// Distance of the first station, m: minus the run-in.
    first: f32,
    /// Length of the seam to seal, m: the bead is laid on 0..=length.
    length: f32,
    /// Distance between stations, m, and how many there are in a metre.
    spacing: f32,
    per_metre: f32,
    /// Stops on the way, in order; those that are not needed lie at infinity.
    corners: [Corner; CORNERS],
}

wire_struct!(TaughtPath {
    stations: [Station; STATIONS],
    count: u16,
    first: f32,
    length: f32,
    spacing: f32,
    per_metre: f32,
    corners: [Corner; CORNERS]
});

/// A place on the path.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Seam point, m, Σ_B.
    pub point: Vector3<f32>,
    /// Unit tangent.
    pub tangent: Vector3<f32>,
    /// Unit normal of the sheet.
    pub normal: Vector3<f32>,
    /// Heading: a unit vector square to the normal but for the rounding of a bend between stations, which [`Self::nozzle`] takes off.
    pub heading: Vector3<f32>,
}

impl Place {
    /// Left of travel in the sheet: normal × tangent.
    pub fn lateral(&self) -> Vector3<f32> {
        self.normal.cross(&self.tangent)
    }
}

impl TaughtPath {
    /// Distance of the station `index`, m.
    fn station(&self, index: usize) -> f32 {
        self.first + index as f32 * self.spacing
    }

    /// Distance of the start of the run-in, m.
    pub fn first(&self) -> f32 {
        self.first
    }

    /// Distance of the end of the run-out, m.
    pub fn last(&self) -> f32 {
        self.first + (self.count.saturating_sub(1)) as f32 * self.spacing
    }

    /// Length of the seam, m.
    pub fn length(&self) -> f32 {
        self.length
    }

    /// The two stations around `s` and the fraction between them; `s` outside the path gives its nearest end.
    fn around(&self, s: f32) -> (&Station, &Station, f32) {
        let last = self.count.saturating_sub(2) as f32;
        let position = ((s - self.first) * self.per_metre).max(0.0).min(last + 1.0);
        let index = position.min(last) as usize;
        let before = self.stations.get(index).unwrap_or(&self.stations[0]);
        let after = self.stations.get(index + 1).unwrap_or(&self.stations[0]);
        (before, after, position - index as f32)
    }

    /// Square of the highest allowed speed at `s`, m²/s².
    pub fn speed_squared(&self, s: f32) -> f32 {
        let (a, b, u) = self.around(s);
        a.speed_squared + (b.speed_squared - a.speed_squared) * u
    }

    /// The place at distance `s`: cubic Hermite in position, linear and renormalised in direction.
    pub fn place(&self, s: f32) -> Place {
        let (a, b, u) = self.around(s);
        Place {
            point: self.between(a, b, u),
            tangent: direction(mix(a.tangent, b.tangent, u)),
            normal: direction(mix(a.normal, b.normal, u)),
            heading: mix(a.heading, b.heading, u),
        }
    }

    /// The place nearest to `point` (Σ_B, m), searched from the distance `s`, and its distance; past an end it is the end's tangent that counts.
    pub fn project(&self, point: &Vector3<f32>, mut s: f32) -> (f32, Place) {
        for _ in 0..PROJECTION_STEPS {
            // Of the places on the way only point and tangent are wanted.
            let (a, b, u) = self.around(s);
            s += mix(a.tangent, b.tangent, u).dot(&(point - self.between(a, b, u)));
        }
        (s, self.place(s))
    }

    /// Position at `s`, m, and direction of travel there, of nearly unit length.
    #[inline(never)] // wanted in several places, none of them in a hurry
    pub fn course(&self, s: f32) -> (Vector3<f32>, Vector3<f32>) {
        let (a, b, u) = self.around(s);
        (self.between(a, b, u), mix(a.tangent, b.tangent, u))
    }

    /// Cubic Hermite between two stations.
    fn between(&self, a: &Station, b: &Station, u: f32) -> Vector3<f32> {
        let (pa, pb) = (Vector3::from(a.point), Vector3::from(b.point));
        let (ta, tb) = (Vector3::from(a.tangent), Vector3::from(b.tangent));
        let (u2, u3) = (u * u, u * u * u);
        let rise = 3.0 * u2 - 2.0 * u3;
        pa + (pb - pa) * rise + (ta * (u3 - 2.0 * u2 + u) + tb * (u3 - u2)) * self.spacing
    }

    /// Position at `s`, straight on past the end.
    fn place_extended(&self, s: f32) -> Vector3<f32> {
        let place = self.place(s);
        place.point + place.tangent * (s - self.last()).max(0.0)
    }
}

impl Place {
    /// Nozzle pose on this place moved by `lateral` and `height` (m, along the lateral and the normal) and rolled by `roll` (rad, about the
    /// tangent, small): T_b_n.
    pub fn nozzle(&self, lateral: f32, height: f32, roll: f32) -> Pose {
        let side = self.lateral();
        // First order and renormalised: rolls are a few degrees.
        let normal = direction(self.normal - side * roll);
        let x = direction(self.heading - normal * self.heading.dot(&normal));
        let y = normal.cross(&x);
        Pose {
            r: Matrix3::from_columns(&[x, y, normal]),
            p: self.point + side * lateral + self.normal * height,
        }
    }
}

/// Linear between two vectors.
fn mix(x: [f32; 3], y: [f32; 3], u: f32) -> Vector3<f32> {
    Vector3::from(x) + (Vector3::from(y) - Vector3::from(x)) * u
}

/// `v` at length one; zero stays zero.
///
/// Mixed from two neighbouring directions it is nearly that already, and Newton's method for 1/√x from its tangent at 1 is a sixth of the
/// cost of a root: within 45° between the two its third step is off by less than 2e-7.
fn direction(v: Vector3<f32>) -> Vector3<f32> {
    let square = v.dot(&v);
    if square > 0.85 && square < 1.2 {
        let half = 0.5 * square;
        let mut root = 1.5 - half;
        root *= 1.5 - half * root * root;
        root *= 1.5 - half * root * root;
        v * root
    } else {
        unit(&v).unwrap_or(v)
    }
}

#[cfg(test)]
pub(super) mod tests {
    extern crate std;
    use super::*;
    use crate::geometry::rotation::length;
    use crate::geometry::trig::sin_cos;

    pub(in crate::job) const TRAVEL: Travel = Travel {
        speed: 0.3,
        acceleration: 2.0,
        centripetal: 3.0,
        turn_rate: 3.0,
        lead: 0.080,
    };

    /// Half circle of R150 to the left, in the plane z = 0.
    pub(super) fn arc(s: f32) -> ([f32; 3], [f32; 3], [f32; 3]) {
        let (sin, cos) = sin_cos(s / 0.150);
        (
            [0.150 * sin, 0.150 * (1.0 - cos), 0.0],
            [cos, sin, 0.0],
            [0.0, 0.0, 1.0],
        )
    }

    /// A corner of 15° at s = 0.1 m.
    pub(super) fn corner(s: f32) -> ([f32; 3], [f32; 3], [f32; 3]) {
        let (sin, cos) = sin_cos(15f32.to_radians());
        let past = (s - 0.1).max(0.0);
        let tangent = if s < 0.1 { [1.0, 0.0, 0.0] } else { [cos, sin, 0.0] };
        ([s.min(0.1) + past * cos, past * sin, 0.0], tangent, [0.0, 0.0, 1.0])
    }

    /// A bend by `degrees` to the left with `radius` (m), from s = 0.2 m on.
    pub(super) fn bent(degrees: f32, radius: f32) -> impl FnMut(f32) -> ([f32; 3], [f32; 3], [f32; 3]) {
        let (turn, way) = (degrees.to_radians().abs(), degrees.signum());
        move |s| {
            let angle = ((s - 0.2) / radius).max(0.0).min(turn);
            let (sin, cos) = sin_cos(angle);
            let past = (s - 0.2 - radius * turn).max(0.0);
            let (x, y) = (
                s.min(0.2) + radius * sin + past * cos,
                radius * (1.0 - cos) + past * sin,
            );
            ([x, way * y, 0.0], [cos, way * sin, 0.0], [0.0, 0.0, 1.0])
        }
    }

    #[test]
    fn a_bend_of_5_mm_is_met_to_five_hundredths_of_a_millimetre() {
        let path = TaughtPath::new(0.4, &TRAVEL, bent(90.0, 0.005)).unwrap();
        for step in 0..800 {
            let s = step as f32 * 5e-4;
            let error = length(&(path.place(s).point - Vector3::from(bent(90.0, 0.005)(s).0)));
            assert!(error < 5e-5, "{error} m at {s}");
        }
    }

    #[test]
    fn between_stations_an_arc_is_met_within_a_micrometre() {
        let path = TaughtPath::new(0.45, &TRAVEL, arc).unwrap();
        for step in 0..450 {
            let s = step as f32 * 1e-3;
            let error = length(&(path.place(s).point - Vector3::from(arc(s).0)));
            assert!(error < 1e-6, "{error} m at {s}");
        }
    }

    #[test]
    fn on_an_arc_the_sensor_stands_over_the_path_ahead() {
        let path = TaughtPath::new(0.45, &TRAVEL, arc).unwrap();
        for step in 0..70 {
            let place = path.place(step as f32 * 5e-3);
            let sensor = place.point + place.heading * TRAVEL.lead;
            let radius = length(&(sensor - Vector3::new(0.0, 0.150, 0.0)));
            assert!((radius - 0.150).abs() < 1.5e-3, "sensor {radius} m from the centre");
            let turned = place.heading.dot(&place.lateral());
            let middle = (0.05..0.30).contains(&(step as f32 * 5e-3));
            assert!(
                !middle || (turned - 0.080 / 0.300).abs() < 2e-3,
                "sine of the heading: lead / 2R, is {turned}"
            );
        }
    }

    #[test]
    fn a_corner_is_rounded_by_less_than_the_stated_amount() {
        let path = TaughtPath::new(0.2, &TRAVEL, corner).unwrap();
        for step in 0..200 {
            let s = step as f32 * 1e-3;
            let error = length(&(path.place(s).point - Vector3::from(corner(s).0)));
            assert!(error < 2e-4, "{error} m at {s}");
        }
    }

    #[test]
    fn too_long_and_too_short_are_refused() {
        let Some(PathError::TooLong(longest)) = TaughtPath::new(3.0, &TRAVEL, arc).err() else {
            panic!("3 m were accepted");
        };
        assert!((2.4..2.5).contains(&longest), "{longest} m");
        assert!(TaughtPath::new(longest, &TRAVEL, arc).is_ok());
        assert_eq!(TaughtPath::new(0.005, &TRAVEL, arc).err(), Some(PathError::TooShort));
    }
}
