//! Geometry of the seam sensor: pinhole, slit plane and projector in Σ_S.
//!
//! Σ_S: x along the seam in the direction of travel, z toward the camera, y left. The camera's centre is at (0, 0, h_z),
//! looking along −z; image x is +X_S, image y is −Y_S; pixels count from the centre of the top-left one.

use crate::cell::panel::Panel;
use nalgebra::{Isometry3, Vector3};

/// Image width and height, px (5.2: tracking view 250 × 250).
pub const WIDTH: usize = 250;
/// See [`WIDTH`].
pub const HEIGHT: usize = 250;
/// Size of a pixel on the plane z = 0, m (5.2: 0.12 mm).
pub const PIXEL_M: f64 = 0.00012;
/// Height of the camera's centre over the plane z = 0, m. Assumed: the paper does not print it.
pub const CAMERA_HEIGHT_M: f64 = 0.150;
/// Tangent of the slit's inclination, 45° (5.2).
pub const TAN_SLIT: f64 = 1.0;
/// Where the slit plane meets z = 0, m: the one-slit sensor's passes through the origin.
pub const SLIT_OFFSET_M: f64 = 0.0;
/// Height of the slit's source over z = 0, m. Assumed: beside the camera; its light fans out from there.
pub const PROJECTOR_HEIGHT_M: f64 = 0.150;
/// Principal point, px.
const CENTRE_PX: f64 = 124.5;

/// Point of the slit plane (Σ_S, m) that appears at pixel (x, y).
pub fn on_slit_plane(x_px: f64, y_px: f64) -> Vector3<f64> {
    let (x, y) = (PIXEL_M * (x_px - CENTRE_PX), -PIXEL_M * (y_px - CENTRE_PX));
    let reach = CAMERA_HEIGHT_M * TAN_SLIT;
    let t = (SLIT_OFFSET_M - reach) / (x - reach);
    Vector3::new(x * t, y * t, CAMERA_HEIGHT_M * (1.0 - t))
}

/// Pixel (x, y) at which a point of Σ_S appears.
pub fn project(point: &Vector3<f64>) -> (f64, f64) {
    let scale = CAMERA_HEIGHT_M / (CAMERA_HEIGHT_M - point.z) / PIXEL_M;
    (CENTRE_PX + point.x * scale, CENTRE_PX - point.y * scale)
}

/// Camera centre, m.
pub fn camera() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, CAMERA_HEIGHT_M)
}

/// Source of the slit's light, m.
pub fn projector() -> Vector3<f64> {
    let x = SLIT_OFFSET_M - PROJECTOR_HEIGHT_M * TAN_SLIT;
    Vector3::new(x, 0.0, PROJECTOR_HEIGHT_M)
}

/// The truth that a sighting is measured against.
#[derive(Clone, Copy, Debug)]
pub struct TrueSighting {
    /// Nominal arc length of the seam point in the slit's light, m.
    pub s: f64,
    /// That point in Σ_S, m.
    pub point: Vector3<f64>,
    /// Where it appears, px.
    pub pixel: (f64, f64),
}

/// Where the true seam crosses the slit plane of a sensor at `t_b_s`, searched from the nominal arc length `s_guess`.
pub fn true_sighting(panel: &Panel, t_b_s: &Isometry3<f64>, s_guess: f64) -> TrueSighting {
    let behind_plane = |s: f64| {
        let point = t_b_s.inverse_transform_point(&panel.seam(s).p.into()).coords;
        (point, point.x + point.z * TAN_SLIT - SLIT_OFFSET_M)
    };
    const PROBE_M: f64 = 1e-5;
    let mut s = s_guess;
    for _ in 0..12 {
        let here = behind_plane(s).1;
        let slope = (behind_plane(s + PROBE_M).1 - here) / PROBE_M;
        s -= (here / slope).clamp(-0.02, 0.02);
    }
    let point = behind_plane(s).0;
    TrueSighting {
        s,
        point,
        pixel: project(&point),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_image_centre_sees_the_origin_and_a_raised_sheet_moves_the_line_back() {
        assert!(on_slit_plane(124.5, 124.5).norm() < 1e-15);
        // 0.6 mm higher: 0.6 mm toward −x, and 0.15 / 0.1494 times larger through the pinhole.
        let (x, _) = project(&Vector3::new(-0.0006, 0.0, 0.0006));
        assert!((124.5 - x - 5.0 * 0.15 / 0.1494).abs() < 1e-9, "{x} px");
    }

    proptest! {
        #[test]
        fn a_pixels_point_lies_on_the_slit_plane_and_appears_at_that_pixel(x in 0.0_f64..249.0, y in 0.0_f64..249.0) {
            let point = on_slit_plane(x, y);
            prop_assert!((point.x + point.z * TAN_SLIT).abs() < 1e-15);
            let (u, v) = project(&point);
            prop_assert!((u - x).abs() < 1e-9 && (v - y).abs() < 1e-9);
        }
    }
}
