//! The whole calibration: from what was measured in each view to what is asked of it.

use anyhow::{Context, Result, ensure};
use nalgebra::Isometry3;

use super::board::Board;
use super::camera::{Camera, Distortion, PARAMETERS};
use super::directions::{self, Agreement, Sensor, Sighting};
use super::hand_eye::{self, ArmAccuracy, HandEye, Station};
use super::slit_plane::{self, FittedSlit, PLANES, SlitView};
use super::{Pixel, intrinsics, planar_pose};

/// Least standard deviation of a corner's coordinate that is believed, px: exact corners must not outweigh the arm.
const MIN_PIXEL_SIGMA: f64 = 0.02;

/// One view of the board.
#[derive(Clone, Debug)]
pub struct View {
    /// What a reader knows it by: the image file, or its number.
    pub name: String,
    /// The board's corners, px.
    pub corners: Vec<Pixel>,
    /// Pose of Σ_5 in Σ_B, where the arm said it.
    pub t_b_5: Option<Isometry3<f64>>,
    /// Centres of each slit's line on the board, px; empty where the slit was not looked at.
    pub slits: [Vec<Pixel>; PLANES],
}

/// All that was measured.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// The board.
    pub board: Board,
    /// Width and height of the images, px.
    pub size: (usize, usize),
    /// The views in which it was found.
    pub views: Vec<View>,
    /// One seam travelling along +x, and along −x; empty where none was measured.
    pub passes: [Vec<Sighting>; 2],
}

/// How to calibrate.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// What the lens may do.
    pub distortion: Distortion,
    /// A camera that is taken as it is, instead of being estimated.
    pub camera: Option<Camera>,
    /// How well the arm knows where it is.
    pub arm: ArmAccuracy,
}

/// What came out; what was not measured is absent.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// Standard deviation of each of its numbers, from the board alone; zero where held.
    pub deviations: [f64; PARAMETERS],
    /// Root of the mean squared distance of a corner from where the camera puts it, px.
    pub rms_px: f64,
    /// The same per view, px.
    pub view_rms_px: Vec<f64>,
    /// Where the camera sits on the arm.
    pub hand_eye: Option<HandEye>,
    /// The slits' planes; the views of each are those with its line.
    pub slits: [Option<FittedSlit>; PLANES],
    /// Both directions of travel against each other.
    pub agreement: Option<Agreement>,
}

/// Calibrates what the measurements allow.
pub fn calibrate(measured: &Measurements, options: &Options) -> Result<Calibration> {
    let board = &measured.board;
    let mut found = match options.camera {
        Some(camera) => check(measured, camera)?,
        None => {
            let corners: Vec<Vec<Pixel>> = measured.views.iter().map(|view| view.corners.clone()).collect();
            let from_views = intrinsics::calibrate(board, measured.size, &corners, options.distortion)?;
            Found {
                camera: from_views.camera,
                deviations: from_views.deviations,
                view_rms_px: from_views.view_rms_px,
                t_c_w: from_views.t_c_w,
            }
        }
    };
    let stations: Option<Vec<Station>> = measured
        .views
        .iter()
        .map(|view| {
            Some(Station {
                t_b_5: view.t_b_5?,
                pixels: view.corners.clone(),
            })
        })
        .collect();
    let hand_eye = match stations {
        Some(stations) if !stations.is_empty() => {
            let free = options
                .camera
                .map_or(options.distortion.free(), |_| [false; PARAMETERS]);
            let sigma = (rms(&found.view_rms_px) / std::f64::consts::SQRT_2).max(MIN_PIXEL_SIGMA);
            let placed = hand_eye::calibrate(board, &found.camera, free, &stations, options.arm, sigma)?;
            found.camera = placed.camera;
            found.view_rms_px.clone_from(&placed.view_rms_px);
            found.t_c_w.clone_from(&placed.t_c_w);
            Some(placed)
        }
        _ => None,
    };
    let mut slits = [const { None }; PLANES];
    for (at, slit) in slits.iter_mut().enumerate() {
        let lines = measured.views.iter().map(|view| &view.slits[at]).zip(&found.t_c_w);
        let lit: Vec<SlitView> = lines
            .filter(|(pixels, _)| !pixels.is_empty())
            .map(|(pixels, t_c_w)| SlitView {
                t_c_w: *t_c_w,
                pixels: pixels.clone(),
            })
            .collect();
        if !lit.is_empty() {
            *slit = Some(slit_plane::fit(&found.camera, &lit)?);
        }
    }
    let [forward, backward] = &measured.passes;
    let agreement = match (&hand_eye, &slits[0]) {
        (Some(hand_eye), Some(slit)) if !forward.is_empty() => {
            let sensor = Sensor {
                camera: hand_eye.camera,
                t_5_c: hand_eye.t_5_c,
                slit: slit.plane,
            };
            Some(directions::compare(&sensor, forward, backward)?)
        }
        _ => None,
    };
    Ok(Calibration {
        camera: found.camera,
        deviations: found.deviations,
        rms_px: rms(&found.view_rms_px),
        view_rms_px: found.view_rms_px,
        hand_eye,
        slits,
        agreement,
    })
}

/// The camera and its views, as far as they are known.
struct Found {
    camera: Camera,
    deviations: [f64; PARAMETERS],
    view_rms_px: Vec<f64>,
    t_c_w: Vec<Isometry3<f64>>,
}

/// How a given camera explains the views.
fn check(measured: &Measurements, camera: Camera) -> Result<Found> {
    ensure!(
        !measured.views.is_empty(),
        "views 0: must be at least 1 in which the board is found"
    );
    let points = measured.board.points();
    let pose = |view: &View| {
        planar_pose::estimate(&camera, &points, &view.corners).with_context(|| format!("view {}", view.name))
    };
    let t_c_w: Vec<Isometry3<f64>> = measured.views.iter().map(pose).collect::<Result<_>>()?;
    let rms_px = measured
        .views
        .iter()
        .zip(&t_c_w)
        .map(|(view, t_c_w)| intrinsics::rms(&camera, t_c_w, &points, &view.corners));
    Ok(Found {
        camera,
        deviations: [0.0; PARAMETERS],
        view_rms_px: rms_px.collect(),
        t_c_w,
    })
}

/// Root mean square; all views have the same number of corners.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
