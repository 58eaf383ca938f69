//! Cameras in OpenCV's file format: the YAML that its `FileStorage` writes and reads.
//!
//! Read: `camera_matrix` and `distortion_coefficients` (4 or 5 numbers; more where these are zero) as OpenCV's calibration tools name them, with the
//! image's size; other entries are passed over. ROS writes the same without the type tag, so that is read as well.
//! Written: the form of OpenCV 2 to 4, which OpenCV 5 reads too.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use super::camera::Camera;
use crate::whole_file;

/// Largest image of a camera, px a side.
const MAX_SIDE: usize = 8192;
/// Largest focal length, px: 1 m in pixels of 2 µm is half of it.
const MAX_FOCAL_PX: f64 = 1e6;
/// Largest distortion coefficient; calibrated lenses stay below 10, but k3 of a narrow view may be wild.
const MAX_DISTORTION: f64 = 1e6;

/// A camera with the size of its images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFile {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The camera.
    pub camera: Camera,
    /// Root mean square distance of the corners that it was calibrated with, px; 0 where the file does not say.
    pub rms_px: f64,
}

impl CameraFile {
    /// Reads and checks the file `path`. The error is one line with file, field, value and range.
    pub fn load(path: &Path) -> Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("camera {}: cannot be read", path.display()))?;
        Self::parse(&text).with_context(|| format!("camera {}", path.display()))
    }

    /// Writes the file `path`, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<PathBuf> {
        whole_file::write(path, self.to_text().as_bytes())
    }

    /// Reads a file's text.
    pub fn parse(text: &str) -> Result<Self> {
        ensure!(
            text.starts_with("%YAML"),
            "not OpenCV's YAML: its first line must begin with %YAML"
        );
        let side = |name: &str| -> Result<usize> {
            let side: usize = scalar(text, name)?
                .parse()
                .with_context(|| format!("{name}: not a whole number"))?;
            ensure!(
                (1..=MAX_SIDE).contains(&side),
                "{name} {side}: must be 1 to {MAX_SIDE} px"
            );
            Ok(side)
        };
        let (width, height) = (side("image_width")?, side("image_height")?);
        let matrix = matrix(text, "camera_matrix")?;
        let &[fx, skew, cx, zero_a, fy, cy, zero_b, zero_c, one] = matrix.as_slice() else {
            bail!("camera_matrix: {} numbers, must be 9", matrix.len());
        };
        let zeros = [skew, zero_a, zero_b, zero_c];
        ensure!(
            one == 1.0 && zeros == [0.0; 4],
            "camera_matrix: must be [fx 0 cx; 0 fy cy; 0 0 1]"
        );
        for (name, value) in [("fx", fx), ("fy", fy)] {
            ensure!(
                value > 0.0 && value <= MAX_FOCAL_PX,
                "camera_matrix: {name} {value}: must be over 0, to {MAX_FOCAL_PX} px"
            );
        }
        for (name, value, side) in [("cx", cx, width as f64), ("cy", cy, height as f64)] {
            ensure!(
                (-side..=2.0 * side).contains(&value),
                "camera_matrix: {name} {value}: must be {} to {} px",
                -side,
                2.0 * side
            );
        }
        // Models with other meanings of the same numbers, as ROS and OpenCV's calibration program name them.
        for (name, taken) in [("distortion_model", "plumb_bob"), ("fisheye_model", "0")] {
            let model = if has(text, name) { scalar(text, name)? } else { taken };
            ensure!(
                model.trim_matches('"') == taken,
                "{name} {model}: must be {taken}, whose distortion_coefficients are k1 k2 p1 p2 k3"
            );
        }
        let given = self::matrix(text, "distortion_coefficients")?;
        ensure!(
            matches!(given.len(), 4 | 5 | 8 | 12 | 14),
            "distortion_coefficients: {} numbers, must be 4 or 5 (k1 k2 p1 p2 k3)",
            given.len()
        );
        let beyond = given.iter().skip(5).find(|value| **value != 0.0);
        ensure!(
            beyond.is_none(),
            "distortion_coefficients: {} numbers with {} past the fifth, must be 0: a lens is taken as k1 k2 p1 p2 k3",
            given.len(),
            beyond.unwrap_or(&0.0)
        );
        let wild = given.iter().find(|value| value.abs() > MAX_DISTORTION);
        ensure!(
            wild.is_none(),
            "distortion_coefficients: {}: must be within ±{MAX_DISTORTION}",
            wild.unwrap_or(&0.0)
        );
        let distortion = std::array::from_fn(|at| given.get(at).copied().unwrap_or(0.0));
        let rms_px = scalar(text, "avg_reprojection_error")
            .ok()
            .and_then(|text| text.parse().ok())
            .filter(|rms: &f64| rms.is_finite())
            .unwrap_or(0.0);
        Ok(Self {
            width,
            height,
            camera: Camera {
                fx,
                fy,
                cx,
                cy,
                distortion,
            },
            rms_px,
        })
    }

    /// The file's text.
    pub fn to_text(&self) -> String {
        let Camera {
            fx,
            fy,
            cx,
            cy,
            distortion,
        } = self.camera;
        let mut text = format!(
            "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n",
            self.width, self.height
        );
        put_matrix(
            &mut text,
            "camera_matrix",
            3,
            &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        );
        put_matrix(&mut text, "distortion_coefficients", 1, &distortion);
        text + &format!("avg_reprojection_error: {}\n", number(self.rms_px))
    }
}

