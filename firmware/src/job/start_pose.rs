//! The start pose in six degrees of freedom, from a grey image of the seam's end and light sections of the sheet beside it (paper 003, 5.4).
//!
//! In: what the camera saw ([`Sighting`]s of `StartGrey` and `StartSlit`), each with the sensor's pose at its exposure. Out: the part's
//! start frame in Σ_B, with its origin in the seam's end corner on the sheet that carries the seam, x along the seam and z out of the sheet;
//! or a numbered refusal. Where the arm goes to take the images is the job's business.
//!
//! Not the paper's (5.10)–(5.15), which take the height where the slit crosses the seam for the corner's, and small angles; but, exactly:
//! the sheet is the plane through the lit points and along the lit lines; the corner is where the grey image's ray meets it; the seam is
//! where the plane through the camera and the grey image's line meets it. Every lit point must then lie on that seam, which no wrong one does.

use crate::geometry::Pose;
use crate::geometry::rotation::{length, rot_z, unit};
use crate::geometry::trig::{asin, atan2, sin_cos};
use crate::job::correction::SensorMount;
use crate::job::path::Place;
use crate::job::seal::StartPose;
use crate::vision::camera::line_direction;
use hal::process::{Look, Sighting};
use nalgebra::{Matrix3, Vector3};

/// Light sections in a view of the start: two give the attitude, but sheets are wavy, and four over 36 mm halve what one wave does to it.
pub const SLITS: usize = 4;

/// Shortest distance between the outer light sections, m: the sheet's pitch is known to their noise (0.05 mm) over this.
pub const BASE_MIN: f32 = 0.008;

/// Distance that a lit point may lie off the seam line of the grey image, m: half a sheet's thickness, four standard deviations of a sighting
/// across the seam.
const OFF_SEAM: f32 = 0.3e-3;

/// And by this much more per square of its distance from the corner, 1/m: half the curvature of a seam bent by 2 mm over 250 mm.
const BEND: f32 = 0.6;

/// Distance that a lit point may lie off the common plane, m: a dent of 0.25 mm and a bent sheet.
const OFF_PLANE: f32 = 0.5e-3;

/// Angle that a lit line may lean out of the common plane, rad: 3°, the slope of a dent under a light section.
const LEANING: f32 = 0.052;

/// Distance at which a lit line's direction counts as a point would, m: the standard deviation of rows over a lit half of the view.
const LEVER: f32 = 0.007;

/// Standard deviation of a lit point's height, m; and of the sheet's slope against its plane over a few millimetres (undulation), m/m. They say how
/// much nearer sections count for more in the height of the corner.
const HEIGHT_SIGMA: f32 = 0.03e-3;
const SLOPE_SIGMA: f32 = 12e-3;

/// Standard deviations of the seam's place (m) and direction (rad) in a grey image: of an edge, and of the line that a bend's bottom is; and of a
/// lit point across the seam, m.
const EDGE_SIGMAS: [f32; 2] = [0.06e-3, 0.4e-3];
const LINE_SIGMAS: [f32; 2] = [0.03e-3, 1.0e-3];
const ASIDE_SIGMA: f32 = 0.12e-3;

/// Least cosine between the ray and the sheet's normal: at 60° the corner's position is twice as uncertain as the image's.
const FLATNESS: f32 = 0.5;

/// Farthest apart that two measurements of the same part may put its start, m and rad, to be believed: the accuracy asked for.
pub const AGREEMENT: f32 = 0.15e-3;
/// See [`AGREEMENT`].
pub const AGREEMENT_ANGLE: f32 = 0.3 * core::f32::consts::PI / 180.0;

/// Why there is no start pose. The numbers are for logs and telemetry; 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum StartRefusal {
    /// The camera refused an image; its own number came with the sighting.
    Unseen = 1,
    /// There is no grey image, or fewer than two light sections.
    Incomplete = 2,
    /// More light sections than there is room for.
    TooMany = 3,
    /// The light sections lie too near to each other for a pitch.
    TooNear = 4,
    /// A light section's seam point does not lie on the grey image's seam.
    OffSeam = 5,
    /// The light sections do not lie in one plane.
    Uneven = 6,
    /// The sheet is seen at too flat an angle.
    TooFlat = 7,
    /// Two measurements in succession differ by more than [`AGREEMENT`].
    Unsteady = 8,
}

