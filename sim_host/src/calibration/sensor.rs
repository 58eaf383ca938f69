//! A calibrated sensor as a job takes it: camera, lens, slits and place on the hand, as the core describes them.
//!
//! The core's Σ_S hangs on the camera: its origin is [`CAMERA_HEIGHT_M`] before the camera's centre on its axis, x as the image's, y up in the
//! image, z toward the camera. What mounting leaves is in T_n_s, in the scale, the principal point, and the slits' planes. The camera is calibrated
//! in the start view: the tracking view is the middle of that, and the view of two slits has its pixels binned to another size (assumed, because the paper
//! prints both sizes of one camera). All views are through the same lens. [`super::sensor_file`] is the file that it comes from.

use anyhow::{Result, ensure};
use firmware::job::mount::SensorMount;
use firmware::vision::camera::Pinhole;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use std::f64::consts::PI;

use super::camera::Camera;
use super::lens::Lens;
use super::simulated::{DRAWN_M, SENSOR_LEAD_M, SIZE, TOOL_M, Truth};
use super::slit_plane::SlitPlane;
use crate::camera::optics::{CAMERA_HEIGHT_M, Deviation, Optics, Slit};
use crate::seal::setup::pose;

/// Furthest that a sensor may be from where it is drawn, mm and degrees: more is another unit, another frame, or a bent bracket.
const OFF_MM: f64 = 20.0;
const OFF_DEG: f64 = 10.0;
/// Slits that the core takes: tangent of their angle, lean, and offset, mm.
const TANGENT: std::ops::RangeInclusive<f64> = 0.5..=2.0;
const LEAN: f64 = 0.2;
const OFFSET_MM: f64 = 20.0;
/// Lenses that the core takes: how far a pixel of the start view is moved, percent of half its diagonal, and what the core's steps may leave
/// of that, µm of work.
const MOVED_PERCENT: f64 = 5.0;
const LEFT_UM: f64 = 1.0;

/// A sensor that tracks with one slit or two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorGeometry {
    /// Size of a pixel of the start view on the plane z = 0, m.
    pub pixel_m: f64,
    /// Principal point off the start view's middle, px.
    pub centre_px: [f64; 2],
    /// Its lens.
    pub lens: Lens,
    /// The start view's slit.
    pub start: Slit,
    /// The slits that it tracks with; of one, that twice.
    pub seam: [Slit; 2],
    /// It tracks with two.
    pub two_slits: bool,
    /// Pose of Σ_S in the nozzle frame.
    pub t_n_s: Isometry3<f64>,
}

impl SensorGeometry {
    /// Of a camera at `t_5_c` on the arm's last frame with this slit for the start view, and this pair to track with; without one, that slit.
    pub fn of(camera: &Camera, t_5_c: &Isometry3<f64>, slit: &SlitPlane, pair: Option<[SlitPlane; 2]>) -> Self {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        let at = |z| Isometry3::from_parts(Translation3::new(0.0, 0.0, z), turned);
        let (t_5_n, t_c_s) = (at(TOOL_M), at(CAMERA_HEIGHT_M));
        let [first, near, far] = DRAWN_M;
        let start = Slit::of(slit, first);
        Self {
            pixel_m: CAMERA_HEIGHT_M / (0.5 * (camera.fx + camera.fy)),
            centre_px: [
                camera.cx - 0.5 * (SIZE.0 as f64 - 1.0),
                camera.cy - 0.5 * (SIZE.1 as f64 - 1.0),
            ],
            lens: camera.lens(),
            start,
            seam: pair.map_or([start; 2], |pair| [Slit::of(&pair[0], near), Slit::of(&pair[1], far)]),
            two_slits: pair.is_some(),
            t_n_s: t_5_n.inverse() * t_5_c * t_c_s,
        }
    }

    /// Of the simulated cell, with so many slits to track with.
    pub fn of_truth(truth: &Truth, slits: u8) -> Self {
        let [slit, near, far] = truth.slits;
        Self::of(&truth.camera, &truth.t_5_c, &slit, (slits != 1).then_some([near, far]))
    }

    /// The cell's start view through it.
    pub fn start_optics(&self) -> Optics {
        self.through(Optics::START, [self.start; 2])
    }

    /// The view that the cell's seam is tracked in through it.
    pub fn seam_optics(&self) -> Optics {
        let view = if self.two_slits {
            Optics::TWO_SLITS
        } else {
            Optics::TRACKING
        };
        self.through(view, self.seam)
    }