/// A number as OpenCV writes it: enough digits for every f64, and never without a point.
pub(super) fn number(value: f64) -> String {
    format!("{value:.16e}")
}

pub(super) fn put_matrix(text: &mut String, name: &str, rows: usize, values: &[f64]) {
    let numbers: Vec<String> = values
        .chunks(3)
        .map(|line| line.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
        .collect();
    let columns = values.len() / rows;
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {} ]",
        numbers.join(",\n       ")
    );
}

/// Whether there is an entry `name`.
pub(super) fn has(text: &str, name: &str) -> bool {
    text.lines()
        .any(|line| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(':')))
}

/// What stands behind `name:` on a line of its own at the left edge.
pub(super) fn scalar<'a>(text: &'a str, name: &str) -> Result<&'a str> {
    let entry = |line: &'a str| line.strip_prefix(name)?.strip_prefix(':').map(str::trim);
    text.lines().find_map(entry).with_context(|| format!("{name}: missing"))
}

/// The numbers of the matrix `name`, row by row; their count is checked against its rows and columns.
pub(super) fn matrix(text: &str, name: &str) -> Result<Vec<f64>> {
    let head = |line: &str| line.strip_prefix(name).is_some_and(|rest| rest.starts_with(':'));
    let mut lines = text.lines().skip_while(|line| !head(line));
    let tag = lines.next().with_context(|| format!("{name}: missing"))?;
    let tag = tag[name.len() + 1..].trim();
    ensure!(
        tag.is_empty() || tag == "!!opencv-matrix",
        "{name}: {tag:?}: must be !!opencv-matrix"
    );
    // The entry goes as far as lines are indented.
    let body: Vec<&str> = lines.take_while(|line| line.starts_with(' ')).map(str::trim).collect();
    let count = |field: &str| -> Result<usize> {
        let entry = body.iter().find_map(|line| line.strip_prefix(field)?.strip_prefix(':'));
        let entry = entry.with_context(|| format!("{name}: {field} missing"))?.trim();
        entry
            .parse()
            .with_context(|| format!("{name}: {field} {entry:?}: not a whole number"))
    };
    let (rows, columns) = (count("rows")?, count("cols")?);
    let body = body.join(" ");
    let data = body
        .split_once("data:")
        .and_then(|(_, data)| data.trim().strip_prefix('[')?.split_once(']'));
    let (data, _) = data.with_context(|| format!("{name}: no data in square brackets"))?;
    let values: Vec<f64> = data
        .split(',')
        .map(|text| match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => bail!("{name}: {:?}: not a number", text.trim()),
        })
        .collect::<Result<_>>()?;
    ensure!(
        rows.checked_mul(columns) == Some(values.len()),
        "{name}: {} numbers, but {rows} rows and {columns} columns",
        values.len()
    );
    Ok(values)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::whole_file::tests::folder;

    const OPENCV_2: &str = include_str!("testdata/opencv_2_left_intrinsics.yml");
    const OPENCV_5: &str = include_str!("testdata/opencv_5_camera.yml");

    fn error(text: &str) -> String {
        format!("{:#}", CameraFile::parse(text).expect_err("must be refused"))
    }

    #[test]
    fn what_opencv_2_and_5_wrote_is_read() {
        let old = CameraFile::parse(OPENCV_2).expect("readable");
        assert_eq!((old.width, old.height), (640, 480));
        assert_eq!((old.camera.fx, old.camera.cy), (535.915733961632, 235.57082909788173));
        assert_eq!(old.camera.distortion[4], 0.23839153080878486);
        assert_eq!(old.rms_px, 0.39259098975581364);
        let new = CameraFile::parse(OPENCV_5).expect("readable");
        assert_eq!((new.camera.fx, new.camera.fy), (532.8269051686458, 532.9456931598785));
        assert_eq!(new.camera.distortion[3], -0.00013548704931108153);
    }

    #[test]
    fn a_camera_is_written_as_opencv_writes_it() {
        // Read back with opencv-python-headless 5.0.0, cv2.FileStorage: every number equal to the last bit.
        let camera = Camera {
            fx: 532.5,
            fy: 533.25,
            cx: 342.0,
            cy: 234.0,
            distortion: [-0.25, 0.125, 0.0, -0.0, 0.5],
        };
        let file = CameraFile {
            width: 640,
            height: 480,
            camera,
            rms_px: 0.1875,
        };
        assert_eq!(
            file.to_text(),
            "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
             data: [ 5.3250000000000000e2, 0.0000000000000000e0, 3.4200000000000000e2,\n       \
             0.0000000000000000e0, 5.3325000000000000e2, 2.3400000000000000e2,\n       \
             0.0000000000000000e0, 0.0000000000000000e0, 1.0000000000000000e0 ]\n\
             distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   \
             data: [ -2.5000000000000000e-1, 1.2500000000000000e-1, 0.0000000000000000e0,\n       \
             -0.0000000000000000e0, 5.0000000000000000e-1 ]\n\
             avg_reprojection_error: 1.8750000000000000e-1\n"
        );
        let folder = folder("camera");
        let path = file.save(&folder.join("camera.yml")).expect("written");
        assert_eq!(CameraFile::load(&path).expect("read"), file);
    }

    #[test]
    fn what_is_wrong_with_a_camera_is_said_by_field_value_and_range() {
        assert_eq!(
            error("image_width: 3"),
            "not OpenCV's YAML: its first line must begin with %YAML"
        );
        assert_eq!(error("%YAML:1.0\n---\n"), "image_width: missing");
        let changed = |from: &str, to: &str| error(&OPENCV_5.replacen(from, to, 1));
        assert_eq!(
            changed("image_height: 480", "image_height: 0"),
            "image_height 0: must be 1 to 8192 px"
        );
        assert_eq!(
            changed("532.82690516864579", "-5"),
            "camera_matrix: fx -5: must be over 0, to 1000000 px"
        );
        assert_eq!(
            changed("342.48714073602548", "1e4"),
            "camera_matrix: cx 10000: must be -640 to 1280 px"
        );
        assert_eq!(
            changed("0., 342", "2., 342"),
            "camera_matrix: must be [fx 0 cx; 0 fy cy; 0 0 1]"
        );
        assert_eq!(
            changed("532.82690516864579", ".Nan"),
            "camera_matrix: \".Nan\": not a number"
        );
        assert_eq!(
            changed("cols: 3", "cols: 4"),
            "camera_matrix: 9 numbers, but 3 rows and 4 columns"
        );
        assert_eq!(changed("camera_matrix", "other"), "camera_matrix: missing");
        let eight = OPENCV_5
            .replacen("cols: 5", "cols: 8", 1)
            .replacen("0.16345130649077289", "0.2, 0.1, 0., 0.", 1);
        assert_eq!(
            error(&eight),
            "distortion_coefficients: 8 numbers with 0.1 past the fifth, must be 0: a lens is taken as k1 k2 p1 p2 k3"
        );
        assert!(CameraFile::parse(&eight.replacen("0.2, 0.1", "0.2, 0.", 1)).is_ok());
        let fisheye = |line: &str| changed("distortion_coefficients", &format!("{line}\ndistortion_coefficients"));
        assert_eq!(
            fisheye("fisheye_model: 1"),
            "fisheye_model 1: must be 0, whose distortion_coefficients are k1 k2 p1 p2 k3"
        );
        assert_eq!(
            fisheye("distortion_model: \"equidistant\""),
            "distortion_model \"equidistant\": must be plumb_bob, whose distortion_coefficients are k1 k2 p1 p2 k3"
        );
        let cut = &OPENCV_5[..OPENCV_5.len() - 80];
        assert_eq!(error(cut), "distortion_coefficients: no data in square brackets");
    }

    proptest! {
        #[test]
        fn a_camera_survives_its_file(fx in 1.0..1e5_f64, cx in 0.0..640.0_f64, k in prop::array::uniform5(-9.0..9.0_f64)) {
            let camera = Camera { fx, fy: fx * 1.1, cx, cy: 7.0, distortion: k };
            let file = CameraFile { width: 640, height: 480, camera, rms_px: 0.1 };
            prop_assert_eq!(CameraFile::parse(&file.to_text()).unwrap(), file);
        }
    }
}