/// What the grey image showed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grey {
    t_b_s: Pose,
    /// Where the corner's ray meets z = 0 of Σ_S, m.
    corner: [f32; 2],
    /// Direction of the seam in the image, from +x_S toward +y_S, rad.
    direction: f32,
}

/// A light section's seam point and direction, in Σ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    point: Vector3<f32>,
    across: Vector3<f32>,
}

/// The part's start, as measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartFrame {
    /// The start frame in Σ_B: origin in the end corner on the seam's sheet, x along the seam, z out of the sheet.
    pub pose: Pose,
    /// Largest distance of a lit point from the grey image's seam, m.
    pub off_seam: f32,
    /// Largest distance of a lit point from the common plane, m.
    pub off_plane: f32,
}

/// The images of one measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct StartLooks {
    grey: Option<Grey>,
    sections: heapless::Vec<Section, SLITS>,
}

impl Default for StartLooks {
    fn default() -> Self {
        Self::new()
    }
}

impl StartLooks {
    /// None yet.
    pub const fn new() -> Self {
        Self {
            grey: None,
            sections: heapless::Vec::new(),
        }
    }

    /// Takes in a sighting with the sensor's pose at its exposure. A second grey image replaces the first; other looks change nothing.
    pub fn take(&mut self, sighting: &Sighting, mount: &SensorMount, t_b_s: &Pose) -> Result<(), StartRefusal> {
        if sighting.refusal != 0 {
            return Err(StartRefusal::Unseen);
        }
        let [x, y, z] = sighting.point();
        let angle = sighting.angle();
        match sighting.look {
            Look::StartGrey => {
                self.grey = Some(Grey {
                    t_b_s: *t_b_s,
                    corner: [x, y],
                    direction: angle,
                });
                Ok(())
            }
            Look::StartSlit => {
                // The foot of an edge lies below the edge's light; the line's direction is that of the lit sheet beside it.
                let [tan_slit, lean] = mount.slit_slopes;
                let lit = Vector3::new(-z * tan_slit - y * lean, y, z);
                let (sin, cos) = sin_cos(angle);
                let across = line_direction(&lit, sin / cos, mount.camera_height, mount.slit_slopes);
                let section = Section {
                    point: *t_b_s * Vector3::new(x, y, z),
                    across: unit(&(t_b_s.r * across)).ok_or(StartRefusal::TooFlat)?,
                };
                self.sections.push(section).map_err(|_| StartRefusal::TooMany)
            }
            Look::Dark | Look::Seam => Ok(()),
        }
    }

    /// Light sections taken in.
    pub fn sections(&self) -> usize {
        self.sections.len()
    }

    /// The seam as the grey image shows it, taken to lie in the plane z = 0 of its Σ_S: origin in the corner, x along the seam, Σ_B. Where to
    /// hold the sensor for a light section.
    pub fn aim(&self) -> Option<Pose> {
        let grey = self.grey.as_ref()?;
        let [x, y] = grey.corner;
        let on_ground = Pose {
            r: rot_z(grey.direction),
            p: Vector3::new(x, y, 0.0),
        };
        Some(grey.t_b_s * on_ground)
    }

