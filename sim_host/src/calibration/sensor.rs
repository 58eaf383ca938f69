//! A calibrated sensor as a job takes it: camera, slit and place on the hand, in a file and as the core describes them.
//!
//! The file is OpenCV's YAML of the camera ([`super::opencv_yaml`]) with three entries more: `hand_eye`, the pose of the camera in Σ_5, rows
//! of \[R p\], p in m; `slit_plane`, its unit normal in Σ_C and its distance from the camera's centre, m; and `views`, in how many the board was
//! found. OpenCV passes over what it does not know.
//!
//! The core's Σ_S hangs on the camera: its origin is [`CAMERA_HEIGHT_M`] before the camera's centre on its axis, x as the image's, y up in the
//! image, z toward the camera. What mounting leaves is in T_n_s, in the scale, the principal point, and the slit's plane. The lens'
//! distortion is left out: in the tracking view 5 mm from the middle it is under a micrometre.

use anyhow::{Context, Result, ensure};
use firmware::geometry::Pose;
use firmware::job::correction::SensorMount;
use firmware::vision::camera::Pinhole;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use super::camera::Camera;
use super::given;
use super::intrinsics::{MAX_VIEWS, MIN_VIEWS};
use super::opencv_yaml::{CameraFile, matrix, put_matrix, scalar};
use super::simulated::{SENSOR_LEAD_M, SIZE, TOOL_M, Truth};
use super::slit_plane::SlitPlane;
use crate::camera::optics::{CAMERA_HEIGHT_M, Deviation, Optics};
use crate::whole_file;

/// Furthest that a sensor may be from where it is drawn, mm and degrees: more is another unit, another frame, or a bent bracket.
const OFF_MM: f64 = 20.0;
const OFF_DEG: f64 = 10.0;
/// Allowed error of a unit normal's length.
const UNIT: f64 = 1e-3;
/// Slits that the core takes: tangent of their angle, lean, and offset, mm.
const TANGENT: std::ops::RangeInclusive<f64> = 0.5..=2.0;
const LEAN: f64 = 0.2;
const OFFSET_MM: f64 = 20.0;

/// What a calibration says of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorFile {
    /// Its camera.
    pub camera: CameraFile,
    /// Pose of the camera in Σ_5.
    pub t_5_c: Isometry3<f64>,
    /// Its slit's plane in Σ_C.
    pub slit: SlitPlane,
    /// Views that it was calibrated from.
    pub views: usize,
}

impl SensorFile {
    /// Reads and checks the file `path`. The error is one line with file, field, value and range.
    pub fn load(path: &Path) -> Result<Self> {
        let name = || format!("calibration {}", path.display());
        let text = std::fs::read_to_string(path).with_context(|| format!("{}: cannot be read", name()))?;
        Self::parse(&text).with_context(name)
    }

    /// Writes the file `path`, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<PathBuf> {
        whole_file::write(path, self.to_text().as_bytes())
    }

    /// Reads a file's text.
    pub fn parse(text: &str) -> Result<Self> {
        let camera = CameraFile::parse(text)?;
        let (width, height) = SIZE;
        ensure!(
            (camera.width, camera.height) == SIZE,
            "image_width, image_height {} x {}: must be {width} x {height} px, the start view's",
            camera.width,
            camera.height
        );
        let entry = scalar(text, "views")?;
        let views: usize = entry
            .parse()
            .with_context(|| format!("views {entry:?}: not a whole number"))?;
        ensure!(
            (MIN_VIEWS..=MAX_VIEWS).contains(&views),
            "views {views}: must be {MIN_VIEWS} to {MAX_VIEWS}"
        );
        let t_5_c = given::pose_of(&matrix(text, "hand_eye")?).context("hand_eye")?;
        let plane = matrix(text, "slit_plane")?;
        let [x, y, z, distance_m] = <[f64; 4]>::try_from(plane.as_slice())
            .ok()
            .with_context(|| format!("slit_plane: {} numbers, must be 4", plane.len()))?;
        let normal = Vector3::new(x, y, z);
        ensure!(
            (normal.norm() - 1.0).abs() <= UNIT,
            "slit_plane: normal of length {:.4}, must be 1 within {UNIT}",
            normal.norm()
        );
        let file = Self {
            camera,
            t_5_c,
            slit: SlitPlane { normal, distance_m },
            views,
        };
        file.geometry().check()?;
        Ok(file)
    }

    /// The file's text.
    pub fn to_text(&self) -> String {
        let mut text = self.camera.to_text();
        let pose = self.t_5_c.to_homogeneous();
        let rows: [f64; 12] = std::array::from_fn(|at| pose[(at / 4, at % 4)]);
        put_matrix(&mut text, "hand_eye", 3, &rows);
        let normal = self.slit.normal;
        put_matrix(
            &mut text,
            "slit_plane",
            1,
            &[normal.x, normal.y, normal.z, self.slit.distance_m],
        );
        text + &format!("views: {}\n", self.views)
    }

    /// The sensor as a job takes it.
    pub fn geometry(&self) -> SensorGeometry {
        SensorGeometry::of(&self.camera.camera, &self.t_5_c, &self.slit)
    }
}

