//! Measurements as the simulated cell would give them, with the truth behind them.
//!
//! A small board lies before the arm; the arm looks at it from all sides, each time with the slit off and on; then the
//! sensor runs along a straight edge in both directions. Camera, slit and the sensor's place on the arm are near their
//! nominal values and off by what mounting leaves. Corners, line centres and arm poses are noisy; images are not rendered
//! here. The seed alone decides.

use anyhow::{Result, ensure};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

use super::board::{Board, Grid};
use super::camera::Camera;
use super::directions::Sighting;
use super::hand_eye::ArmAccuracy;
use super::procedure::{Measurements, View};
use super::slit_plane::{self, PLANES, SlitPlane};
use super::{Pixel, intrinsics};
use crate::camera::optics::{CAMERA_HEIGHT_M, Optics};

/// Image of the cell's camera, px: the paper's start view, 54 mm wide, of which the 250 px of its tracking view are the
/// middle. In those alone a turned camera looks too much like a shifted principal point.
pub const SIZE: (usize, usize) = (450, 450);
/// Length on the work per pixel at that height, m/px: the paper's, 54 mm on 450 px.
const SCALE_M_PER_PX: f64 = 0.000_12;
/// Nominal place of the camera in Σ_5, m: 80 mm ahead of the nozzle, 150 mm behind its tip, which is 220 mm out; its axes
/// are those of Σ_5. Assumed, as in the cell.
const EYE_M: [f64; 3] = [SENSOR_LEAD_M, 0.0, TOOL_M - CAMERA_HEIGHT_M];
/// How far ahead of the nozzle the sensor is drawn, m.
pub const SENSOR_LEAD_M: f64 = 0.080;
/// Nozzle tip in Σ_5, along its z axis, m.
pub const TOOL_M: f64 = 0.220;
/// Board: fills the 54 mm view at every roll, with squares of 17 px.
pub const BOARD: Board = Board {
    grid: Grid { columns: 19, rows: 12 },
    square_m: 0.002,
};
/// Views that it takes: in a narrow view only many corners tell a lens out of its axis from a turned camera. With 60 × 228 of them that is 0.04°, a
/// standard deviation over all three axes; without p1 and p2 it would be 0.02°, and 0.2° wrong.
pub const VIEWS: usize = 60;
/// Fewest views that show every slit as often as its plane needs, whatever the seed: with 14, one sensor of 300 is short of that; with 16 none.
pub const FEWEST_VIEWS: usize = 16;
/// The board's plate goes on beyond the corners for so many squares: the outer squares and a rim.
const RIM_SQUARES: f64 = 3.0;
/// Where the board's origin lies in Σ_B, m; it faces up.
const BOARD_M: [f64; 3] = [0.550, 0.050, 0.020];

/// What mounting leaves: standard deviations. Assumed: drilled holes and a printed holder.
const MOUNTING_M: f64 = 0.001;
const MOUNTING_RAD: f64 = 0.01;
/// Scatter of the lens: of its focal length (relative), principal point (px), and radial and tangential distortion. Assumed: a small fixed lens
/// of a machine-vision maker; in the start view's corner, 38 mm of work from the middle, k1 moves a pixel by 0.65 % of that, k2 by 0.2 %, a lens out
/// of its axis by 0.1 %. k3 is nothing that such a view shows.
const FOCAL_SCATTER: f64 = 0.005;
const PRINCIPAL_SCATTER_PX: f64 = 2.0;
const K1_SCATTER: f64 = 0.1;
const K2_SCATTER: f64 = 0.5;
const TANGENTIAL_SCATTER: f64 = 0.001;

/// Noise of a corner's coordinate and of a line centre, px. Assumed: what corner detection reaches on a sharp photograph.
pub const PIXEL_SIGMA: f64 = 0.1;
/// Noise of the arm's pose. Assumed: ±0.02 mm is the repeatability (ISO 9283) of small six-axis arms, and that over their
/// 0.4 m from elbow to flange is 0.05 mrad.
pub const ARM: ArmAccuracy = ArmAccuracy {
    position_m: 0.000_02,
    turn_rad: 0.000_05,
};

