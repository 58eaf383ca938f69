//! The camera's numbers from several views of a chessboard.
//!
//! Start: focal lengths by Zhang's constraints with the principal point at the image's centre, where a lens has it to
//! within some tens of pixels, and no distortion. Then camera and views are refined together on the pixels.

use anyhow::{Context, Result, ensure};
use nalgebra::{DVector, Isometry3, Matrix2, Matrix3, Point3, Vector2};

use super::board::Board;
use super::camera::{Camera, Distortion, PARAMETERS};
use super::least_squares::{self, NormalEquations, Problem, Solution};
use super::{Pixel, homography, planar_pose};

/// Views that are needed: Zhang's constraints take two, and a third tells whether they agree.
pub const MIN_VIEWS: usize = 3;
/// Views that are taken: the dense solver's limit of about a thousand unknowns.
pub const MAX_VIEWS: usize = 150;
/// Least spread of the board's normals, rad. Assumed: below 5° the focal length rests on corner noise alone.
const MIN_NORMAL_SPREAD_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Focal lengths to begin at when nothing is known of it, in sides of the image: views of 53°, 19° and 6°.
const BLIND_FOCAL_LENGTHS: [f64; 3] = [1.0, 3.0, 10.0];

/// A calibrated camera.
#[derive(Clone, Debug)]
pub struct Intrinsics {
    /// The camera.
    pub camera: Camera,
    /// Standard deviation of each of its numbers, in the order of [`Camera::parameters`]; zero where it was held.
    pub deviations: [f64; PARAMETERS],
    /// Pose of the board in the camera, per view.
    pub t_c_w: Vec<Isometry3<f64>>,
    /// Root of the mean squared distance of a corner from where the model puts it, px: OpenCV's RMS.
    pub rms_px: f64,
    /// The same per view, px.
    pub view_rms_px: Vec<f64>,
}

/// Calibrates a camera with images of `size` (width, height) px from the corners of `board` in each view.
pub fn calibrate(
    board: &Board,
    size: (usize, usize),
    views: &[Vec<Pixel>],
    distortion: Distortion,
) -> Result<Intrinsics> {
    ensure!(
        (MIN_VIEWS..=MAX_VIEWS).contains(&views.len()),
        "views {}: must be {MIN_VIEWS} to {MAX_VIEWS} in which the board is found",
        views.len()
    );
    let points = board.points();
    for (at, view) in views.iter().enumerate() {
        ensure!(
            view.len() == points.len(),
            "view {}: {} corners, must be {}",
            at + 1,
            view.len(),
            points.len()
        );
    }
    let problem = Bundle {
        points: &points,
        views,
        free: distortion.free(),
    };
    let mut best: Option<Solution<State>> = None;
    for start in starts(&points, size, views)? {
        let solution = least_squares::solve(&problem, start).context("views: they do not determine the camera")?;
        if best.as_ref().is_none_or(|best| solution.rms < best.rms) {
            best = Some(solution);
        }
    }
    let Solution {
        state: (camera, t_c_w),
        rms: coordinate_rms,
        deviations,
    } = best.context("views: no start")?;
    let spread = normal_spread(&t_c_w);
    ensure!(
        spread >= MIN_NORMAL_SPREAD_RAD,
        "board tilts {:.1}°: must differ by at least {:.0}° over the views, or the focal length is a guess",
        spread.to_degrees(),
        MIN_NORMAL_SPREAD_RAD.to_degrees()
    );
    Ok(Intrinsics {
        camera,
        deviations: std::array::from_fn(|at| deviations[at]),
        // The solver's residuals are single coordinates; a corner has two.
        rms_px: coordinate_rms * std::f64::consts::SQRT_2,
        view_rms_px: t_c_w
            .iter()
            .zip(views)
            .map(|(pose, pixels)| rms(&camera, pose, &points, pixels))
            .collect(),
        t_c_w,
    })
}

/// Root of the mean squared distance of the board's corners from where the camera puts them, px.
pub fn rms(camera: &Camera, t_c_w: &Isometry3<f64>, points: &[Point3<f64>], pixels: &[Pixel]) -> f64 {
    let squares = points
        .iter()
        .zip(pixels)
        .map(|(point, pixel)| (camera.project(&(t_c_w * point)) - pixel).norm_squared());
    (squares.sum::<f64>() / points.len() as f64).sqrt()
}

/// Largest angle between the board's normals of two views, rad.
fn normal_spread(poses: &[Isometry3<f64>]) -> f64 {
    let normals: Vec<_> = poses
        .iter()
        .map(|pose| pose.rotation * nalgebra::Vector3::z())
        .collect();
    let angles = normals.iter().flat_map(|a| normals.iter().map(move |b| a.angle(b)));
    angles.fold(0.0, f64::max)
}

type State = (Camera, Vec<Isometry3<f64>>);

