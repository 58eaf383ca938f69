//! Calibration: the camera from photographs of a chessboard, the slit's plane, and where the sensor sits on the hand.
//!
//! The way: [`chessboard`] finds the corners; [`intrinsics`] starts from Zhang's constraints on the [`homography`] of
//! each view and refines camera and views together; [`slit_plane`] fits the plane of light to where it met the board;
//! [`hand_eye`] closes the chain over the robot's poses; [`directions`] measures one seam from both directions of
//! travel, which no error of the hand-eye transform survives. [`procedure`] is all of it in order; what it works on comes
//! from [`given`] files or from the [`simulated`] cell; [`report`] holds the result to its limits. [`opencv_yaml`] is the
//! file that cameras travel in, [`sensor_file`] the same with slits and place on the hand, and [`sensor`] what a job takes of it.
//!
//! Frames: Σ_B robot base, Σ_5 last frame of the arm, Σ_C camera (x right, y down, z along the view, as in OpenCV),
//! Σ_W board (x along its rows of corners, y along its columns). `t_a_b` is the pose of b in a. Metres, radians, f64;
//! pixels count from the centre of the top-left pixel, x right, y down.
//!
//! Sources: Z. Zhang, A flexible new technique for camera calibration, IEEE PAMI 22 (2000) 1330; F. Park and B. Martin,
//! Robot sensor calibration: solving AX = XB on the Euclidean group, IEEE T-RA 10 (1994) 717; the camera model is
//! OpenCV's (documentation of its module calib3d).

pub mod board;
pub mod camera;
pub mod chessboard;
pub mod directions;
pub mod given;
pub mod hand_eye;
pub mod homography;
pub mod intrinsics;
pub mod least_squares;
pub mod lens;
pub mod opencv_yaml;
pub mod photograph;
pub mod planar_pose;
pub mod procedure;
#[cfg(test)]
mod rendered;
pub mod report;
pub mod sensor;
pub mod sensor_file;
pub mod simulated;
pub mod slit_line;
pub mod slit_plane;

/// A position in an image, px.
pub type Pixel = nalgebra::Vector2<f64>;