/// A sensor with one slit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorGeometry {
    /// Size of a pixel on the plane z = 0, m.
    pub pixel_m: f64,
    /// Where the slit's plane is, and the principal point.
    pub off: Deviation,
    /// Pose of Σ_S in the nozzle frame.
    pub t_n_s: Isometry3<f64>,
}

impl SensorGeometry {
    /// Of a camera at `t_5_c` on the arm's last frame with this slit.
    pub fn of(camera: &Camera, t_5_c: &Isometry3<f64>, slit: &SlitPlane) -> Self {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
        let at = |z| Isometry3::from_parts(Translation3::new(0.0, 0.0, z), turned);
        let (t_5_n, t_c_s) = (at(TOOL_M), at(CAMERA_HEIGHT_M));
        let [x, y, z] = slit.normal.into();
        // n·p = d with p = (x, −y, h_z − z) of Σ_S.
        Self {
            pixel_m: CAMERA_HEIGHT_M / (0.5 * (camera.fx + camera.fy)),
            off: Deviation {
                centre_px: [
                    camera.cx - 0.5 * (SIZE.0 as f64 - 1.0),
                    camera.cy - 0.5 * (SIZE.1 as f64 - 1.0),
                ],
                offset_m: (slit.distance_m - z * CAMERA_HEIGHT_M) / x,
                tan_slit: -z / x,
                lean: -y / x,
            },
            t_n_s: t_5_n.inverse() * t_5_c * t_c_s,
        }
    }

    /// Of the simulated cell.
    pub fn of_truth(truth: &Truth) -> Self {
        let slit = SlitPlane {
            normal: truth.slit_normal,
            distance_m: truth.slit_distance_m,
        };
        Self::of(&truth.camera, &truth.t_5_c, &slit)
    }

    /// The cell's tracking view through it: the middle of the calibrated image.
    pub fn optics(&self) -> Optics {
        Optics {
            pixel_m: self.pixel_m,
            off: self.off,
            ..Optics::TRACKING
        }
    }

    /// The same as the core describes it.
    pub fn pinhole(&self) -> Pinhole {
        let Deviation {
            centre_px: [x, y],
            offset_m,
            tan_slit,
            lean,
        } = self.off;
        let [middle_x, middle_y] = Pinhole::TRACKING.centre_px;
        Pinhole {
            pixel_m: self.pixel_m as f32,
            centre_px: [middle_x + x as f32, middle_y + y as f32],
            height_m: CAMERA_HEIGHT_M as f32,
            tan_slit: tan_slit as f32,
            slit_offset_m: offset_m as f32,
            slit_lean: lean as f32,
        }
    }

    /// Where it is on the nozzle, as the core describes it.
    pub fn mount(&self) -> SensorMount {
        SensorMount {
            pose: Pose {
                r: self.t_n_s.rotation.to_rotation_matrix().matrix().map(|e| e as f32),
                p: self.t_n_s.translation.vector.map(|e| e as f32),
            },
            camera_height: CAMERA_HEIGHT_M as f32,
            slit_slopes: [self.off.tan_slit as f32, self.off.lean as f32],
        }
    }

