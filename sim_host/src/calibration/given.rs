//! Measurements from files that a user gives: photographs of the board, the arm's poses, photographs of the slit.
//!
//! The poses' file has a line per photograph, in the photographs' order: the twelve numbers of `arm --pose`, rows of
//! [R p] with p in metres, the pose of Σ_5 in Σ_B, separated by commas or blanks. `#` begins a comment. The photographs of
//! a slit are taken at the same poses with that slit on, and no other; one for each, in the same order.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::board::Board;
use super::procedure::{Measurements, View};
use super::slit_plane::PLANES;
use super::{Pixel, chessboard, homography, photograph, slit_line};
use crate::image_file::GreyImage;

/// How far R·Rᵀ may be from the identity in a pose that is read: four digits of a pose pass.
const ORTHONORMAL: f64 = 1e-3;
/// Farthest position of a pose that is read, m: beyond every arm's reach it is millimetres.
const MAX_POSITION_M: f64 = 10.0;

/// The files.
#[derive(Clone, Debug)]
pub struct Files {
    /// Photographs of the board.
    pub images: Vec<PathBuf>,
    /// The arm's poses, if it moved the camera.
    pub poses: Option<PathBuf>,
    /// The same with one of the slits on; none, or as many.
    pub slit_images: [Vec<PathBuf>; PLANES],
}

/// A photograph that does not count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Its file.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// Reads the files and measures what they show. A photograph in which the board is not found is refused and the rest
/// goes on; a file that cannot be read, or is of another size than the first, is an error.
pub fn measure(files: &Files, board: &Board) -> Result<(Measurements, Vec<Refused>)> {
    let count = files.images.len();
    for (slit, images) in ["slit", "near slit", "far slit"].iter().zip(&files.slit_images) {
        ensure!(
            images.is_empty() || images.len() == count,
            "{slit} images {}: must be {count}, one for each image",
            images.len()
        );
    }
    let poses = files.poses.as_deref().map(|path| read_poses(path, count)).transpose()?;
    let mut size = None;
    let mut refused = Vec::new();
    let mut views = Vec::new();
    for (at, path) in files.images.iter().enumerate() {
        let image = photograph::read(path)?;
        let first = *size.get_or_insert((image.width, image.height));
        same_size(path, &image, first)?;
        let name = path.display().to_string();
        let corners = match chessboard::find(&image, board.grid) {
            Ok(corners) => corners,
            Err(error) => {
                refused.push(Refused {
                    name,
                    reason: format!("{error:#}"),
                });
                continue;
            }
        };
        let mut slits = [const { Vec::new() }; PLANES];
        for (slit, images) in slits.iter_mut().zip(&files.slit_images) {
            let Some(path) = images.get(at) else { continue };
            let lit = photograph::read(path)?;
            same_size(path, &lit, first)?;
            match slit_line::find(&lit, &image, on_board(board, &corners)?) {
                Ok(line) => *slit = line,
                Err(error) => refused.push(Refused {
                    name: path.display().to_string(),
                    reason: format!("{error:#}"),
                }),
            }
        }
        views.push(View {
            name,
            corners,
            t_b_5: poses.as_ref().map(|poses| poses[at]),
            slits,
        });
    }
    let size = size.context("images 0: must be at least 1")?;
    Ok((
        Measurements {
            board: *board,
            size,
            views,
            passes: [Vec::new(), Vec::new()],
        },
        refused,
    ))
}

fn same_size(path: &Path, image: &GreyImage, (width, height): (usize, usize)) -> Result<()> {
    ensure!(
        (image.width, image.height) == (width, height),
        "image {}: {} × {} px, must be {width} × {height} as the first",
        path.display(),
        image.width,
        image.height
    );
    Ok(())
}

/// Whether a pixel shows the board, its outer squares included.
fn on_board(board: &Board, corners: &[Pixel]) -> Result<impl Fn(&Pixel) -> bool> {
    let h = homography::plane_to_image(&board.points(), corners)?;
    let back = h.try_inverse().context("corners: the board is seen edge on")?;
    let (columns, rows, square) = (board.grid.columns as f64, board.grid.rows as f64, board.square_m);
    Ok(move |pixel: &Pixel| {
        let at = homography::apply(&back, pixel.x, pixel.y) / square;
        (-1.0..=columns).contains(&at.x) && (-1.0..=rows).contains(&at.y)
    })
}