    /// The start frame. `edge_height` (m) is the height over the seam's sheet of the edge that the grey image shows: the upper sheet's
    /// thickness for a lap joint, whose edge is seen from above, zero where the seam itself is seen; of a `bend` it is a faint line.
    pub fn frame(&self, mount: &SensorMount, edge_height: f32, bend: bool) -> Result<StartFrame, StartRefusal> {
        let grey = self.grey.as_ref().ok_or(StartRefusal::Incomplete)?;
        let view = Viewing::of(grey, mount.camera_height)?;
        let (normal, middle) = plane(&self.sections, &grey.t_b_s.r.column(2).into_owned())?;
        // All that follows is on the plane of the visible edge, parallel to the sheet's.
        let down = -view.ray.dot(&normal);
        if !beyond(down, FLATNESS) {
            return Err(StartRefusal::TooFlat);
        }
        let lift = normal * edge_height;
        let meet =
            |height: f32| view.centre + view.ray * ((view.centre - middle - lift).dot(&normal) - height) * (1.0 / down);
        let along = unit(&view.side.cross(&normal)).ok_or(StartRefusal::TooFlat)?;
        // Near sections say more of the corner's height than far ones.
        let corner = meet(0.0);
        let (mut sum, mut weights) = (0.0_f32, 0.0_f32);
        let (mut off_plane, mut off_seam) = (0.0_f32, 0.0_f32);
        let known = if bend { LINE_SIGMAS } else { EDGE_SIGMAS };
        let mut line = Seen::as_known(known);
        for section in &self.sections {
            let height = (section.point - middle).dot(&normal);
            let ahead = (section.point + lift - corner).dot(&along);
            let slope = SLOPE_SIGMA * ahead;
            let weight = 1.0 / (HEIGHT_SIGMA * HEIGHT_SIGMA + slope * slope);
            sum += weight * height;
            weights += weight;
            let aside = (section.point + lift - view.centre).dot(&view.side);
            line.add(ahead, aside);
            if !within(aside, OFF_SEAM + BEND * ahead * ahead) {
                return Err(StartRefusal::OffSeam);
            }
            check_even(section, height, &normal)?;
            off_plane = off_plane.max(height.abs());
            off_seam = off_seam.max(aside.abs());
        }
        // The sections, too, say where the seam lies and which way it runs from its corner.
        let (shift, turn) = line.aside();
        let left = normal.cross(&along);
        let along = unit(&(along + left * turn)).ok_or(StartRefusal::TooFlat)?;
        let pose = Pose {
            r: Matrix3::from_columns(&[along, normal.cross(&along), normal]),
            p: meet(sum / weights) - lift + left * shift,
        };
        Ok(StartFrame {
            pose,
            off_seam,
            off_plane,
        })
    }
}

/// The straight line that the lit points lie on, beside the grey image's: shift and turn by least squares, with how well those are known.
struct Seen {
    normal: [f32; 3],
    right: [f32; 2],
}

impl Seen {
    fn as_known([place, direction]: [f32; 2]) -> Self {
        let weight = |sigma: f32| (ASIDE_SIGMA / sigma) * (ASIDE_SIGMA / sigma);
        Self {
            normal: [weight(place), 0.0, weight(direction)],
            right: [0.0; 2],
        }
    }

    /// A lit point `ahead` (m) of the corner and `aside` (m) of the line.
    fn add(&mut self, ahead: f32, aside: f32) {
        let [ones, firsts, seconds] = &mut self.normal;
        let [zeroth, first] = &mut self.right;
        *ones += 1.0;
        *firsts += ahead;
        *seconds += ahead * ahead;
        *zeroth += aside;
        *first += ahead * aside;
    }

    /// By how much (m) the line lies to the left at the corner, and turns to the left, rad.
    fn aside(&self) -> (f32, f32) {
        let ([n, a, aa], [s, sa]) = (self.normal, self.right);
        let determinant = n * aa - a * a;
        ((aa * s - a * sa) / determinant, (n * sa - a * s) / determinant)
    }
}

/// A section lies in the plane with all others, `height` (m) off it.
fn check_even(section: &Section, height: f32, normal: &Vector3<f32>) -> Result<(), StartRefusal> {
    if within(height, OFF_PLANE) && within(section.across.dot(normal), LEANING) {
        Ok(())
    } else {
        Err(StartRefusal::Uneven)
    }
}

/// Neither comparison holds for what is no number: it is refused.
fn within(value: f32, reach: f32) -> bool {
    value.abs() <= reach
}

fn beyond(value: f32, least: f32) -> bool {
    value >= least
}

/// The grey image's ray and the plane in which its seam line is seen, in Σ_B.
struct Viewing {
    /// The camera's centre, m.
    centre: Vector3<f32>,
    /// Unit vector from it to the corner.
    ray: Vector3<f32>,
    /// Unit normal of the plane that holds camera and seam, to the left of the seam.
    side: Vector3<f32>,
}