    /// A view of the same lens, in pixels of its own size.
    fn through(&self, view: Optics, slits: [Slit; 2]) -> Optics {
        let binned = view.pixel_m / Optics::START.pixel_m;
        Optics {
            pixel_m: self.pixel_m * binned,
            off: Deviation {
                centre_px: self.centre_px.map(|px| px / binned),
                lens: self.lens,
                slits,
            },
            ..view
        }
    }

    /// What it tracks with as the core describes it, by slit.
    pub fn pinholes(&self) -> [Pinhole; 2] {
        let optics = self.seam_optics();
        [optics.pinhole(0), optics.pinhole(optics.slits_m.len() - 1)]
    }

    /// Where it is on the nozzle, as the core describes it.
    pub fn mount(&self) -> SensorMount {
        let slopes = |slit: Slit| [slit.tan as f32, slit.lean as f32];
        SensorMount {
            pose: pose(&self.t_n_s),
            camera_height: CAMERA_HEIGHT_M as f32,
            slit_slopes: slopes(self.start),
            seam_slopes: self.seam.map(slopes),
        }
    }

    /// It is one that the core takes; `slits` is the entry of its file in which the slits stand that it tracks with.
    pub fn check(&self, slits: &str) -> Result<()> {
        self.check_mount()?;
        self.check_lens()?;
        self.start.check("slit_plane")?;
        self.seam.iter().try_for_each(|slit| slit.check(slits))
    }

    /// At pixels all over the start view, its border among them.
    fn check_lens(&self) -> Result<()> {
        const STEPS: usize = 16;
        let core = self.lens.of_core();
        let tangent = self.pixel_m / CAMERA_HEIGHT_M;
        let half_diagonal = 0.5 * tangent * (SIZE.0 as f64).hypot(SIZE.1 as f64);
        let from_middle = |step: usize, size: usize| (step as f64 / STEPS as f64 - 0.5) * (size as f64 - 1.0);
        let (mut moved, mut left) = (0.0_f64, 0.0_f64);
        for (right, down) in (0..=STEPS).flat_map(|right| (0..=STEPS).map(move |down| (right, down))) {
            let pixel = Vector2::new(from_middle(right, SIZE.0), from_middle(down, SIZE.1));
            let seen = (pixel - Vector2::from(self.centre_px)) * tangent;
            let found = Vector2::from(core.undistort([seen.x as f32, seen.y as f32]).map(f64::from));
            let off = (self.lens.distort(&found) - seen).norm() * CAMERA_HEIGHT_M * 1e6;
            // Steps that end in no number at all leave everything.
            left = left.max(if off.is_nan() { f64::INFINITY } else { off });
            moved = moved.max((seen - found).norm() / half_diagonal * 100.0);
        }
        ensure!(
            left <= LEFT_UM,
            "distortion_coefficients: the camera's steps undo them to {left:.1} µm, must be at most {LEFT_UM}"
        );
        ensure!(
            moved <= MOVED_PERCENT,
            "distortion_coefficients: they move a pixel by {moved:.1} % of half the image's diagonal, must be at most {MOVED_PERCENT}"
        );
        Ok(())
    }

    fn check_mount(&self) -> Result<()> {
        let drawn = Vector3::new(SENSOR_LEAD_M, 0.0, 0.0);
        let off_mm = (self.t_n_s.translation.vector - drawn).norm() * 1e3;
        ensure!(
            off_mm <= OFF_MM,
            "hand_eye: {off_mm:.1} mm off the drawing, must be at most {OFF_MM} (its last column is in m)"
        );
        let off_deg = self.t_n_s.rotation.angle().to_degrees();
        ensure!(
            off_deg <= OFF_DEG,
            "hand_eye: {off_deg:.1}° off the drawing, must be at most {OFF_DEG}"
        );
        Ok(())
    }
}

impl Slit {
    /// The slit in `plane` that is drawn to meet z = 0 at `drawn` (m).
    fn of(plane: &SlitPlane, drawn: f64) -> Self {
        let [x, y, z] = plane.normal.into();
        // n·p = d with p = (x, −y, h_z − z) of Σ_S.
        Self {
            offset_m: (plane.distance_m - z * CAMERA_HEIGHT_M) / x - drawn,
            tan: -z / x,
            lean: -y / x,
        }
    }