/// The poses of a file, which must be `count`.
fn read_poses(path: &Path, count: usize) -> Result<Vec<Isometry3<f64>>> {
    let name = || format!("poses {}", path.display());
    let text = std::fs::read_to_string(path).with_context(|| format!("{}: cannot be read", name()))?;
    let poses = parse_poses(&text).with_context(name)?;
    ensure!(
        poses.len() == count,
        "{}: {} poses, must be {count}, one for each image",
        name(),
        poses.len()
    );
    Ok(poses)
}

fn parse_poses(text: &str) -> Result<Vec<Isometry3<f64>>> {
    let lines = text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line.split('#').next().unwrap_or("").trim()));
    lines
        .filter(|(_, line)| !line.is_empty())
        .map(|(number, line)| pose(line).with_context(|| format!("line {number}")))
        .collect()
}

fn pose(line: &str) -> Result<Isometry3<f64>> {
    let words = line.split([',', ' ', '\t', ';']).filter(|word| !word.is_empty());
    let numbers: Vec<f64> = words
        .map(|word| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => bail!("{word:?}: not a number"),
        })
        .collect::<Result<_>>()?;
    pose_of(&numbers)
}

/// The pose of these 12 numbers, rows of \[R p\], p in m; checked.
pub fn pose_of(numbers: &[f64]) -> Result<Isometry3<f64>> {
    ensure!(
        numbers.len() == 12,
        "{} numbers: must be 12, rows of [R p]",
        numbers.len()
    );
    let matrix = Matrix3::from_fn(|row, column| numbers[4 * row + column]);
    let position = Vector3::new(numbers[3], numbers[7], numbers[11]);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    ensure!(
        off <= ORTHONORMAL && matrix.determinant() > 0.0,
        "rotation is off by {off:.3}: must be orthonormal to {ORTHONORMAL} and right-handed"
    );
    for (axis, value) in ["x", "y", "z"].iter().zip(position.iter()) {
        ensure!(
            value.abs() <= MAX_POSITION_M,
            "p{axis} {value}: must be within ±{MAX_POSITION_M} m"
        );
    }
    let rotation =
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_eps(&matrix, 1e-14, 100, Rotation3::identity()));
    Ok(Isometry3::from_parts(position.into(), rotation))
}

#[cfg(test)]
mod tests {
    use super::super::board::Grid;
    use super::super::camera::{Camera, Distortion};
    use super::super::hand_eye::ArmAccuracy;
    use super::super::procedure::{self, Options};
    use super::super::rendered;
    use super::super::slit_plane::SlitPlane;
    use super::*;
    use crate::whole_file::tests::folder;

    fn error(text: &str) -> String {
        format!("{:#}", parse_poses(text).expect_err("must be refused"))
    }

