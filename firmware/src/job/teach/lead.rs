//! The default law: the nozzle on the seam that was seen, the sensor over the seam that is to be seen.
//!
//! The tool's x axis points from the nozzle to the seam a sensor's lead ahead, its z axis along the sheet's normal. Nothing is steered by what the
//! sensor measures of itself, so there is no loop that could lag: the points are in Σ_B, and the course is carried on past the newest by its own
//! direction and curvature. What is left is the step in the course at each new point; a tracker of value and rate takes it up smoothly and
//! follows a steady turn without error.

use super::seam::Seam;
use super::trail::Spot;
use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use nalgebra::{Matrix3, Vector3};

/// Share of the error that the value takes up in a cycle: settles in about 0.1 s; a step of 0.5 mm over the lead becomes 40 rad/s² at the wrist.
const TRACK: f32 = 0.15;
/// Share that the rate takes up: critically damped, 2(2 − α) − 4√(1 − α).
const TRACK_RATE: f32 = 0.0122;

/// A direction that follows another, steadily turning one (an α-β tracker).
#[derive(Clone, Copy, Debug)]
struct Tracker {
    value: Vector3<f32>,
    /// Change per cycle.
    rate: Vector3<f32>,
}

impl Tracker {
    fn at(value: Vector3<f32>) -> Self {
        Self {
            value,
            rate: Vector3::zeros(),
        }
    }

    fn follow(&mut self, goal: Vector3<f32>) -> Vector3<f32> {
        let ahead = self.value + self.rate;
        let error = goal - ahead;
        self.value = ahead + error * TRACK;
        self.rate += error * TRACK_RATE;
        self.value
    }
}

/// The law's memory.
#[derive(Clone, Copy, Debug)]
pub struct Lead {
    heading: Tracker,
    normal: Tracker,
}

impl Lead {
    /// With the nozzle at `start`, T_b_n.
    pub fn new(start: &Pose) -> Self {
        Self {
            heading: Tracker::at(start.r.column(0).into()),
            normal: Tracker::at(start.r.column(2).into()),
        }
    }

    /// Pose of the nozzle at distance `station` along the seam's trail, T_b_n; the sensor is `lead` (m) ahead of it.
    pub fn pose(&mut self, station: f32, lead: f32, seam: &mut Seam) -> Pose {
        let Seam {
            course, trail, normal, ..
        } = seam;
        trail.extend(course, normal);
        let tip = trail.at(station, course, normal);
        let Spot { point, normal: there } = {
            let near = trail.at(station + lead, course, normal);
            // On R150 the arc over a chord of 80 mm is 1 mm longer; the second place is right to 10 µm.
            let short = lead - length(&(near.point - tip.point));
            trail.at(station + lead + short, course, normal)
        };
        let chord = point - tip.point;
        let x = self.heading.follow(unit(&chord).unwrap_or(chord));
        let x = unit(&x).unwrap_or(x);
        let n = self.normal.follow((tip.normal + there) * 0.5);
        let n = n - x * n.dot(&x);
        let z = unit(&n).unwrap_or(n);
        Pose {
            r: Matrix3::from_columns(&[x, z.cross(&x), z]),
            p: tip.point,
        }
    }
}