/// Distances from which the board is looked at, m: where the lens stays sharp. Assumed: 150 mm ± 10 %.
const DISTANCE_M: [f64; 2] = [0.120, 0.190];
/// Tilts of the view against the board's normal, rad. Assumed: flatter than 35° a corner loses contrast.
const TILT_RAD: [f64; 2] = [0.1, 0.7];
/// How far the view may miss the board's centre, m, and how often a view is drawn until all corners are in the image.
const MISS_M: f64 = 0.002;
const DRAWS: usize = 1000;
/// Margin about the image in which no corner is found, px: the window of the corner's refinement.
const MARGIN_PX: f64 = 6.0;

/// Centres of the slit's line lie so far apart on the board, m, about five rows, and so many to each side of the middle.
const SLIT_STEP_M: f64 = 0.000_6;
const SLIT_CENTRES: i32 = 100;
/// Sightings of the edge in each direction, how far apart (m), and how far off its nominal place the sensor runs (m).
const SIGHTINGS: usize = 20;
const SIGHTING_STEP_M: f64 = 0.010;
const WANDER_M: f64 = 0.003;

/// Where the slits' planes are drawn to meet z = 0 of Σ_S, m.
pub const DRAWN_M: [f64; PLANES] = [
    Optics::START.slits_m[0],
    Optics::TWO_SLITS.slits_m[0],
    Optics::TWO_SLITS.slits_m[1],
];

/// What really is.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// The camera.
    pub camera: Camera,
    /// Its place on the arm.
    pub t_5_c: Isometry3<f64>,
    /// The slits' planes.
    pub slits: [SlitPlane; PLANES],
}

/// The sensor of the cell of a seed, as it really is.
pub fn truth(seed: u64) -> Truth {
    draw(seed).0
}

/// That sensor, and what goes on drawing: for what is measured with its first slit, and for its other two.
fn draw(seed: u64) -> (Truth, [Random; 2]) {
    // Streams are keyed by (seed, run index). A calibration has one run; the two slits beside the first have a stream of their own, so that the
    // rest is the same whether somebody looks at them or not, and so has what the lens does beyond k1.
    let [mut random, mut beside, mut lens] = [0, 1, 2].map(|stream| Random(Pcg64::new(u128::from(seed), stream)));
    let (camera, t_5_c) = (random.camera(lens.beyond_k1()), random.place());
    let [first, near, far] = DRAWN_M;
    let slits = [random.slit(first), beside.slit(near), beside.slit(far)];
    (Truth { camera, t_5_c, slits }, [random, beside])
}

/// The cell of a seed, measured in `views` views.
pub fn cell(seed: u64, views: usize) -> Result<(Truth, Measurements)> {
    let range = intrinsics::MIN_VIEWS..=intrinsics::MAX_VIEWS;
    ensure!(
        range.contains(&views),
        "views {views}: must be {} to {}",
        range.start(),
        range.end()
    );
    let (truth, [mut random, mut beside]) = draw(seed);
    let t_b_w = Isometry3::new(BOARD_M.into(), Vector3::zeros());
    let mut seen = Vec::with_capacity(views);
    for view in 0..views {
        let Some(t_c_w) = (0..DRAWS)
            .map(|_| random.view(view, views))
            .find(|t_c_w| shows_board(&truth.camera, t_c_w))
        else {
            anyhow::bail!("seed {seed}: no view {} shows the whole board", view + 1);
        };
        let t_b_5 = t_b_w * t_c_w.inverse() * truth.t_5_c.inverse();
        let corners: Vec<Pixel> = BOARD
            .points()
            .into_iter()
            .map(|point| truth.camera.project(&(t_c_w * point)))
            .collect();
        let [first, near, far] = truth.slits.map(|slit| slit_line(&truth.camera, &slit, &t_c_w));
        seen.push(View {
            name: (view + 1).to_string(),
            corners: random.seen_all(corners),
            t_b_5: Some(random.said(&t_b_5)),
            slits: [random.seen_all(first), beside.seen_all(near), beside.seen_all(far)],
        });
    }
    let passes = [random.pass(&truth, 0.0)?, random.pass(&truth, PI)?];
    Ok((
        truth,
        Measurements {
            board: BOARD,
            size: SIZE,
            views: seen,
            passes,
        },
    ))
}

