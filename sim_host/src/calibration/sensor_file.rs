//! The file in which a calibrated sensor travels.
//!
//! It is OpenCV's YAML of the camera ([`super::opencv_yaml`]) with more entries: `hand_eye`, the pose of the camera in Σ_5, rows
//! of \[R p\], p in m; `slit_plane`, the unit normal in Σ_C and the distance from the camera's centre, m, of the slit of the start view, by which a
//! sensor with one slit tracks too; `views`, in how many the board was found; and where they are known, `pair_planes`, the same
//! of the two slits of a sensor that has two, the nearer to the nozzle first; and `exposure_delay`, from the SYNC of an exposure to its middle, s, as
//! `latency` measures it. OpenCV passes over what it does not know.

use anyhow::{Context, Result, bail, ensure};
use nalgebra::{Isometry3, Vector3};
use std::path::{Path, PathBuf};

use super::given;
use super::intrinsics::{MAX_VIEWS, MIN_VIEWS};
use super::opencv_yaml::{CameraFile, has, matrix, number, put_matrix, scalar};
use super::sensor::SensorGeometry;
use super::simulated::SIZE;
use super::slit_plane::SlitPlane;
use crate::whole_file;

/// Allowed error of a unit normal's length.
const UNIT: f64 = 1e-3;
/// Exposure delays that a controller reckons with, s: more is milliseconds.
const DELAY_S: std::ops::RangeInclusive<f64> = -0.005..=0.02;

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
            "image_width, image_height {} × {}: must be {width} × {height} px, the start view's",
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
        file.geometry(1)?.check("slit_plane")?;
        if file.pair.is_some() {
            file.geometry(2)?.check("pair_planes")?;
        }
        Ok(file)
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

#[cfg(test)]
pub(crate) mod tests {
    use super::super::simulated;
    use super::*;
    use crate::whole_file::tests::folder;
    use nalgebra::UnitQuaternion;

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
            "image_width, image_height 640 × 450: must be 450 × 450 px, the start view's"
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
        let strong = error(&|file| file.camera.camera.distortion[0] = 1.0);
        assert!(
            strong.starts_with("distortion_coefficients: they move a pixel by ")
                && strong.ends_with(" % of half the image's diagonal, must be at most 5"),
            "{strong}"
        );
        // It moves the rays that would meet the corners without it, and about the middle, by 4.9 %; those that do meet them lie further out.
        let barrel = error(&|file| file.camera.camera.distortion = [-0.75, 0.0, 0.0, 0.0, 0.0]);
        assert!(
            barrel.starts_with("distortion_coefficients: they move a pixel by 6."),
            "{barrel}"
        );
        // To and fro within 5 %, but so fast that the camera's few steps do not follow.
        let winding = error(&|file| file.camera.camera.distortion = [5.0, -230.0, 0.0, 0.0, 2300.0]);
        assert!(
            winding.starts_with("distortion_coefficients: the camera's steps undo them to ")
                && winding.ends_with(" µm, must be at most 1"),
            "{winding}"
        );
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
