//! A calibrated sensor as a job takes it: camera, slits and place on the hand, in a file and as the core describes them.
//!
//! The file is OpenCV's YAML of the camera ([`super::opencv_yaml`]) with more entries: `hand_eye`, the pose of the camera in Σ_5, rows
//! of \[R p\], p in m; `slit_plane`, the unit normal in Σ_C and the distance from the camera's centre, m, of the slit of the start view, by which a
//! sensor with one slit tracks too; `views`, in how many the board was found; and where they are known, `pair_planes`, the same
//! of the two slits of a sensor that has two, the nearer to the nozzle first; and `exposure_delay`, from the SYNC of an exposure to its middle, s, as
//! `latency` measures it. OpenCV passes over what it does not know.
//!
//! The core's Σ_S hangs on the camera: its origin is [`CAMERA_HEIGHT_M`] before the camera's centre on its axis, x as the image's, y up in the
//! image, z toward the camera. What mounting leaves is in T_n_s, in the scale, the principal point, and the slits' planes. The camera is calibrated
//! in the start view: the tracking view is the middle of that, and the view of two slits has its pixels binned to another size (assumed, because the paper
//! prints both sizes of one camera). All views
//! are through the same lens.

use anyhow::{Context, Result, bail, ensure};
use firmware::job::correction::SensorMount;
use firmware::vision::camera::Pinhole;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use super::camera::Camera;
use super::given;
use super::intrinsics::{MAX_VIEWS, MIN_VIEWS};
use super::lens::Lens;
use super::opencv_yaml::{CameraFile, matrix, number, put_matrix, scalar};
use super::simulated::{DRAWN_M, SENSOR_LEAD_M, SIZE, TOOL_M, Truth};
use super::slit_plane::SlitPlane;
use crate::camera::optics::{CAMERA_HEIGHT_M, Deviation, Optics, Slit};
use crate::seal::setup::pose;
use crate::whole_file;

/// Furthest that a sensor may be from where it is drawn, mm and degrees: more is another unit, another frame, or a bent bracket.
const OFF_MM: f64 = 20.0;
const OFF_DEG: f64 = 10.0;
/// Allowed error of a unit normal's length.
const UNIT: f64 = 1e-3;
/// Exposure delays that a controller reckons with, s: more is milliseconds.
pub const DELAY_S: std::ops::RangeInclusive<f64> = -0.005..=0.02;
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
    /// The plane of the start view's slit in Σ_C.
    pub slit: SlitPlane,
    /// Those of the seam sensor's two, if it has two.
    pub pair: Option<[SlitPlane; 2]>,
    /// Views that it was calibrated from.
    pub views: usize,
    /// From the SYNC of an exposure to its middle, s, if that was measured.
    pub exposure_delay_s: Option<f64>,
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
        let [slit] = planes(text, "slit_plane")?;
        let pair = has(text, "pair_planes")
            .then(|| planes(text, "pair_planes"))
            .transpose()?;
        let exposure_delay_s = has(text, "exposure_delay").then(|| delay(text)).transpose()?;
        let file = Self {
            camera,
            t_5_c,
            slit,
            pair,
            views,
            exposure_delay_s,
        };
        file.check()?;
        Ok(file)
    }

    fn check(&self) -> Result<()> {
        let sensor = self.geometry(1)?;
        sensor.check_mount()?;
        sensor.start.check("slit_plane")?;
        if self.pair.is_some() {
            let [near, far] = self.geometry(2)?.seam;
            near.check("pair_planes")?;
            far.check("pair_planes")?;
        }
        Ok(())
    }

    /// The file's text.
    pub fn to_text(&self) -> String {
        let mut text = self.camera.to_text();
        let pose = self.t_5_c.to_homogeneous();
        let rows: [f64; 12] = std::array::from_fn(|at| pose[(at / 4, at % 4)]);
        put_matrix(&mut text, "hand_eye", 3, &rows);
        let numbers = |plane: &SlitPlane| [plane.normal.x, plane.normal.y, plane.normal.z, plane.distance_m];
        put_matrix(&mut text, "slit_plane", 1, &numbers(&self.slit));
        if let Some(pair) = &self.pair {
            put_matrix(
                &mut text,
                "pair_planes",
                2,
                pair.map(|plane| numbers(&plane)).as_flattened(),
            );
        }
        text += &format!("views: {}\n", self.views);
        if let Some(delay) = self.exposure_delay_s {
            text += &format!("exposure_delay: {}\n", number(delay));
        }
        text
    }

    /// The sensor as a job takes it that tracks with so many slits, 1 or 2.
    pub fn geometry(&self, slits: u8) -> Result<SensorGeometry> {
        let seam = match (slits, self.pair) {
            (1, _) => None,
            (_, Some(pair)) => Some(pair),
            (_, None) => bail!("pair_planes: missing, must be there for a sensor with two slits"),
        };
        Ok(SensorGeometry::of(&self.camera.camera, &self.t_5_c, &self.slit, seam))
    }
}

