//! The paper's law (chapter 4): the sensor frame is driven along its own x axis, and turned and shifted by the deviation that it measures.
//!
//! Each cycle Σ_S goes on by d_x = v·T and by 1/m of K times the deviation f of the frame before (4.8–4.11); the processing takes one frame of m
//! cycles, so the loop's characteristic is Z² − Z + K (4.22), critically damped at K = 0.25. It lags: on a radius R by l/(K·R) in heading and
//! 16 l²/R to the side, l = v·m·T, so that 0.04 m/s is its limit on R150. Kept as it is, as a mode; see [`super::lead`] for the default.

use crate::geometry::Pose;
use crate::geometry::rotation::{exp, log, product, unit};
use nalgebra::{Matrix3, Vector3};

/// Feedback gain K (4.22): a double root at 0.5.
const GAIN: f32 = 0.25;

/// Distance between the two slits' points on the seam, m (chapter 3). One slit takes the seam as far behind it in place of the other's.
pub const PAIR: f32 = 0.021_25;

/// The deviation f of the seam's frame from Σ_S: shift in m, turn as a rotation vector in rad (4.5, whose small angles it replaces exactly).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// (0, d_y, d_z).
    pub shift: Vector3<f32>,
    /// (θ_x, θ_y, θ_z).
    pub turn: Vector3<f32>,
}

impl Deviation {
    const NONE: Self = Self {
        shift: Vector3::new(0.0, 0.0, 0.0),
        turn: Vector3::new(0.0, 0.0, 0.0),
    };

    /// From two points of the seam, the first further ahead, and the direction of the lit line across the sheet, all in Σ_S: the exact
    /// replacement of (3.20–3.28) in the spec. `None` if the points do not follow each other along x.
    pub fn of(ahead: &Vector3<f32>, behind: &Vector3<f32>, across: &Vector3<f32>) -> Option<Self> {
        let chord = ahead - behind;
        let along = unit(&chord)?;
        let up = unit(&along.cross(across))?;
        if along.x < 0.5 {
            return None;
        }
        let shift = behind - chord * (behind.x / chord.x);
        let r = Matrix3::from_columns(&[along, up.cross(&along), up]);
        Some(Self { shift, turn: log(&r) })
    }
}

/// The loop's memory.
#[derive(Clone, Copy, Debug)]
pub struct PaperLaw {
    /// Where Σ_S is to be: T_d.
    sensor: Pose,
    /// Deviation that the processing has ready for the next frame.
    ready: Option<Deviation>,
    /// Deviation that is being applied, of the frame before.
    applied: Deviation,
}

impl PaperLaw {
    /// Σ_S stands at `sensor`, T_b_s.
    pub fn new(sensor: Pose) -> Self {
        Self {
            sensor,
            ready: None,
            applied: Deviation::NONE,
        }
    }

    /// A frame was measured.
    pub fn measured(&mut self, deviation: Deviation) {
        self.ready = Some(deviation);
    }

    /// The next frame begins: what the one before it showed is applied during it. Nothing, if nothing came.
    pub fn frame(&mut self) {
        self.applied = self.ready.take().unwrap_or(Deviation::NONE);
    }

    /// One cycle on, by `way` (m) along the seam, with `per_frame` cycles to a frame: T_d, pose of the sensor.
    pub fn advance(&mut self, way: f32, per_frame: u8) -> Pose {
        let share = GAIN / f32::from(per_frame.max(1));
        let step = self.applied.shift * share + Vector3::new(way, 0.0, 0.0);
        self.sensor.p += self.sensor.r * step;
        self.sensor.r = square(&product(&self.sensor.r, &exp(&(self.applied.turn * share))));
        self.sensor
    }
}

/// The rotation next to a product of many: rounding must not make it another thing.
fn square(r: &Matrix3<f32>) -> Matrix3<f32> {
    let (x, z): (Vector3<f32>, Vector3<f32>) = (r.column(0).into(), r.column(2).into());
    let x = unit(&x).unwrap_or(x);
    let z = z - x * z.dot(&x);
    let z = unit(&z).unwrap_or(z);
    Matrix3::from_columns(&[x, z.cross(&x), z])
}

#[cfg(test)]
mod tests;
