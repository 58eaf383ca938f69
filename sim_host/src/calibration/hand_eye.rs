//! Where the camera sits on the arm, from robot poses and the board seen at each.
//!
//! Start: Park and Martin's closed form on the relative motions (`closed_form`). Refinement: one least-squares problem on the corners'
//! pixels (`chain`), whose unknowns are the camera, its place on the arm, the board's place in the base, and for every station how
//! far the arm was from where it says; the last are held near zero by the arm's stated accuracy. The camera's numbers are
//! refined with the rest because in a narrow view only the arm's motion tells a shifted principal point from a turned
//! camera.

mod chain;
mod closed_form;

use anyhow::{Context, Result, ensure};
use nalgebra::Isometry3;

use super::board::Board;
use super::camera::{Camera, PARAMETERS};
use super::{Pixel, intrinsics, least_squares, planar_pose};
use chain::{Chain, EYE, State};

/// Stations that are needed: three poses give two motions, the least that determine the transform.
pub const MIN_STATIONS: usize = 3;
/// How far the arm may be from where it says that it is: standard deviations per axis.
#[derive(Clone, Copy, Debug)]
pub struct ArmAccuracy {
    /// Of the position, m.
    pub position_m: f64,
    /// Of the orientation, rad.
    pub turn_rad: f64,
}

/// One station: the arm's pose and the corners seen there.
#[derive(Clone, Debug)]
pub struct Station {
    /// Pose of Σ_5 in Σ_B, as the arm says.
    pub t_b_5: Isometry3<f64>,
    /// The board's corners in its order, px.
    pub pixels: Vec<Pixel>,
}

/// How well arm and image agree about where the board is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// Distance of the board's centre, m.
    pub position_m: f64,
    /// Angle between the boards, rad.
    pub turn_rad: f64,
}

/// A camera placed on the arm.
#[derive(Clone, Debug)]
pub struct HandEye {
    /// Pose of the camera in Σ_5.
    pub t_5_c: Isometry3<f64>,
    /// How far that may be off: standard deviation over all three axes, from the noise of corners and arm.
    pub deviation: Disagreement,
    /// Pose of the board in Σ_B.
    pub t_b_w: Isometry3<f64>,
    /// The camera, refined.
    pub camera: Camera,
    /// Pose of the board in the camera at every station, from arm and image together.
    pub t_c_w: Vec<Isometry3<f64>>,
    /// Root mean square distance of the corners from where the camera puts them, per station, px; the board's pose there
    /// from its image alone.
    pub view_rms_px: Vec<f64>,
    /// Arm against image, per station.
    pub stations: Vec<Disagreement>,
    /// Root mean square of them.
    pub residual: Disagreement,
}

/// Places a camera on the arm. `free` says which of the camera's numbers are refined, `pixel_sigma` is the standard
/// deviation of a corner's coordinate, px.
pub fn calibrate(
    board: &Board,
    camera: &Camera,
    free: [bool; PARAMETERS],
    stations: &[Station],
    arm: ArmAccuracy,
    pixel_sigma: f64,
) -> Result<HandEye> {
    ensure!(
        (MIN_STATIONS..=intrinsics::MAX_VIEWS).contains(&stations.len()),
        "stations {}: must be {MIN_STATIONS} to {}",
        stations.len(),
        intrinsics::MAX_VIEWS
    );
    let points = board.points();
    let seen: Vec<Isometry3<f64>> = poses(camera, board, stations)?;
    let t_5_c = closed_form::place(stations, &seen)?;
    let t_b_w = stations[0].t_b_5 * t_5_c * seen[0];
    let problem = Chain {
        points: &points,
        stations,
        free,
        arm,
        pixel_sigma,
    };
    let begin = State {
        camera: *camera,
        t_5_c,
        t_b_w,
        slips: vec![Isometry3::identity(); stations.len()],
    };
    let solution = least_squares::solve(&problem, begin).context("stations: they do not place the camera")?;
    let found = solution.state;
    let deviation = |begin: usize| {
        let squares = solution.deviations[begin..begin + 3]
            .iter()
            .map(|deviation| deviation * deviation);
        squares.sum::<f64>().sqrt()
    };
    let seen = poses(&found.camera, board, stations)?;
    let joint = |(station, slip): (&Station, &Isometry3<f64>)| {
        found.t_5_c.inverse() * slip * station.t_b_5.inverse() * found.t_b_w
    };
    let rms_px =
        |(station, seen): (&Station, &Isometry3<f64>)| intrinsics::rms(&found.camera, seen, &points, &station.pixels);
    let disagreements: Vec<Disagreement> = stations
        .iter()
        .zip(&seen)
        .map(|(station, seen)| {
            let said = (station.t_b_5 * found.t_5_c).inv_mul(&found.t_b_w);
            Disagreement {
                position_m: (said * board.centre() - seen * board.centre()).norm(),
                turn_rad: said.rotation.angle_to(&seen.rotation),
            }
        })
        .collect();
    let rms = |value: fn(&Disagreement) -> f64| {
        (disagreements.iter().map(|station| value(station).powi(2)).sum::<f64>() / stations.len() as f64).sqrt()
    };
    Ok(HandEye {
        t_5_c: found.t_5_c,
        deviation: Disagreement {
            position_m: deviation(EYE + 3),
            turn_rad: deviation(EYE),
        },
        t_b_w: found.t_b_w,
        camera: found.camera,
        residual: Disagreement {
            position_m: rms(|station| station.position_m),
            turn_rad: rms(|station| station.turn_rad),
        },
        t_c_w: stations.iter().zip(&found.slips).map(joint).collect(),
        view_rms_px: stations.iter().zip(&seen).map(rms_px).collect(),
        stations: disagreements,
    })
}

