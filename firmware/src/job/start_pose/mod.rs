//! The start pose in six degrees of freedom, from a grey image of the seam's end and light sections of the sheet beside it (paper 003, 5.4).
//!
//! In: what the camera saw ([`Sighting`]s of `StartGrey` and `StartSlit`), each with the sensor's pose at its exposure. Out: the part's
//! start frame in Σ_B, with its origin in the seam's end corner on the sheet that carries the seam, x along the seam and z out of the sheet;
//! or a numbered refusal. Where the arm goes to take the images is the job's business.
//!
//! Not the paper's (5.10)–(5.15), which take the height where the slit crosses the seam for the corner's, and small angles; but, exactly:
//! the sheet is the plane through the lit points and along the lit lines; the corner is where the grey image's ray meets it; the seam is
//! where the plane through the camera and the grey image's line meets it. Every lit point must then lie on that seam, which no wrong one does.

mod frame;
mod sheet;
mod straight;

use crate::geometry::Pose;
use crate::geometry::rotation::{rot_z, unit};
use crate::geometry::trig::{sin_cos, sqrt};
use crate::job::mount::SensorMount;
use crate::vision::camera::line_direction;
use crate::vision::start::corner::SURE_SLOPE;
pub use frame::{AGREEMENT, AGREEMENT_ANGLE, StartFrame};
use hal::process::{Look, Sighting};
use nalgebra::{Matrix3, Vector3};
use straight::Straight;

/// Light sections in a view of the start: two give the attitude, but sheets are wavy, and four over 36 mm halve what one wave does to it.
pub const SLITS: usize = 4;

/// Distance that a lit point may lie off the seam line of the grey image, m: half a sheet's thickness, four standard deviations of a sighting
/// across the seam.
const OFF_SEAM: f32 = 0.3e-3;

/// And by this much more per square of its distance from the corner, 1/m: half the curvature of a seam bent by 2 mm over 250 mm.
const BEND: f32 = 0.6;

/// Standard deviation of a lit point's height, m; of the slope with which the sheet leaves its plane at the corner, m/m: undulation and dents; and
/// how much that changes, 1/m: dents are a centimetre wide. Over 300 rendered harsh lap joints: 0.04 mm, 20e-3 and 1.7.
const HEIGHT_SIGMA: f32 = 0.04e-3;
const SLOPE_SIGMA: f32 = 20e-3;
const CHANGE_SIGMA: f32 = 1.7;

/// Standard deviation of a lit point across the seam, m. Moderate lap joints and lips have 0.05 to 0.06 mm, vees 0.09 mm, harsh lap joints 0.09 mm; more,
/// since the sections of one part err together by what it is bent.
const ASIDE_SIGMA: f32 = 0.12e-3;

/// Standard deviation of a place in a grey image of which none of its stretches tells, m: how an edge is lit all along. The seam's, and the end's.
const UNTOLD: [f32; 2] = [0.035e-3, 0.025e-3];
/// Standard deviations of those places, and of the seam's direction, against what the image states. With both, the errors over 300 rendered harsh lap
/// joints are one standard deviation, and over as many moderate ones, lap joints or vees, half to all of one.
const OF_STATED: [f32; 3] = [2.0, 1.5, 1.3];

/// Least cosine between the ray and the sheet's normal: at 60° the corner's position is twice as uncertain as the image's.
const FLATNESS: f32 = 0.5;

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
}

/// What the grey image showed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grey {
    t_b_s: Pose,
    /// Where the corner's ray meets z = 0 of Σ_S, m.
    corner: [f32; 2],
    /// Direction of the seam in the image, from +x_S toward +y_S, rad.
    direction: f32,
    /// Standard deviations of the corner, m, and of the direction, rad, as the image states them.
    sigmas: [f32; 2],
}

impl Grey {
    /// Variances of the seam's and the end's place, m², and of the seam's direction, rad².
    fn variances(&self) -> [f32; 3] {
        let ([place, direction], [seam, end]) = (self.sigmas, UNTOLD);
        let [of_seam, of_end, of_direction] = OF_STATED;
        let sum = |untold: f32, told: f32| untold * untold + told * told;
        [
            sum(seam, of_seam * place),
            sum(end, of_end * place),
            sum(0.0, of_direction * direction),
        ]
    }
}