impl Viewing {
    fn of(grey: &Grey, camera_height: f32) -> Result<Self, StartRefusal> {
        let [x, y] = grey.corner;
        let (sin, cos) = sin_cos(grey.direction);
        let ray = Vector3::new(x, y, -camera_height);
        let side = Vector3::new(cos, sin, 0.0).cross(&ray);
        Ok(Self {
            centre: grey.t_b_s * Vector3::new(0.0, 0.0, camera_height),
            ray: unit(&(grey.t_b_s.r * ray)).ok_or(StartRefusal::TooFlat)?,
            side: unit(&(grey.t_b_s.r * side)).ok_or(StartRefusal::TooFlat)?,
        })
    }
}

/// Unit normal (on `toward`'s side) and middle of the plane that fits the sections' points and directions best.
fn plane(sections: &[Section], toward: &Vector3<f32>) -> Result<(Vector3<f32>, Vector3<f32>), StartRefusal> {
    let [first, .., last] = sections else {
        return Err(StartRefusal::Incomplete);
    };
    let base = last.point - first.point;
    if !beyond(length(&base), BASE_MIN) {
        return Err(StartRefusal::TooNear);
    }
    let zero = Vector3::zeros();
    let share = 1.0 / sections.len() as f32;
    let middle = sections.iter().fold(zero, |sum, section| sum + section.point) * share;
    let across = sections.iter().fold(zero, |sum, section| sum + section.across);
    let flat = |v: Vector3<f32>| unit(&v).ok_or(StartRefusal::TooFlat);
    let rough = flat(base.cross(&across))?;
    let rough = if rough.dot(toward) < 0.0 { -rough } else { rough };
    // n = rough + a·e + b·f: squares of (P − middle)·n and of LEVER·D·n, each linear in a and b, are least in sum.
    let e = flat(base)?;
    let f = rough.cross(&e);
    let (mut ee, mut ef, mut ff, mut er, mut fr) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
    for section in sections {
        for row in [section.point - middle, section.across * LEVER] {
            let (x, y, rest) = (row.dot(&e), row.dot(&f), row.dot(&rough));
            ee += x * x;
            ef += x * y;
            ff += y * y;
            er += x * rest;
            fr += y * rest;
        }
    }
    let determinant = ee * ff - ef * ef;
    // Lit lines that run along the seam span no plane: their angle's sine is below 0.1.
    if !beyond(determinant, 0.01 * ee * ff) {
        return Err(StartRefusal::TooFlat);
    }
    let a = (ef * fr - ff * er) / determinant;
    let b = (ef * er - ee * fr) / determinant;
    Ok((flat(rough + e * a + f * b)?, middle))
}

impl StartFrame {
    /// Whether `other`, measured after it, says the same within [`AGREEMENT`].
    #[inline(never)] // in no hurry, as whatever is done at rest
    pub fn agrees(&self, other: &Self) -> bool {
        // Chords of the axes' turns: a degree's chord differs from its arc by 1e-5 of it.
        let turn = |axis: usize| length(&(self.pose.r.column(axis) - other.pose.r.column(axis)));
        self.is_at(other) && turn(0).max(turn(2)) <= AGREEMENT_ANGLE
    }

    /// Whether at least the place is the same within [`AGREEMENT`].
    pub fn is_at(&self, other: &Self) -> bool {
        length(&(self.pose.p - other.pose.p)) <= AGREEMENT
    }

    /// What lies half-way between two that agree: the noise of both is less in it.
    #[inline(never)]
    pub fn mean(&self, other: &Self) -> Self {
        let axis = |axis: usize| self.pose.r.column(axis) + other.pose.r.column(axis);
        let (along, left) = (axis(0), axis(1));
        let axes = unit(&along).zip(unit(&along.cross(&left)));
        Self {
            pose: Pose {
                // Two that agree are never opposite.
                r: axes.map_or(other.pose.r, |(x, z)| Matrix3::from_columns(&[x, z.cross(&x), z])),
                p: (self.pose.p + other.pose.p) * 0.5,
            },
            off_seam: self.off_seam.max(other.off_seam),
            off_plane: self.off_plane.max(other.off_plane),
        }
    }