    #[test]
    fn poses_are_read_as_twelve_numbers_a_line_with_comments() {
        let poses = parse_poses("# Σ_5 in Σ_B\n\n1 0 0 0.5, 0 -1 0 0.1, 0 0 -1 0.4 # down\n").expect("readable");
        assert_eq!(poses.len(), 1);
        assert_eq!(poses[0].translation.vector, Vector3::new(0.5, 0.1, 0.4));
        assert!((poses[0] * Vector3::z() + Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn a_pose_that_is_none_is_refused_with_its_line() {
        assert_eq!(
            error("1 0 0 0.5 0 -1 0 0.1 0 0 -1"),
            "line 1: 11 numbers: must be 12, rows of [R p]"
        );
        assert_eq!(error("\n1 0 0 x 0 1 0 0 0 0 1 0"), "line 2: \"x\": not a number");
        assert_eq!(
            error("1 0 0 0 0 1 0 0 0 0 -1 0"),
            "line 1: rotation is off by 0.000: must be orthonormal to 0.001 and right-handed"
        );
        assert_eq!(
            error("1 0 0 500 0 1 0 0 0 0 1 0"),
            "line 1: px 500: must be within ±10 m"
        );
    }

    const BOARD: Board = Board {
        grid: Grid { columns: 9, rows: 6 },
        square_m: 0.01,
    };
    const SIZE: (usize, usize) = (640, 480);

    /// Photographs of a board, the slit off and on, with a camera and a hand-eye transform known to the test only.
    #[test]
    fn camera_slit_and_hand_eye_come_out_of_photographs_and_poses() {
        let camera = Camera {
            fx: 800.0,
            fy: 802.0,
            cx: 322.0,
            cy: 238.0,
            distortion: [-0.1, 0.05, 0.0, 0.001, 0.0],
        };
        let t_5_c = Isometry3::new(Vector3::new(0.08, 0.002, 0.07), Vector3::new(0.02, -0.01, 0.03));
        let t_b_w = Isometry3::new(Vector3::new(0.5, 0.05, 0.02), Vector3::new(0.0, 0.05, 0.4));
        let normal = Vector3::new(1.0, 0.02, -0.9).normalize();
        let slit = SlitPlane {
            normal,
            distance_m: normal.z * 0.18,
        };
        let folder = folder("calibrate");
        let mut files = Files {
            images: Vec::new(),
            poses: Some(folder.join("poses.txt")),
            slit_images: Default::default(),
        };
        let mut poses = String::from("# Σ_5 in Σ_B\n");
        for view in 0..9_u32 {
            let azimuth = f64::from(view) * 2.4;
            let lean =
                Isometry3::rotation(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * (0.15 + 0.05 * f64::from(view)));
            let roll = Isometry3::rotation(Vector3::z() * f64::from(view) * 0.5);
            let facing = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
            let aim = Isometry3::translation(0.004, -0.003, 0.17 + 0.005 * f64::from(view));
            let t_c_w = aim * lean * roll * facing * Isometry3::from(-BOARD.centre().coords);
            let t_b_5 = t_b_w * (t_5_c * t_c_w).inverse();
            let matrix = t_b_5.to_homogeneous();
            let numbers: Vec<String> = (0..12).map(|at| matrix[(at / 4, at % 4)].to_string()).collect();
            poses += &(numbers.join(" ") + "\n");
            let write = |name: &str, slit: Option<&SlitPlane>, seed: u64| {
                let path = folder.join(format!("{name}{view}.png"));
                let image = rendered::photograph(&BOARD, &camera, SIZE, &t_c_w, slit, seed);
                std::fs::write(&path, image.to_png().expect("encoded")).expect("written");
                path
            };
            files.images.push(write("dark", None, u64::from(view)));
            files.slit_images[0].push(write("lit", Some(&slit), 100 + u64::from(view)));
        }
        std::fs::write(folder.join("poses.txt"), poses).expect("written");
        let (measured, refused) = measure(&files, &BOARD).expect("measured");
        assert_eq!(refused, []);
        let arm = ArmAccuracy {
            position_m: 0.000_02,
            turn_rad: 0.000_05,
        };
        let options = Options {
            distortion: Distortion::Full,
            camera: None,
            arm,
        };
        let found = procedure::calibrate(&measured, &options).expect("calibrated");
        assert!(found.rms_px < 0.15, "{} px", found.rms_px);
        assert!((found.camera.fx - camera.fx).abs() < 2.0, "{:?}", found.camera);
        let off = t_5_c.inv_mul(&found.hand_eye.expect("placed").t_5_c);
        assert!(
            off.translation.vector.norm() < 0.000_2 && off.rotation.angle().to_degrees() < 0.1,
            "{off}"
        );
        let plane = found.slits[0].as_ref().expect("a slit").plane;
        assert!(plane.normal.angle(&slit.normal).to_degrees() < 0.1, "{plane:?}");
        assert!((plane.crossing() - slit.crossing()).abs() < 0.000_2, "{plane:?}");
        let camera_only = Options {
            camera: Some(camera),
            ..options
        };
        let checked = procedure::calibrate(&measured, &camera_only).expect("checked");
        assert_eq!(checked.camera, camera);

        // What does not fit together is refused.
        let error = |files: &Files| format!("{:#}", measure(files, &BOARD).expect_err("refused"));
        let fewer = Files {
            images: files.images[1..].to_vec(),
            slit_images: Default::default(),
            ..files.clone()
        };
        assert!(
            error(&fewer).ends_with("9 poses, must be 8, one for each image"),
            "{}",
            error(&fewer)
        );
        let unlit = Files {
            slit_images: [files.slit_images[0][1..].to_vec(), Vec::new(), Vec::new()],
            ..files.clone()
        };
        assert_eq!(error(&unlit), "slit images 8: must be 9, one for each image");
        std::fs::write(folder.join("small.pgm"), b"P5 2 1 255 ab").expect("written");
        let mixed = Files {
            images: vec![files.images[0].clone(), folder.join("small.pgm")],
            poses: None,
            slit_images: Default::default(),
        };
        assert!(
            error(&mixed).ends_with("small.pgm: 2 × 1 px, must be 640 × 480 as the first"),
            "{}",
            error(&mixed)
        );
    }
}