/// Whether there is an entry `name`.
fn has(text: &str, name: &str) -> bool {
    text.lines()
        .any(|line| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(':')))
}

/// The planes of entry `name`, four numbers each.
fn planes<const N: usize>(text: &str, name: &str) -> Result<[SlitPlane; N]> {
    let numbers = matrix(text, name)?;
    ensure!(
        numbers.len() == 4 * N,
        "{name}: {} numbers, must be {}",
        numbers.len(),
        4 * N
    );
    let plane = |at: usize| {
        let [x, y, z, distance_m] = std::array::from_fn(|place| numbers[4 * at + place]);
        let normal = Vector3::new(x, y, z);
        SlitPlane { normal, distance_m }
    };
    let planes: [SlitPlane; N] = std::array::from_fn(plane);
    for SlitPlane { normal, .. } in planes {
        ensure!(
            (normal.norm() - 1.0).abs() <= UNIT,
            "{name}: normal of length {:.4}, must be 1 within {UNIT}",
            normal.norm()
        );
    }
    Ok(planes)
}

/// The entry `exposure_delay`.
fn delay(text: &str) -> Result<f64> {
    let entry = scalar(text, "exposure_delay")?;
    let delay: f64 = entry
        .parse()
        .with_context(|| format!("exposure_delay {entry:?}: not a number"))?;
    ensure!(
        DELAY_S.contains(&delay),
        "exposure_delay {delay}: must be {} to {} s",
        DELAY_S.start(),
        DELAY_S.end()
    );
    Ok(delay)
}

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
pub(crate) mod tests {
    use super::super::simulated;
    use super::*;
    use crate::whole_file::tests::folder;

    pub(crate) fn file() -> SensorFile {
        let truth = simulated::truth(7);
        SensorFile {
            camera: CameraFile {
                width: SIZE.0,
                height: SIZE.1,
                camera: truth.camera,
                rms_px: 0.1,
            },
            t_5_c: truth.t_5_c,
            slit: truth.slits[0],
            pair: Some([truth.slits[1], truth.slits[2]]),
            views: 40,
            exposure_delay_s: Some(0.005),
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

    #[test]
    fn a_sensor_survives_its_file_and_opencv_s_part_of_it_is_a_camera() {
        let folder = folder("sensor");
        let path = file().save(&folder.join("sensor.yml")).unwrap();
        let read = SensorFile::load(&path).unwrap();
        assert_eq!((read.camera, read.slit, read.views), (file().camera, file().slit, 40));
        assert_eq!((read.pair, read.exposure_delay_s), (file().pair, Some(0.005)));
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
        let one_of_two = error(&|file| file.pair.as_mut().unwrap()[1].distance_m *= 1e3);
        assert!(
            one_of_two.starts_with("pair_planes: ") && one_of_two.ends_with("(its distance is in m)"),
            "{one_of_two}"
        );
        let in_ms = error(&|file| file.exposure_delay_s = Some(5.0));
        assert_eq!(in_ms, "exposure_delay 5: must be -0.005 to 0.02 s");
        let one_slit = SensorFile { pair: None, ..file() };
        assert!(one_slit.geometry(1).is_ok());
        assert_eq!(
            one_slit.geometry(2).unwrap_err().to_string(),
            "pair_planes: missing, must be there for a sensor with two slits"
        );
        let without = |name: &str| {
            let text = file().to_text().replace(name, "other");
            format!("{:#}", SensorFile::parse(&text).expect_err("must be refused"))
        };
        for name in ["views", "hand_eye", "slit_plane", "camera_matrix"] {
            assert_eq!(without(name), format!("{name}: missing"));
        }
    }
}