    /// The rigid motion, in Σ_B, from the part as taught to the part as it lies; `taught` is the place of the corner on the taught path.
    pub fn motion(&self, taught: &Place) -> Pose {
        let left = taught.lateral();
        let t_b_taught = Pose {
            r: Matrix3::from_columns(&[left.cross(&taught.normal), left, taught.normal]),
            p: taught.point,
        };
        self.pose * t_b_taught.inverse()
    }
}

impl StartPose {
    /// The six numbers of a rigid motion of the part in Σ_B, as a start sensor measures them from the taught nozzle pose `t_b_n0`: what
    /// [`StartPose::motion`] undoes.
    pub fn of_motion(motion: &Pose, t_b_n0: &Pose) -> Self {
        let seen = t_b_n0.inverse() * *motion * *t_b_n0;
        let y = asin(seen.r.m13);
        let (_, cos_y) = sin_cos(y);
        Self {
            shift: seen.p.into(),
            tilt: [
                atan2(-seen.r.m23, seen.r.m33),
                y,
                atan2(-seen.r.m12, seen.r.m11 * cos_y),
            ],
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::rotation::{log, product, rot_x, rot_y};
    use hal::wire::Wire;
    use proptest::prelude::*;

    pub const MOUNT: SensorMount = SensorMount {
        pose: Pose::EMPTY,
        camera_height: 0.150,
        slit_slopes: [1.0, 0.0],
        seam_slopes: [[1.0, 0.0]; 2],
    };
    pub const SHEET: f32 = 0.0006;

    fn um(v: Vector3<f32>) -> [i16; 3] {
        [v.x, v.y, v.z].map(|m| (m * 1e6).round() as i16)
    }

    /// What an exact camera at `t_b_s` says of the corner of a part at `frame`.
    pub fn grey(frame: &Pose, t_b_s: &Pose) -> Sighting {
        let to_s = t_b_s.inverse() * *frame;
        let on_ground = |along: f32| {
            let p = to_s * Vector3::new(along, 0.0, SHEET);
            p * (0.150 / (0.150 - p.z))
        };
        let (corner, ahead) = (on_ground(0.0), on_ground(0.010));
        Sighting {
            look: Look::StartGrey,
            point_um: um(Vector3::new(corner.x, corner.y, 0.0)),
            angle_e4: (1e4 * (ahead.y - corner.y).atan2(ahead.x - corner.x)).round() as i16,
            ..Sighting::default()
        }
    }

    /// What an exact slit says there, or `None` where it misses the seam.
    pub fn slit(frame: &Pose, t_b_s: &Pose) -> Option<Sighting> {
        let to_s = t_b_s.inverse() * *frame;
        let before = |p: Vector3<f32>| p.x + p.z; // the slit plane is x = −z
        let edge = |along: f32| to_s * Vector3::new(along, 0.0, SHEET);
        let along = before(edge(0.0)) / (before(edge(0.0)) - before(edge(1.0)));
        let foot = to_s * Vector3::new(along, 0.0, 0.0);
        // Two points of the lower sheet in the slit's light, and where they appear.
        let pixel = |left: f32| {
            let at = |along: f32| to_s * Vector3::new(along, left, 0.0);
            let along = before(at(0.0)) / (before(at(0.0)) - before(at(1.0)));
            let p = at(along);
            p * (0.150 / (0.150 - p.z))
        };
        let (left, right) = (pixel(0.010), pixel(-0.010));
        (along > 0.0).then(|| Sighting {
            look: Look::StartSlit,
            point_um: um(foot),
            angle_e4: (1e4 * (-(left.x - right.x) / (left.y - right.y)).atan()).round() as i16,
            ..Sighting::default()
        })
    }

    fn ahead(t_b_s: &Pose, by: f32) -> Pose {
        Pose {
            p: t_b_s.p + t_b_s.r.column(0) * by,
            ..*t_b_s
        }
    }

    fn looks(frame: &Pose, t_b_s: &Pose, advances: &[f32]) -> StartLooks {
        let mut looks = StartLooks::new();
        looks.take(&grey(frame, t_b_s), &MOUNT, t_b_s).unwrap();
        for &by in advances {
            let t_b_s = ahead(t_b_s, by);
            looks.take(&slit(frame, &t_b_s).unwrap(), &MOUNT, &t_b_s).unwrap();
        }
        looks
    }

    fn part(shift: [f32; 3], tilt: [f32; 3]) -> (Pose, Pose) {
        let sensor = Pose {
            r: rot_y(0.35) * rot_z(-1.57),
            p: Vector3::new(0.55, 0.2, 0.1),
        };
        let off = Pose {
            r: rot_x(tilt[0]) * rot_y(tilt[1]) * rot_z(tilt[2]),
            p: Vector3::from(shift),
        };
        (sensor * off, sensor)
    }

    fn apart(a: &Pose, b: &Pose) -> (f32, f32) {
        (length(&(a.p - b.p)), length(&log(&product(&a.r, &b.r.transpose()))))
    }

    proptest! {
        #[test]
        fn a_part_within_20_mm_and_5_degrees_is_found_exactly(
            shift in prop::array::uniform3(-0.020f32..0.020), tilt in prop::array::uniform3(-0.087f32..0.087),
        ) {
            let (frame, sensor) = part(shift, tilt);
            let found = looks(&frame, &sensor, &[0.050, 0.075]).frame(&MOUNT, SHEET, false).unwrap();
            let (shift, turn) = apart(&found.pose, &frame);
            // A sighting is rounded to 1 µm and 0.1 mrad: the corner lies up to 70 mm outside the sections, whose pitch is off by 1 µm in 25 mm.
            prop_assert!(shift < 12e-6 && turn < 1.5e-4, "{shift} m, {turn} rad");
        }

        #[test]
        fn measured_again_from_near_by_it_is_found_to_the_bus_resolution(
            shift in prop::array::uniform3(-0.001f32..0.001), tilt in prop::array::uniform3(-0.01f32..0.01),
        ) {
            let (frame, sensor) = part(shift, tilt);
            let found = looks(&frame, &sensor, &[0.005, 0.020, 0.035]).frame(&MOUNT, SHEET, false).unwrap();
            let (shift, turn) = apart(&found.pose, &frame);
            prop_assert!(shift < 3e-6 && turn < 1.2e-4, "{shift} m, {turn} rad");
        }

        #[test]
        fn six_numbers_of_a_motion_give_the_motion_back(
            shift in prop::array::uniform3(-0.020f32..0.020), tilt in prop::array::uniform3(-0.3f32..0.3),
        ) {
            let (frame, taught) = part(shift, tilt);
            let motion = frame * taught.inverse();
            let back = StartPose::of_motion(&motion, &taught).motion(&taught);
            let (shift, turn) = apart(&back, &motion);
            prop_assert!(shift < 1e-6 && turn < 2e-6, "{shift} m, {turn} rad");
        }
    }

    #[test]
    fn the_motion_takes_the_taught_corner_to_the_measured_one() {
        let (frame, sensor) = part([0.004, -0.006, 0.002], [0.02, -0.03, 0.05]);
        let found = looks(&frame, &sensor, &[0.010, 0.030])
            .frame(&MOUNT, SHEET, false)
            .unwrap();
        let place = Place {
            point: sensor.p,
            tangent: sensor.r.column(0).into(),
            normal: sensor.r.column(2).into(),
            heading: sensor.r.column(1).into(),
        };
        let motion = found.motion(&place);
        let (shift, turn) = apart(&(motion * sensor), &frame);
        assert!(shift < 5e-6 && turn < 2e-4, "{shift} m, {turn} rad");
    }

    #[test]
    fn what_is_missing_or_contradicts_itself_is_refused_by_its_number() {
        let (frame, sensor) = part([0.001, -0.001, 0.001], [0.0; 3]);
        let good = looks(&frame, &sensor, &[0.005, 0.020]);
        let mut changed = good.clone();
        changed.grey = None;
        assert_eq!(changed.frame(&MOUNT, SHEET, false), Err(StartRefusal::Incomplete));
        let near = looks(&frame, &sensor, &[0.005, 0.011]);
        assert_eq!(near.frame(&MOUNT, SHEET, false), Err(StartRefusal::TooNear));
        // A seam point half a millimetre beside the seam.
        let mut changed = good.clone();
        changed.sections[0].point += frame.r.column(1) * 0.0005;
        assert_eq!(changed.frame(&MOUNT, SHEET, false), Err(StartRefusal::OffSeam));
        // A section that leans 8° against the other.
        let mut changed = good.clone();
        changed.sections[1].across += frame.r.column(2) * 0.14;
        assert_eq!(changed.frame(&MOUNT, SHEET, false), Err(StartRefusal::Uneven));
        // A ghost: the line of a third section lies 2 mm too high.
        let mut changed = looks(&frame, &sensor, &[0.005, 0.020, 0.035]);
        changed.sections[1].point += frame.r.column(2) * 0.002;
        assert_eq!(changed.frame(&MOUNT, SHEET, false), Err(StartRefusal::Uneven));
        let mut changed = good.clone();
        changed.sections[1].point.x = f32::NAN;
        assert!(changed.frame(&MOUNT, SHEET, false).is_err());
        let refused = Sighting {
            look: Look::StartGrey,
            refusal: 3,
            ..Sighting::default()
        };
        assert_eq!(changed.take(&refused, &MOUNT, &sensor), Err(StartRefusal::Unseen));
        let more = slit(&frame, &ahead(&sensor, 0.030)).unwrap();
        let mut full = looks(&frame, &sensor, &[0.005, 0.010, 0.015, 0.020]);
        assert_eq!(full.take(&more, &MOUNT, &sensor), Err(StartRefusal::TooMany));
    }

    #[test]
    fn two_measurements_agree_within_the_accuracy_asked_for_and_no_further() {
        let (frame, sensor) = part([0.0; 3], [0.0; 3]);
        let one = looks(&frame, &sensor, &[0.005, 0.020])
            .frame(&MOUNT, SHEET, false)
            .unwrap();
        let moved = |shift: f32, turn: f32| StartFrame {
            pose: Pose {
                r: product(&rot_x(turn), &one.pose.r),
                p: one.pose.p + Vector3::new(0.0, shift, 0.0),
            },
            ..one
        };
        assert!(one.agrees(&moved(1.4e-4, 0.0)) && one.agrees(&moved(0.0, 0.005)));
        assert!(!one.agrees(&moved(1.6e-4, 0.0)) && !one.agrees(&moved(0.0, 0.0055)));
    }

    /// The paper's formulas, as corrected in sealing.md: (5.10)–(5.13), with the height of the slit's point for the corner's, (5.14), (5.15). In
    /// Σ_S as this code has it (z toward the camera, y left) instead of the paper's (z into the work, y down): z, y, θ_y and θ_z change sign.
    #[test]
    fn the_papers_formulas_agree_for_small_deviations_and_are_off_by_what_is_known_for_larger() {
        let printed = |shift: [f32; 3], tilt: [f32; 3]| {
            let (frame, sensor) = part(shift, tilt);
            let corner = grey(&frame, &sensor).point();
            let section = |by: f32| slit(&frame, &ahead(&sensor, by)).unwrap();
            let (near, far) = (section(0.008), section(0.028));
            let (p, q) = (near.point(), far.point());
            let s = 0.020;
            let along = q[0] + s - p[0];
            let roll = near.angle().tan().atan();
            let pitch = -((q[2] - p[2]) / along).atan();
            let yaw = ((q[1] - p[1]) / along).atan();
            ([corner[0], corner[1], p[2]], [roll, pitch, yaw])
        };
        let off = |shift: [f32; 3], tilt: [f32; 3]| {
            let (p, r) = printed(shift, tilt);
            let most = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
            (most(p, shift), most(r, tilt))
        };
        let (shift, turn) = off([0.0005, -0.0005, 0.0002], [0.002, -0.003, 0.003]);
        assert!(shift < 6e-5 && turn < 2e-4, "{shift} m, {turn} rad");
        // 2 mm of height and 3° of pitch: the height is the slit point's, 8 mm on, not the corner's.
        let (shift, _) = off([0.0, 0.0, 0.002], [0.0, 0.052, 0.0]);
        assert!(shift > 0.25e-3, "{shift} m");
    }
}
