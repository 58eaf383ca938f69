//! The pose of a board in one view of a camera whose numbers are known.

use anyhow::{Result, ensure};
use nalgebra::{
    DVector, Isometry3, Matrix2x3, Matrix3, Point3, Rotation3, SMatrix, Translation3, UnitQuaternion, Vector3,
};

use super::camera::Camera;
use super::least_squares::{self, NormalEquations, Problem};
use super::{Pixel, homography};

/// Derivative of something with two components by a step of a pose: turn (rad), then shift (m), see [`step`].
pub type ByPose = SMatrix<f64, 2, 6>;

/// Poses seen from a camera, from the corners' pixels: linear start from the homography of the undistorted corners,
/// then refined on the pixels.
pub fn estimate(camera: &Camera, points: &[Point3<f64>], pixels: &[Pixel]) -> Result<Isometry3<f64>> {
    let problem = View { camera, points, pixels };
    Ok(least_squares::solve(&problem, linear(camera, points, pixels)?)?.state)
}

/// Pose of the board in the camera from the homography alone.
pub fn linear(camera: &Camera, points: &[Point3<f64>], pixels: &[Pixel]) -> Result<Isometry3<f64>> {
    let rays: Vec<Pixel> = pixels.iter().map(|pixel| camera.ray(pixel)).collect();
    let h = homography::plane_to_image(points, &rays)?;
    let (a, b) = (h.column(0).into_owned(), h.column(1).into_owned());
    let scale = (a.norm() * b.norm()).sqrt();
    ensure!(scale > 0.0, "corners: they coincide");
    let (x, y) = (a / scale, b / scale);
    // The nearest rotation in the least-squares sense: polar decomposition by SVD.
    let svd = Matrix3::from_columns(&[x, y, x.cross(&y)]).svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        anyhow::bail!("corners: no rotation fits them");
    };
    let rotation = Rotation3::from_matrix_unchecked(
        u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant())) * v_t,
    );
    let shift = Vector3::from(h.column(2)) / scale;
    Ok(Isometry3::from_parts(
        shift.into(),
        UnitQuaternion::from_rotation_matrix(&rotation),
    ))
}

/// The pose after a step of six numbers: turned by the first three (rotation vector in the outer frame, rad), shifted by
/// the others (m, in the outer frame).
pub fn step(pose: &Isometry3<f64>, by: &[f64]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(by[0], by[1], by[2]));
    let shift = Translation3::new(by[3], by[4], by[5]);
    Isometry3::from_parts(shift * pose.translation, turn * pose.rotation)
}

/// Derivative, by a [`step`] of `pose`, of what depends on the point `pose * local` by `by_point`.
pub fn by_step(pose: &Isometry3<f64>, local: &Point3<f64>, by_point: &Matrix2x3<f64>) -> ByPose {
    let arm = (pose.rotation * local).coords;
    let mut by_step = ByPose::zeros();
    by_step
        .fixed_view_mut::<2, 3>(0, 0)
        .copy_from(&(-by_point * arm.cross_matrix()));
    by_step.fixed_view_mut::<2, 3>(0, 3).copy_from(by_point);
    by_step
}

struct View<'a> {
    camera: &'a Camera,
    points: &'a [Point3<f64>],
    pixels: &'a [Pixel],
}

impl Problem for View<'_> {
    type State = Isometry3<f64>;

    fn unknowns(&self) -> usize {
        6
    }

    fn linearise(&self, t_c_w: &Isometry3<f64>, equations: &mut NormalEquations) {
        for (point, pixel) in self.points.iter().zip(self.pixels) {
            let (image, _, by_point) = self.camera.project_with_derivatives(&(t_c_w * point));
            let by_pose = by_step(t_c_w, point, &by_point);
            for axis in 0..2 {
                let derivatives: [(usize, f64); 6] = std::array::from_fn(|at| (at, by_pose[(axis, at)]));
                equations.add(image[axis] - pixel[axis], &derivatives);
            }
        }
    }

    fn advance(&self, pose: &Isometry3<f64>, by: &DVector<f64>) -> Isometry3<f64> {
        step(pose, by.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::super::board::{Board, Grid};
    use super::*;

    #[test]
    fn the_pose_of_an_exact_view_through_a_distorting_lens_is_found_again() {
        let camera = Camera {
            fx: 532.8,
            fy: 532.9,
            cx: 342.5,
            cy: 233.9,
            distortion: [-0.281, 0.025, 0.0012, -0.00014, 0.163],
        };
        let board = Board {
            grid: Grid { columns: 9, rows: 6 },
            square_m: 0.025,
        };
        let truth = Isometry3::new(Vector3::new(-0.08, -0.05, 0.4), Vector3::new(0.4, -0.3, 2.5));
        let pixels: Vec<Pixel> = board
            .points()
            .iter()
            .map(|point| camera.project(&(truth * point)))
            .collect();
        let found = estimate(&camera, &board.points(), &pixels).expect("determined");
        let off = truth.inv_mul(&found);
        assert!(
            off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9,
            "{off}"
        );
    }
}
