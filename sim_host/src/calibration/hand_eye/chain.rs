//! The chain from the base over arm and camera to the board's corners in the image, as one least-squares problem.

use nalgebra::{DVector, Isometry3, Matrix2x3, Point3};

use super::{ArmAccuracy, Station};
use crate::calibration::camera::{Camera, PARAMETERS};
use crate::calibration::least_squares::{NormalEquations, Problem};
use crate::calibration::planar_pose::{self, ByPose};

/// What is sought.
#[derive(Clone)]
pub struct State {
    /// The camera.
    pub camera: Camera,
    /// Its pose in Σ_5.
    pub t_5_c: Isometry3<f64>,
    /// The board's pose in Σ_B.
    pub t_b_w: Isometry3<f64>,
    /// How far the arm was from where it said, in Σ_5, by station.
    pub slips: Vec<Isometry3<f64>>,
}

/// Where the blocks of unknowns begin: the camera's numbers, then six each for camera, board and every station.
pub const EYE: usize = PARAMETERS;
const BOARD: usize = EYE + 6;
const SLIPS: usize = BOARD + 6;

/// Derivative, by a [`planar_pose::step`] of `frame`, of what depends by `by_outer` on an outer point that the frame looks at:
/// as the frame moves, the point moves the other way.
fn by_step_of_frame(frame: &Isometry3<f64>, outer: &Point3<f64>, by_outer: &Matrix2x3<f64>) -> ByPose {
    let arm = outer.coords - frame.translation.vector;
    let mut by_step = ByPose::zeros();
    by_step
        .fixed_view_mut::<2, 3>(0, 0)
        .copy_from(&(by_outer * arm.cross_matrix()));
    by_step.fixed_view_mut::<2, 3>(0, 3).copy_from(&-by_outer);
    by_step
}

/// What is known.
pub struct Chain<'a> {
    /// The board's corners in Σ_W, m.
    pub points: &'a [Point3<f64>],
    /// Where the arm was, and what was seen there.
    pub stations: &'a [Station],
    /// Which of the camera's numbers are refined.
    pub free: [bool; PARAMETERS],
    /// How well the arm knows where it is.
    pub arm: ArmAccuracy,
    /// Standard deviation of a corner's coordinate, px.
    pub pixel_sigma: f64,
}

impl Problem for Chain<'_> {
    type State = State;

    fn unknowns(&self) -> usize {
        SLIPS + 6 * self.stations.len()
    }

    fn linearise(&self, state: &State, equations: &mut NormalEquations) {
        for (index, (station, slip)) in self.stations.iter().zip(&state.slips).enumerate() {
            let slips = SLIPS + 6 * index;
            let t_5_b = station.t_b_5.inverse();
            for (point, pixel) in self.points.iter().zip(&station.pixels) {
                let said = t_5_b * (state.t_b_w * point);
                let on_arm = slip * said;
                let (image, by_camera, by_point) = state
                    .camera
                    .project_with_derivatives(&state.t_5_c.inverse_transform_point(&on_arm));
                let turned =
                    |by: &Matrix2x3<f64>, pose: &Isometry3<f64>| by * pose.rotation.to_rotation_matrix().matrix();
                let by_arm = turned(&by_point, &state.t_5_c.inverse());
                let by_eye = by_step_of_frame(&state.t_5_c, &on_arm, &by_arm);
                let by_slip = planar_pose::by_step(slip, &said, &by_arm);
                let by_board = planar_pose::by_step(&state.t_b_w, point, &turned(&turned(&by_arm, slip), &t_5_b));
                for axis in 0..2 {
                    let camera = (0..PARAMETERS)
                        .filter(|at| self.free[*at])
                        .map(|at| (at, by_camera[(axis, at)]));
                    let poses = [(EYE, &by_eye), (BOARD, &by_board), (slips, &by_slip)];
                    let poses = poses
                        .iter()
                        .flat_map(|(begin, by)| (0..6).map(move |at| (begin + at, by[(axis, at)])));
                    let derivatives: Vec<_> = camera
                        .chain(poses)
                        .map(|(at, by)| (at, by / self.pixel_sigma))
                        .collect();
                    equations.add((image[axis] - pixel[axis]) / self.pixel_sigma, &derivatives);
                }
            }
            // The arm's accuracy, as measurements of no slip. A slip's turn is small: its derivative by a step is 1.
            let (turn, shift) = (slip.rotation.scaled_axis(), slip.translation.vector);
            for axis in 0..3 {
                equations.add(
                    turn[axis] / self.arm.turn_rad,
                    &[(slips + axis, 1.0 / self.arm.turn_rad)],
                );
                equations.add(
                    shift[axis] / self.arm.position_m,
                    &[(slips + 3 + axis, 1.0 / self.arm.position_m)],
                );
            }
        }
    }

    fn advance(&self, state: &State, by: &DVector<f64>) -> State {
        let numbers = state.camera.parameters();
        let by = by.as_slice();
        State {
            camera: Camera::from_parameters(std::array::from_fn(|at| numbers[at] + by[at])),
            t_5_c: planar_pose::step(&state.t_5_c, &by[EYE..BOARD]),
            t_b_w: planar_pose::step(&state.t_b_w, &by[BOARD..SLIPS]),
            slips: state
                .slips
                .iter()
                .zip(by[SLIPS..].chunks_exact(6))
                .map(|(slip, step)| planar_pose::step(slip, step))
                .collect(),
        }
    }
}