struct Random(Pcg64);

impl Random {
    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    fn normals(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal() * sigma)
    }

    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.0.random_range(low..=high)
    }

    fn seen(&mut self, pixel: Pixel) -> Pixel {
        Pixel::new(
            pixel.x + self.normal() * PIXEL_SIGMA,
            pixel.y + self.normal() * PIXEL_SIGMA,
        )
    }

    fn seen_all(&mut self, pixels: Vec<Pixel>) -> Vec<Pixel> {
        pixels.into_iter().map(|pixel| self.seen(pixel)).collect()
    }

    /// The pose that the arm says: where it is, and what it adds, in Σ_5.
    fn said(&mut self, t_b_5: &Isometry3<f64>) -> Isometry3<f64> {
        t_b_5 * Isometry3::new(self.normals(ARM.position_m), self.normals(ARM.turn_rad))
    }

    /// k2, p1, p2.
    fn beyond_k1(&mut self) -> [f64; 3] {
        [K2_SCATTER, TANGENTIAL_SCATTER, TANGENTIAL_SCATTER].map(|scatter| self.normal() * scatter)
    }

    fn camera(&mut self, [k2, p1, p2]: [f64; 3]) -> Camera {
        let focal = CAMERA_HEIGHT_M / SCALE_M_PER_PX * (1.0 + self.normal() * FOCAL_SCATTER);
        let centre = |size: usize| (size as f64 - 1.0) / 2.0;
        Camera {
            fx: focal,
            fy: focal,
            cx: centre(SIZE.0) + self.normal() * PRINCIPAL_SCATTER_PX,
            cy: centre(SIZE.1) + self.normal() * PRINCIPAL_SCATTER_PX,
            distortion: [self.normal() * K1_SCATTER, k2, p1, p2, 0.0],
        }
    }

    /// Of the camera on the arm.
    fn place(&mut self) -> Isometry3<f64> {
        Isometry3::new(
            Vector3::from(EYE_M) + self.normals(MOUNTING_M),
            self.normals(MOUNTING_RAD),
        )
    }

    /// A slit that is drawn `ahead` (m) of the camera's axis at the camera's height over the work, at 45° to it (z away from the camera).
    fn slit(&mut self, ahead: f64) -> SlitPlane {
        let angle = FRAC_PI_4;
        let turn = UnitQuaternion::from_scaled_axis(self.normals(MOUNTING_RAD));
        let normal = turn * Vector3::new(angle.cos(), 0.0, -angle.sin());
        let through = Vector3::new(ahead, 0.0, CAMERA_HEIGHT_M) + self.normals(MOUNTING_M);
        SlitPlane {
            normal,
            distance_m: normal.dot(&through),
        }
    }

    /// Pose of the board in the camera for one of `views`: directions spread by the golden angle, roll, distance and aim
    /// at random.
    fn view(&mut self, view: usize, views: usize) -> Isometry3<f64> {
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653; // π(3 − √5): spreads any number of directions evenly
        let azimuth = view as f64 * GOLDEN_ANGLE;
        let rank = (view as f64 + 0.5) / views as f64;
        let tilt = TILT_RAD[0] + (TILT_RAD[1] - TILT_RAD[0]) * rank;
        let lean = UnitQuaternion::from_scaled_axis(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt);
        let roll = UnitQuaternion::from_scaled_axis(Vector3::z() * self.between([0.0, TAU]));
        // The board's z points up, toward the camera, whose z points down.
        let facing = UnitQuaternion::from_scaled_axis(Vector3::x() * PI);
        let rotation = lean * roll * facing;
        let aim = Vector3::new(
            self.between([-MISS_M, MISS_M]),
            self.between([-MISS_M, MISS_M]),
            self.between(DISTANCE_M),
        );
        Isometry3::from_parts(Translation3::from(aim - rotation * BOARD.centre().coords), rotation)
    }

    /// One run along a straight edge, which lies along x of Σ_B; the tool is turned about its axis by `heading`.
    fn pass(&mut self, truth: &Truth, heading: f64) -> Result<Vec<Sighting>> {
        let edge = |at: f64| Point3::new(BOARD_M[0] + at, BOARD_M[1] - 0.1, BOARD_M[2]);
        let nominal = UnitQuaternion::from_scaled_axis(Vector3::z() * heading)
            * UnitQuaternion::from_scaled_axis(Vector3::x() * PI);
        let mut sightings = Vec::with_capacity(SIGHTINGS);
        for index in 0..SIGHTINGS {
            let at = (index as f64 - SIGHTINGS as f64 / 2.0) * SIGHTING_STEP_M;
            let turn = UnitQuaternion::from_scaled_axis(self.normals(MOUNTING_RAD)) * nominal;
            let wander = Vector3::from_fn(|_, _| self.between([-WANDER_M, WANDER_M]));
            // The nominal sensor would look straight at the edge.
            let looks_at = Vector3::from(EYE_M) + Vector3::z() * CAMERA_HEIGHT_M;
            let t_b_5 = Isometry3::from_parts((edge(at).coords + wander - turn * looks_at).into(), turn);
            let t_c_b = (t_b_5 * truth.t_5_c).inverse();
            // Where the edge goes through the slit's plane.
            let (start, along) = (t_c_b * edge(at), t_c_b * Vector3::x());
            let [SlitPlane { normal, distance_m }, ..] = truth.slits;
            let ahead = (distance_m - normal.dot(&start.coords)) / normal.dot(&along);
            let pixel = truth.camera.project(&(start + along * ahead));
            ensure!(
                in_image(&pixel),
                "seed: its edge leaves the image at sighting {}",
                index + 1
            );
            sightings.push(Sighting {
                t_b_5: self.said(&t_b_5),
                pixel: self.seen(pixel),
            });
        }
        Ok(sightings)
    }
}

