//! Pose of the seam under the sensor, from where two slits cut it (paper 003, chapter 3).
//!
//! Each slit gives the seam's point in its plane and the direction of its lit line on the sheet, both by exact pinhole
//! triangulation. The points give the seam's direction, the lines the sheet's inclination about it. The paper's own formulas
//! (3.20)–(3.28) are for small angles and an orthographic camera: at h_z = 150 mm they turn 5 mm of height into 1.9° of pitch.
//! They stand, as corrected, in this file's tests.

use crate::geometry::rotation::unit;
use crate::geometry::trig::{asin, atan2};
use nalgebra::{SMatrix, Vector3};

/// What one slit says of the seam, in Σ_S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Seam point in the slit plane, m.
    pub point: Vector3<f32>,
    /// Direction of the lit line on the sheet, toward +Y_S; not normalised.
    pub direction: Vector3<f32>,
}

/// Pose in Σ_S of the seam: x along it, y to the left in the sheet, z out of the sheet. Its origin is where it passes x = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamPose {
    /// d_y, d_z, m, then θ_x, θ_y, θ_z, rad: Rot(x)·Rot(y)·Rot(z) (3.7).
    pub value: [f32; 5],
    /// Covariance of these.
    pub covariance: SMatrix<f32, 5, 5>,
}

/// The five numbers of a pose from the cuts of the nearer slit and of the one ahead; `None` where they have no direction.
pub fn from_cuts(near: &Cut, ahead: &Cut) -> Option<[f32; 5]> {
    let along = ahead.point - near.point;
    if along.x <= 0.0 {
        return None;
    }
    let origin = near.point - along * (near.point.x / along.x);
    let t = unit(&along)?;
    let n = unit(&(t.cross(&near.direction) + t.cross(&ahead.direction)))?;
    let b = n.cross(&t);
    Some([origin.y, origin.z, atan2(-n.y, n.z), asin(n.x), atan2(-b.x, t.x)])
}

#[cfg(test)]
mod tests;
