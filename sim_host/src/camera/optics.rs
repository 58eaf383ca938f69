//! Geometry of the seam sensors: pinhole, slit planes and projectors in Σ_S.
//!
//! Σ_S: x along the seam in the direction of travel, z toward the camera, y left. The camera's centre is at (0, 0, h_z),
//! looking along −z; image x is +X_S, image y is −Y_S; pixels count from the centre of the top-left one.

use crate::calibration::lens::Lens;
use crate::cell::panel::Panel;
use firmware::vision::camera::Pinhole;
use hal::camera::SLITS;
use nalgebra::{Isometry3, Vector2, Vector3};

/// A camera and its slits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// Image width and height, px.
    pub width: usize,
    /// See [`Self::width`].
    pub height: usize,
    /// Size of a pixel on the plane z = 0, m.
    pub pixel_m: f64,
    /// Where each slit's plane meets z = 0, m; the nearer to the nozzle first.
    pub slits_m: &'static [f64],
    /// How what was built differs from what was drawn.
    pub off: Deviation,
}

/// How a camera, its lens and its slits differ from the drawing, besides the scale and the sensor's place on the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Principal point off the image's middle, px.
    pub centre_px: [f64; 2],
    /// What the lens does.
    pub lens: Lens,
    /// The slits, as many as there are.
    pub slits: [Slit; SLITS],
}

/// A slit as built: its plane is x = c − z·tan − y·lean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slit {
    /// c less that of the drawing, m.
    pub offset_m: f64,
    /// Tangent, as it is instead of [`TAN_SLIT`].
    pub tan: f64,
    /// Lean along y.
    pub lean: f64,
}

impl Deviation {
    /// Built as drawn.
    pub const NONE: Self = Self {
        centre_px: [0.0; 2],
        lens: Lens::NONE,
        slits: [Slit {
            offset_m: 0.0,
            tan: TAN_SLIT,
            lean: 0.0,
        }; SLITS],
    };
}

/// Height of the camera's centre over the plane z = 0, m. Assumed: the paper does not print it.
pub const CAMERA_HEIGHT_M: f64 = 0.150;
/// Tangent of the slits' inclination, 45° (chapter 3 and 5.2).
pub const TAN_SLIT: f64 = 1.0;
/// Height of the slits' sources over z = 0, m. Assumed: beside the camera; their light fans out from there.
pub const PROJECTOR_HEIGHT_M: f64 = 0.150;

impl Optics {
    /// The tracking view (5.2): 250 × 250 px of 0.12 mm, one slit through the origin.
    pub const TRACKING: Self = Self {
        width: 250,
        height: 250,
        pixel_m: 0.000_12,
        slits_m: &[0.0],
        off: Deviation::NONE,
    };

    /// The two-slit sensor (chapter 3): 400 × 240 px of 1/8 mm, slits 21.25 mm apart (assumed: the paper does not print it).
    pub const TWO_SLITS: Self = Self {
        width: 400,
        height: 240,
        pixel_m: 0.000_125,
        slits_m: &[-0.010_625, 0.010_625],
        off: Deviation::NONE,
    };

    /// The start view (5.2): the same lens over 450 × 450 px.
    pub const START: Self = Self {
        width: 450,
        height: 450,
        ..Self::TRACKING
    };

    /// Principal point, px: the image's middle where the camera is as drawn.
    fn centre(&self) -> (f64, f64) {
        let [x, y] = self.off.centre_px;
        (
            0.5 * (self.width as f64 - 1.0) + x,
            0.5 * (self.height as f64 - 1.0) + y,
        )
    }

    /// Where the plane of slit number `slit` meets z = 0 on the camera's axis, m.
    pub fn slit(&self, slit: usize) -> f64 {
        self.slits_m[slit] + self.off.slits[slit].offset_m
    }

    /// Half the diagonal of the field of view, m.
    pub fn reach_m(&self) -> f64 {
        0.5 * self.pixel_m * (self.width as f64).hypot(self.height as f64)
    }

    /// From the camera's centre to where pixel (x, y) sees the plane z = 0, m, Σ_S.
    pub fn ray(&self, x_px: f64, y_px: f64) -> Vector3<f64> {
        let (centre_x, centre_y) = self.centre();
        let seen = Vector2::new(self.pixel_m * (x_px - centre_x), self.pixel_m * (y_px - centre_y));
        let on_work = match self.off.lens {
            Lens::NONE => seen,
            lens => lens.undistort(&(seen / CAMERA_HEIGHT_M)) * CAMERA_HEIGHT_M,
        };
        Vector3::new(on_work.x, -on_work.y, -CAMERA_HEIGHT_M)
    }

    /// Point of the plane of slit number `slit` (Σ_S, m) that appears at pixel (x, y).
    pub fn on_slit_plane(&self, slit: usize, x_px: f64, y_px: f64) -> Vector3<f64> {
        let [x, y, _] = self.ray(x_px, y_px).into();
        let Slit { tan, lean, .. } = self.off.slits[slit];
        let reach = CAMERA_HEIGHT_M * tan;
        let t = (self.slit(slit) - reach) / (x + lean * y - reach);
        Vector3::new(x * t, y * t, CAMERA_HEIGHT_M * (1.0 - t))
    }

    /// Camera and slit number `slit` as the core describes them.
    pub fn pinhole(&self, slit: usize) -> Pinhole {
        let (x, y) = self.centre();
        let Slit { tan, lean, .. } = self.off.slits[slit];
        Pinhole {
            pixel_m: self.pixel_m as f32,
            centre_px: [x as f32, y as f32],
            height_m: CAMERA_HEIGHT_M as f32,
            tan_slit: tan as f32,
            slit_offset_m: self.slit(slit) as f32,
            slit_lean: lean as f32,
            lens: self.off.lens.of_core(),
        }
    }