fn in_image(pixel: &Pixel) -> bool {
    let inside = |at: f64, size: usize| (MARGIN_PX..=size as f64 - 1.0 - MARGIN_PX).contains(&at);
    inside(pixel.x, SIZE.0) && inside(pixel.y, SIZE.1)
}

fn shows_board(camera: &Camera, t_c_w: &Isometry3<f64>) -> bool {
    BOARD
        .points()
        .iter()
        .all(|point| in_image(&camera.project(&(t_c_w * point))))
}

/// Where a slit lights the board's plate, px: centres a few rows apart, as far as plate and image go. None where that is
/// too little to be a line.
fn slit_line(camera: &Camera, slit: &SlitPlane, t_c_w: &Isometry3<f64>) -> Vec<Pixel> {
    let normal = t_c_w.rotation * Vector3::z();
    let distance = normal.dot(&t_c_w.translation.vector);
    // The line in which board and slit meet: its direction, and its point nearest to the camera.
    let direction = normal.cross(&slit.normal);
    let foot = (slit.normal.cross(&direction) * distance + direction.cross(&normal) * slit.distance_m)
        / direction.norm_squared();
    let along = direction.normalize();
    let centres: Vec<Pixel> = (-SLIT_CENTRES..=SLIT_CENTRES)
        .map(|at| Point3::from(foot + along * (at as f64 * SLIT_STEP_M)))
        .filter(|point| on_plate(&t_c_w.inverse_transform_point(point)))
        .map(|point| camera.project(&point))
        .filter(in_image)
        .collect();
    if centres.len() < slit_plane::MIN_PIXELS {
        Vec::new()
    } else {
        centres
    }
}

/// Whether a point of the board's plane, in Σ_W, is on its plate: [`RIM_SQUARES`] wider than the corners.
fn on_plate(point: &Point3<f64>) -> bool {
    let off = point - BOARD.centre();
    let half = |corners: usize| ((corners - 1) as f64 / 2.0 + RIM_SQUARES) * BOARD.square_m;
    off.x.abs() <= half(BOARD.grid.columns) && off.y.abs() <= half(BOARD.grid.rows)
}