    /// It is one that the core takes; `entry` is where it stands in the file.
    fn check(&self, entry: &str) -> Result<()> {
        let Self { offset_m, tan, lean } = *self;
        ensure!(
            TANGENT.contains(&tan) && lean.abs() <= LEAN,
            "{entry}: tangent {tan:.3} and lean {lean:.3}, must be {} to {} and within ±{LEAN}",
            TANGENT.start(),
            TANGENT.end()
        );
        let offset_mm = offset_m * 1e3;
        ensure!(
            offset_mm.abs() <= OFFSET_MM,
            "{entry}: {offset_mm:.1} mm off the drawing, must be within ±{OFFSET_MM} (its distance is in m)"
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::sensor_file::SensorFile;
    use super::super::sensor_file::tests::file;
    use super::*;

    #[test]
    fn the_sensor_as_drawn_is_the_core_s_and_the_cell_s_own() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let focal = CAMERA_HEIGHT_M / Optics::START.pixel_m;
        let camera = Camera {
            fx: focal,
            fy: focal,
            cx: 224.5,
            cy: 224.5,
            distortion: [0.0; 5],
        };
        let slit = |ahead: f64| SlitPlane {
            normal: Vector3::new(half, 0.0, -half),
            distance_m: half * (ahead - CAMERA_HEIGHT_M),
        };
        let t_5_c = Isometry3::translation(SENSOR_LEAD_M, 0.0, TOOL_M - CAMERA_HEIGHT_M);
        let pair = [slit(DRAWN_M[1]), slit(DRAWN_M[2])];
        for (pair, nominal, cell) in [
            (None, [Pinhole::TRACKING; 2], Optics::TRACKING),
            (Some(pair), Pinhole::TWO_SLITS, Optics::TWO_SLITS),
        ] {
            let drawn = SensorGeometry::of(&camera, &t_5_c, &slit(0.0), pair);
            assert!((drawn.t_n_s.translation.vector - Vector3::new(0.08, 0.0, 0.0)).norm() < 1e-12);
            assert!(drawn.t_n_s.rotation.angle() < 1e-12);
            for (own, nominal) in drawn.pinholes().iter().zip(&nominal) {
                assert!((own.point(90.0, 60.0) - nominal.point(90.0, 60.0)).norm() < 2e-8);
            }
            for slit in 0..cell.slits_m.len() {
                let point = drawn.seam_optics().on_slit_plane(slit, 90.0, 60.0);
                assert!((point - cell.on_slit_plane(slit, 90.0, 60.0)).norm() < 1e-12);
            }
            let (own, nominal) = (drawn.start_optics().pinhole(0), Pinhole::START);
            assert!((own.point(90.0, 60.0) - nominal.point(90.0, 60.0)).norm() < 2e-8);
        }
    }

    #[test]
    fn core_and_cell_see_a_pixel_where_camera_and_slits_as_calibrated_do() {
        let SensorFile {
            camera,
            t_5_c,
            slit: first,
            pair,
            ..
        } = file();
        let lens = camera.camera;
        let t_5_n = Isometry3::from_parts(
            Translation3::new(0.0, 0.0, TOOL_M),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
        );
        let [near, far] = pair.unwrap();
        let two = SensorGeometry::of(&lens, &t_5_c, &first, pair);
        let one = SensorGeometry::of(&lens, &t_5_c, &first, None);
        for (view, slit, plane) in [
            (one.seam_optics(), 0, first),
            (two.start_optics(), 0, first),
            (two.seam_optics(), 0, near),
            (two.seam_optics(), 1, far),
        ] {
            let pinhole = view.pinhole(slit);
            // The views' pixels are those of the calibrated image, cut and binned about its middle.
            let binned = view.pixel_m / one.pixel_m;
            let middle = |size: usize| 0.5 * (size as f64 - 1.0);
            for (x, y) in [(124.5, 124.5), (60.0, 30.0), (140.0, 220.0)] {
                let pixel = super::super::Pixel::new(
                    middle(SIZE.0) + binned * (x - middle(view.width)),
                    middle(SIZE.1) + binned * (y - middle(view.height)),
                );
                let at = t_5_c * plane.point(&lens, &pixel).unwrap();
                let by_cell = t_5_n * two.t_n_s * nalgebra::Point3::from(view.on_slit_plane(slit, x, y));
                assert!((by_cell - at).norm() < 1e-9, "{}", by_cell - at);
                let by_core = (two.mount().pose * pinhole.point(x as f32, y as f32)).map(f64::from);
                assert!((t_5_n * nalgebra::Point3::from(by_core) - at).norm() < 2e-7);
            }
        }
    }
}