/// A light section's seam point and direction, in Σ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    point: Vector3<f32>,
    across: Vector3<f32>,
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
                    sigmas: [
                        1e-6 * f32::from(sighting.sigma_um),
                        SURE_SLOPE * f32::from(Sighting::SURE) / f32::from(sighting.quality.max(1)),
                    ],
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

    /// The seam as the grey image shows it, taken to lie in the plane z = 0 of a Σ_S that is not rolled (its sine) as its own is: origin in the corner, x along
    /// the seam, Σ_B. Where to hold the sensor for a light section.
    #[inline(never)] // in no hurry
    pub fn aim(&self, roll: f32) -> Option<Pose> {
        let grey = self.grey.as_ref()?;
        let [x, y] = grey.corner;
        let on_ground = Pose {
            r: rot_z(grey.direction),
            p: Vector3::new(x, y, 0.0),
        };
        Some(rolled(&grey.t_b_s, -roll) * on_ground)
    }

    /// The start frame. `edge_height` (m) is the height over the seam's sheet of the edge that the grey image shows: the upper sheet's
    /// thickness for a lap joint, whose edge is seen from above, zero where the seam itself is seen.
    pub fn frame(&self, mount: &SensorMount, edge_height: f32) -> Result<StartFrame, StartRefusal> {
        let grey = self.grey.as_ref().ok_or(StartRefusal::Incomplete)?;
        let view = Viewing::of(grey, mount.camera_height)?;
        let (normal, middle) = sheet::plane(&self.sections, &grey.t_b_s.r.column(2).into_owned())?;
        // All that follows is on the plane of the visible edge, parallel to the sheet's.
        let down = -view.ray.dot(&normal);
        if !beyond(down, FLATNESS) {
            return Err(StartRefusal::TooFlat);
        }
        let lift = normal * edge_height;
        let meet =
            |height: f32| view.centre + view.ray * ((view.centre - middle - lift).dot(&normal) - height) * (1.0 / down);
        let along = unit(&view.side.cross(&normal)).ok_or(StartRefusal::TooFlat)?;
        let corner = meet(0.0);
        let [seam, end, direction] = grey.variances();
        let mut rise = Straight::known([f32::INFINITY, SLOPE_SIGMA * SLOPE_SIGMA]);
        let mut line = Straight::known([seam, direction]);
        for section in &self.sections {
            let height = (section.point - middle).dot(&normal);
            let ahead = (section.point + lift - corner).dot(&along);
            let change = CHANGE_SIGMA * ahead * ahead;
            rise.add(ahead, height, HEIGHT_SIGMA * HEIGHT_SIGMA + change * change);
            let aside = (section.point + lift - view.centre).dot(&view.side);
            line.add(ahead, aside, ASIDE_SIGMA * ASIDE_SIGMA);
            if !within(aside, OFF_SEAM + BEND * ahead * ahead) {
                return Err(StartRefusal::OffSeam);
            }
            sheet::check_even(section, height, &normal)?;
        }
        // The sections, too, say where the seam lies and which way it runs from its corner.
        let [shift, turn, turn_variance] = line.solve();
        let [rise, ..] = rise.solve();
        let left = normal.cross(&along);
        let along = unit(&(along + left * turn)).ok_or(StartRefusal::TooFlat)?;
        let pose = Pose {
            r: Matrix3::from_columns(&[along, normal.cross(&along), normal]),
            p: meet(rise) - lift + left * shift,
        };
        Ok(StartFrame {
            pose,
            variance: [end, turn_variance],
        })
    }
}

/// A pose rolled about its own x axis, by an angle within 90° of this sine.
#[inline(never)] // in no hurry
pub fn rolled(pose: &Pose, sin: f32) -> Pose {
    let cos = sqrt(1.0 - sin * sin);
    let [x, y, z] = [0, 1, 2].map(|axis| pose.r.column(axis).into_owned());
    Pose {
        r: Matrix3::from_columns(&[x, y * cos + z * sin, z * cos - y * sin]),
        ..*pose
    }
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

/// Neither comparison holds for what is no number: it is refused.
fn within(value: f32, reach: f32) -> bool {
    value.abs() <= reach
}

fn beyond(value: f32, least: f32) -> bool {
    value >= least
}

#[cfg(test)]
pub(super) mod tests;