fn poses(camera: &Camera, board: &Board, stations: &[Station]) -> Result<Vec<Isometry3<f64>>> {
    let points = board.points();
    let pose = |(at, station): (usize, &Station)| {
        planar_pose::estimate(camera, &points, &station.pixels).with_context(|| format!("station {}", at + 1))
    };
    stations.iter().enumerate().map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::super::camera::Distortion;
    use super::super::simulated::{self, ARM, BOARD};
    use super::*;
    use nalgebra::Vector3;

    fn stations(seed: u64, views: usize) -> (simulated::Truth, Vec<Station>) {
        let (truth, measured) = simulated::cell(seed, views).expect("a cell");
        let station = |view: super::super::procedure::View| {
            Some(Station {
                t_b_5: view.t_b_5?,
                pixels: view.corners,
            })
        };
        (truth, measured.views.into_iter().filter_map(station).collect())
    }

    fn place(camera: &Camera, stations: &[Station]) -> Result<HandEye> {
        calibrate(
            &BOARD,
            camera,
            Distortion::Brown.free(),
            stations,
            ARM,
            simulated::PIXEL_SIGMA,
        )
    }

    #[test]
    fn without_noise_the_transform_is_exact_whatever_it_is() {
        let (truth, mut noisy) = stations(1, 8);
        let t_b_w = Isometry3::new(Vector3::new(0.5, 0.1, 0.0), Vector3::new(0.1, 0.2, 0.3));
        let t_5_c = Isometry3::new(Vector3::new(0.03, -0.2, 0.11), Vector3::new(1.5, -0.7, 0.4));
        for station in &mut noisy {
            let t_c_w = planar_pose::estimate(&truth.camera, &BOARD.points(), &station.pixels).expect("a pose");
            station.pixels = BOARD
                .points()
                .iter()
                .map(|point| truth.camera.project(&(t_c_w * point)))
                .collect();
            station.t_b_5 = t_b_w * t_c_w.inverse() * t_5_c.inverse();
        }
        let found = place(&truth.camera, &noisy).expect("placed");
        let off = t_5_c.inv_mul(&found.t_5_c);
        assert!(
            off.translation.vector.norm() < 1e-7 && off.rotation.angle() < 1e-7,
            "{off}"
        );
        assert!(
            found.residual.position_m < 1e-7 && found.residual.turn_rad < 1e-6,
            "{:?}",
            found.residual
        );
    }

    #[test]
    fn turns_about_one_axis_only_are_refused() {
        let (truth, stations) = stations(1, 6);
        let first = &stations[0];
        // The arm rolls about its last axis: the camera could be anywhere along it.
        let rolled: Vec<Station> = (0..6)
            .map(|at| {
                let roll = Isometry3::rotation(Vector3::z() * 0.3 * f64::from(at));
                let t_b_5 = first.t_b_5 * roll;
                let t_c_w = (t_b_5 * truth.t_5_c).inv_mul(&Isometry3::translation(0.55, 0.05, 0.02));
                let pixels = BOARD
                    .points()
                    .iter()
                    .map(|point| truth.camera.project(&(t_c_w * point)))
                    .collect();
                Station { t_b_5, pixels }
            })
            .collect();
        let message = place(&truth.camera, &rolled).expect_err("refused").to_string();
        assert!(
            message.starts_with("robot turns about a second axis 0.0°: must be at least 5° (rms)"),
            "{message}"
        );
        let few = place(&truth.camera, &stations[..2]).expect_err("refused").to_string();
        assert_eq!(few, "stations 2: must be 3 to 150");
    }
}