    /// Pixel (x, y) at which a point of Σ_S appears.
    pub fn project(&self, point: &Vector3<f64>) -> (f64, f64) {
        let (centre_x, centre_y) = self.centre();
        let scale = CAMERA_HEIGHT_M / (CAMERA_HEIGHT_M - point.z) / self.pixel_m;
        let straight = Vector2::new(point.x * scale, -point.y * scale);
        let seen = match self.off.lens {
            Lens::NONE => straight,
            lens => {
                let focal = CAMERA_HEIGHT_M / self.pixel_m;
                lens.distort(&(straight / focal)) * focal
            }
        };
        (centre_x + seen.x, centre_y + seen.y)
    }

    /// Camera centre, m.
    pub fn camera(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, CAMERA_HEIGHT_M)
    }

    /// Source of a slit's light, m.
    pub fn projector(&self, slit: usize) -> Vector3<f64> {
        let x = self.slit(slit) - PROJECTOR_HEIGHT_M * self.off.slits[slit].tan;
        Vector3::new(x, 0.0, PROJECTOR_HEIGHT_M)
    }

    /// Where the true seam crosses the plane of slit number `slit` of a sensor at `t_b_s`, searched from the nominal arc length `s_guess`.
    pub fn true_sighting(&self, slit: usize, panel: &Panel, t_b_s: &Isometry3<f64>, s_guess: f64) -> TrueSighting {
        self.crossing(
            slit,
            |s| t_b_s.inverse_transform_point(&panel.seam(s).p.into()).coords,
            s_guess,
        )
    }

    /// The same of the upper sheet's edge.
    pub fn true_edge(&self, slit: usize, panel: &Panel, t_b_s: &Isometry3<f64>, s_guess: f64) -> TrueSighting {
        self.crossing(
            slit,
            |s| t_b_s.inverse_transform_point(&panel.edge(s).into()).coords,
            s_guess,
        )
    }

    /// Where a curve of Σ_S crosses the plane of slit number `slit`.
    fn crossing(&self, slit: usize, curve: impl Fn(f64) -> Vector3<f64>, s_guess: f64) -> TrueSighting {
        let Slit { tan, lean, .. } = self.off.slits[slit];
        let behind_plane = |point: &Vector3<f64>| point.x + point.z * tan + point.y * lean - self.slit(slit);
        const PROBE_M: f64 = 1e-5;
        let mut s = s_guess;
        for _ in 0..12 {
            let here = behind_plane(&curve(s));
            let slope = (behind_plane(&curve(s + PROBE_M)) - here) / PROBE_M;
            s -= (here / slope).clamp(-0.02, 0.02);
        }
        let point = curve(s);
        TrueSighting {
            s,
            point,
            pixel: self.project(&point),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_image_centre_sees_the_origin_and_a_raised_sheet_moves_the_line_back() {
        assert!(Optics::TRACKING.on_slit_plane(0, 124.5, 124.5).norm() < 1e-15);
        // 0.6 mm higher: 0.6 mm toward −x, and 0.15 / 0.1494 times larger through the pinhole.
        let (x, _) = Optics::TRACKING.project(&Vector3::new(-0.0006, 0.0, 0.0006));
        assert!((124.5 - x - 5.0 * 0.15 / 0.1494).abs() < 1e-9, "{x} px");
    }

    /// A lens that moves the start view's corner by 1.4 %.
    const REAL: Deviation = Deviation {
        lens: Lens([-0.2, -0.3, 0.001, 0.002, 0.1]),
        ..Deviation::NONE
    };

    #[test]
    fn the_core_knows_the_same_cameras() {
        let one = [Pinhole::TRACKING];
        for (optics, core) in [(Optics::TRACKING, &one[..]), (Optics::TWO_SLITS, &Pinhole::TWO_SLITS)] {
            assert_eq!(optics.slits_m.len(), core.len());
            for (slit, core) in core.iter().enumerate() {
                let point = optics.on_slit_plane(slit, 90.0, 60.0);
                assert!((point.map(|v| v as f32) - core.point(90.0, 60.0)).norm() < 3e-8);
            }
        }
    }

    proptest! {
        #[test]
        fn a_pixels_point_lies_on_the_slit_plane_and_appears_at_that_pixel(
            x in 0.0_f64..399.0, y in 0.0_f64..239.0, slit in 0_usize..2,
        ) {
            let optics = Optics::TWO_SLITS;
            let point = optics.on_slit_plane(slit, x, y);
            prop_assert!((point.x + point.z * TAN_SLIT - optics.slits_m[slit]).abs() < 1e-15);
            let (u, v) = optics.project(&point);
            prop_assert!((u - x).abs() < 1e-9 && (v - y).abs() < 1e-9);
        }

        #[test]
        fn behind_a_lens_that_distorts_core_and_cell_see_the_same_point_too(
            x in 0.0_f64..399.0, y in 0.0_f64..239.0, slit in 0_usize..2,
        ) {
            let optics = Optics { off: REAL, ..Optics::TWO_SLITS };
            let point = optics.on_slit_plane(slit, x, y);
            let by_core = optics.pinhole(slit).point(x as f32, y as f32);
            prop_assert!((by_core.map(f64::from) - point).norm() < 1e-7, "{} and {}", by_core, point);
            let (u, v) = optics.project(&point);
            prop_assert!((u - x).abs() < 1e-9 && (v - y).abs() < 1e-9);
        }
    }
}