    fn check(&self) -> Result<()> {
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
        let Deviation {
            offset_m,
            tan_slit,
            lean,
            ..
        } = self.off;
        ensure!(
            TANGENT.contains(&tan_slit) && lean.abs() <= LEAN,
            "slit_plane: tangent {tan_slit:.3} and lean {lean:.3}, must be {} to {} and within ±{LEAN}",
            TANGENT.start(),
            TANGENT.end()
        );
        let offset_mm = offset_m * 1e3;
        ensure!(
            offset_mm.abs() <= OFFSET_MM,
            "slit_plane: {offset_mm:.1} mm off the drawing, must be within ±{OFFSET_MM} (its distance is in m)"
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::simulated;
    use super::*;
    use crate::whole_file::tests::folder;

    fn file() -> SensorFile {
        let truth = simulated::truth(7);
        SensorFile {
            camera: CameraFile {
                width: SIZE.0,
                height: SIZE.1,
                camera: truth.camera,
                rms_px: 0.1,
            },
            t_5_c: truth.t_5_c,
            slit: SlitPlane {
                normal: truth.slit_normal,
                distance_m: truth.slit_distance_m,
            },
            views: 40,
        }
    }

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
        let slit = SlitPlane {
            normal: Vector3::new(half, 0.0, -half),
            distance_m: -half * CAMERA_HEIGHT_M,
        };
        let t_5_c = Isometry3::translation(SENSOR_LEAD_M, 0.0, TOOL_M - CAMERA_HEIGHT_M);
        let drawn = SensorGeometry::of(&camera, &t_5_c, &slit);
        assert!((drawn.t_n_s.translation.vector - Vector3::new(0.08, 0.0, 0.0)).norm() < 1e-12);
        assert!(drawn.t_n_s.rotation.angle() < 1e-12);
        let (own, nominal) = (drawn.pinhole(), Pinhole::TRACKING);
        assert!((own.point(90.0, 60.0) - nominal.point(90.0, 60.0)).norm() < 1e-8);
        let point = drawn.optics().on_slit_plane(0, 90.0, 60.0);
        assert!((point - Optics::TRACKING.on_slit_plane(0, 90.0, 60.0)).norm() < 1e-12);
    }

    #[test]
    fn core_and_cell_see_a_pixel_where_camera_and_slit_as_calibrated_do() {
        let SensorFile {
            camera, t_5_c, slit, ..
        } = file();
        let mut lens = camera.camera;
        lens.distortion = [0.0; 5];
        let sensor = SensorGeometry::of(&lens, &t_5_c, &slit);
        let t_5_n = Isometry3::from_parts(
            Translation3::new(0.0, 0.0, TOOL_M),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
        );
        for (x, y) in [(124.5, 124.5), (60.0, 30.0), (140.0, 220.0)] {
            // The tracking view's pixels are those of the calibrated image's middle.
            let pixel = super::super::Pixel::new(x + 100.0, y + 100.0);
            let at = t_5_c * slit.point(&lens, &pixel).unwrap();
            let by_cell = t_5_n * sensor.t_n_s * nalgebra::Point3::from(sensor.optics().on_slit_plane(0, x, y));
            assert!((by_cell - at).norm() < 1e-9, "{}", by_cell - at);
            let mount = sensor.mount();
            let by_core = (mount.pose * sensor.pinhole().point(x as f32, y as f32)).map(f64::from);
            assert!((t_5_n * nalgebra::Point3::from(by_core) - at).norm() < 2e-7);
        }
    }

    #[test]
    fn a_sensor_survives_its_file_and_opencv_s_part_of_it_is_a_camera() {
        let folder = folder("sensor");
        let path = file().save(&folder.join("sensor.yml")).unwrap();
        let read = SensorFile::load(&path).unwrap();
        assert_eq!((read.camera, read.slit, read.views), (file().camera, file().slit, 40));
        let off = read.t_5_c.inv_mul(&file().t_5_c);
        assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-7);
        assert_eq!(CameraFile::load(&path).unwrap(), file().camera);
    }

    #[test]
    fn what_is_wrong_with_a_calibration_is_said_by_field_value_and_range() {
        let error = |change: &dyn Fn(&mut SensorFile)| {
            let mut wrong = file();
            change(&mut wrong);
            format!(
                "{:#}",
                SensorFile::parse(&wrong.to_text()).expect_err("must be refused")
            )
        };
        assert_eq!(error(&|file| file.views = 2), "views 2: must be 3 to 150");
        assert_eq!(
            error(&|file| file.camera.width = 640),
            "image_width, image_height 640 x 450: must be 450 x 450 px, the start view's"
        );
        let in_mm = error(&|file| file.t_5_c.translation.vector *= 1e3);
        assert!(
            in_mm.starts_with("hand_eye: px ") && in_mm.ends_with(": must be within ±10 m"),
            "{in_mm}"
        );
        let in_mm = error(&|file| file.slit.distance_m *= 1e3);
        assert!(
            in_mm.starts_with("slit_plane: ") && in_mm.ends_with("(its distance is in m)"),
            "{in_mm}"
        );
        let far = error(&|file| file.t_5_c.translation.vector.x += 0.05);
        assert!(far.contains("mm off the drawing, must be at most 20"), "{far}");
        let turned = error(&|file| file.t_5_c.rotation *= UnitQuaternion::from_scaled_axis(Vector3::z() * 0.2));
        assert!(turned.contains(" off the drawing, must be at most "), "{turned}");
        let long = error(&|file| file.slit.normal *= 2.0);
        assert_eq!(long, "slit_plane: normal of length 2.0000, must be 1 within 0.001");
        let without = |name: &str| {
            let text = file().to_text().replace(name, "other");
            format!("{:#}", SensorFile::parse(&text).expect_err("must be refused"))
        };
        for name in ["views", "hand_eye", "slit_plane", "camera_matrix"] {
            assert_eq!(without(name), format!("{name}: missing"));
        }
    }
}