/// States to begin at: one, or where noise hides the focal length from Zhang's constraints, as in narrow views, one for each
/// of [`BLIND_FOCAL_LENGTHS`].
fn starts(points: &[Point3<f64>], size: (usize, usize), views: &[Vec<Pixel>]) -> Result<Vec<State>> {
    let centre = Vector2::new((size.0 as f64 - 1.0) / 2.0, (size.1 as f64 - 1.0) / 2.0);
    let numbered = |at: usize| move || format!("view {}", at + 1);
    let homographies: Vec<Matrix3<f64>> = views
        .iter()
        .enumerate()
        .map(|(at, pixels)| homography::plane_to_image(points, pixels).with_context(numbered(at)))
        .collect::<Result<_>>()?;
    let side = size.0.max(size.1) as f64;
    let focal_lengths = match focal_lengths(&homographies, &centre, side) {
        Some(found) => vec![found],
        None => BLIND_FOCAL_LENGTHS.map(|sides| (sides * side, sides * side)).to_vec(),
    };
    focal_lengths
        .into_iter()
        .map(|(fx, fy)| {
            let camera = Camera {
                fx,
                fy,
                cx: centre.x,
                cy: centre.y,
                distortion: [0.0; 5],
            };
            let pose = |(at, pixels): (usize, &Vec<Pixel>)| {
                planar_pose::linear(&camera, points, pixels).with_context(numbered(at))
            };
            Ok((camera, views.iter().enumerate().map(pose).collect::<Result<_>>()?))
        })
        .collect()
}

/// Focal lengths from the two constraints that each homography puts on them (Zhang, equations 3 and 4) when the
/// principal point is known: the images of the board's axes are orthogonal and equally long under ω = K⁻ᵀK⁻¹,
/// here diag(1/fx², 1/fy², 1). None where noise outweighs them. `unit` is a length in the image, px, by which the equations are scaled.
fn focal_lengths(homographies: &[Matrix3<f64>], centre: &Vector2<f64>, unit: f64) -> Option<(f64, f64)> {
    let to_unit = Matrix3::new_nonuniform_scaling(&Vector2::repeat(1.0 / unit)) * Matrix3::new_translation(&-centre);
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for h in homographies {
        let h = to_unit * h;
        let (a, b) = (h.column(0) / h.column(0).norm(), h.column(1) / h.column(1).norm());
        let (sum, difference) = (a + b, a - b);
        // Orthogonality, and orthogonality of the diagonals, which is equal length.
        for (p, q) in [(a, b), (sum, difference)] {
            let row = Vector2::new(p.x * q.x, p.y * q.y);
            matrix += row * row.transpose();
            right -= row * p.z * q.z;
        }
    }
    let omega = matrix.try_inverse()? * right;
    (omega.x > 0.0 && omega.y > 0.0).then(|| (unit / omega.x.sqrt(), unit / omega.y.sqrt()))
}

/// Camera and views refined together. Unknowns: the camera's numbers, then six per view.
struct Bundle<'a> {
    points: &'a [Point3<f64>],
    views: &'a [Vec<Pixel>],
    free: [bool; PARAMETERS],
}

impl Problem for Bundle<'_> {
    type State = State;

    fn unknowns(&self) -> usize {
        PARAMETERS + 6 * self.views.len()
    }

    fn linearise(&self, (camera, poses): &State, equations: &mut NormalEquations) {
        for (view, (pose, pixels)) in poses.iter().zip(self.views).enumerate() {
            for (point, pixel) in self.points.iter().zip(pixels) {
                let (image, by_camera, by_point) = camera.project_with_derivatives(&(pose * point));
                let by_pose = planar_pose::by_step(pose, point, &by_point);
                for axis in 0..2 {
                    let camera = (0..PARAMETERS)
                        .filter(|at| self.free[*at])
                        .map(|at| (at, by_camera[(axis, at)]));
                    let pose = (0..6).map(|at| (PARAMETERS + 6 * view + at, by_pose[(axis, at)]));
                    let derivatives: Vec<_> = camera.chain(pose).collect();
                    equations.add(image[axis] - pixel[axis], &derivatives);
                }
            }
        }
    }

    fn advance(&self, (camera, poses): &State, by: &DVector<f64>) -> State {
        let numbers = camera.parameters();
        let camera = Camera::from_parameters(std::array::from_fn(|at| numbers[at] + by[at]));
        let steps = by.as_slice()[PARAMETERS..].chunks_exact(6);
        (
            camera,
            poses
                .iter()
                .zip(steps)
                .map(|(pose, step)| planar_pose::step(pose, step))
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::board::Grid;
    use super::super::{chessboard, photograph};
    use super::*;

    const BOARD: Board = Board {
        grid: Grid { columns: 9, rows: 6 },
        square_m: 0.025,
    };
    const SIZE: (usize, usize) = (640, 480);
    const PHOTOGRAPHS: [&str; 13] = [
        "left01", "left02", "left03", "left04", "left05", "left06", "left07", "left08", "left09", "left11", "left12",
        "left13", "left14",
    ];

    /// Corners as OpenCV found them.
    fn opencv_corners() -> Vec<Vec<Pixel>> {
        let lines: Vec<Vec<&str>> = include_str!("testdata/opencv_corners.csv")
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.split(',').collect())
            .collect();
        let number = |text: &str| text.parse::<f64>().expect("a number");
        PHOTOGRAPHS
            .iter()
            .map(|name| {
                lines
                    .iter()
                    .filter(|line| line[0] == *name)
                    .map(|line| Pixel::new(number(line[1]), number(line[2])))
                    .collect()
            })
            .collect()
    }

    fn own_corners() -> Vec<Vec<Pixel>> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/calibration/testdata");
        PHOTOGRAPHS
            .iter()
            .map(|name| {
                let image = photograph::read(&folder.join(format!("{name}.jpg"))).expect("readable");
                chessboard::find(&image, BOARD.grid).unwrap_or_else(|error| panic!("{name}: {error:#}"))
            })
            .collect()
    }

    #[test]
    fn from_opencvs_corners_comes_opencvs_camera() {
        // cv2.calibrateCameraExtended of opencv-python-headless 5.0.0 on the same corners.
        let opencv = [
            532.82690517,
            532.94569316,
            342.48714074,
            233.85622157,
            -0.28088085,
            0.02517025,
            0.00121658,
            -0.00013549,
            0.16345131,
        ];
        let deviations = [
            0.437922586,
            0.458803997,
            0.462061304,
            0.509661199,
            5.42610015e-3,
            4.15820777e-2,
            1.11725086e-4,
            1.40445729e-4,
            8.87410164e-2,
        ];
        let views = [
            0.18924017, 0.17076674, 0.20730598, 0.19610684, 0.20640672, 0.1763071, 0.19701475, 0.25588803, 0.19787585,
            0.16268673, 0.20157254, 0.19065787, 0.17181612,
        ];
        let found = calibrate(&BOARD, SIZE, &opencv_corners(), Distortion::Full).expect("calibrated");
        assert!((found.rms_px - 0.19543103).abs() < 2e-6, "{} px", found.rms_px);
        for (at, number) in found.camera.parameters().iter().enumerate() {
            // The corners stand in the file to 0.0001 px: far below the deviation of what follows from them.
            assert!(
                (number - opencv[at]).abs() < 0.01 * deviations[at],
                "number {at}: {number}, OpenCV {}",
                opencv[at]
            );
            assert!(
                (found.deviations[at] / deviations[at] - 1.0).abs() < 0.01,
                "deviation {at}: {}",
                found.deviations[at]
            );
        }
        for (own, opencv) in found.view_rms_px.iter().zip(views) {
            assert!((own - opencv).abs() < 1e-4, "view: {own} px, OpenCV {opencv} px");
        }
    }

    #[test]
    fn the_photographs_give_opencvs_figures_with_corners_of_our_own() {
        let corners = own_corners();
        let found = calibrate(&BOARD, SIZE, &corners, Distortion::Full).expect("calibrated");
        assert!((found.rms_px / 0.195 - 1.0).abs() <= 0.01, "{} px", found.rms_px);
        assert!((found.camera.fx / 532.8 - 1.0).abs() <= 0.005, "{} px", found.camera.fx);
        assert!(
            found.view_rms_px.iter().all(|rms| *rms < 0.3),
            "{:?}",
            found.view_rms_px
        );
        // The same answer twice, bit for bit.
        assert_eq!(own_corners(), corners);
        let again = calibrate(&BOARD, SIZE, &corners, Distortion::Full).expect("calibrated");
        assert_eq!(again.camera, found.camera);
    }

    #[test]
    fn corners_of_our_own_are_opencvs_to_a_few_hundredths_of_a_pixel() {
        for (name, (own, opencv)) in PHOTOGRAPHS.iter().zip(own_corners().iter().zip(opencv_corners())) {
            // The order may differ: OpenCV's does not look at the colours.
            let nearest = |corner: &Pixel| own.iter().map(|other| (other - corner).norm()).fold(f64::MAX, f64::min);
            let worst = opencv.iter().map(nearest).fold(0.0, f64::max);
            assert!(worst < 0.05, "{name}: {worst} px");
        }
    }

    #[test]
    fn too_few_views_and_boards_that_all_lie_alike_are_refused() {
        let error = |views: &[Vec<Pixel>]| {
            format!(
                "{:#}",
                calibrate(&BOARD, SIZE, views, Distortion::Full).expect_err("refused")
            )
        };
        let corners = opencv_corners();
        assert_eq!(
            error(&corners[..2]),
            "views 2: must be 3 to 150 in which the board is found"
        );
        let alike = vec![corners[0].clone(); 4];
        let message = error(&alike);
        assert!(
            message.starts_with("board tilts 0.0°: must differ by at least 5°")
                || message.starts_with("views: they do not determine"),
            "{message}"
        );
        let short = [corners[0].clone(), corners[1][1..].to_vec(), corners[2].clone()];
        assert_eq!(error(&short), "view 2: 53 corners, must be 54");
    }
}
