//! The homography from a plane to its image: eight numbers that a view of a flat board gives.
//!
//! Direct linear transform on normalised coordinates (R. Hartley, In defense of the eight-point algorithm, IEEE PAMI 19
//! (1997) 580). Algebraic, so only a start for what is refined on pixels afterwards.

use anyhow::{Context, Result, ensure};
use nalgebra::{Matrix3, Point3, SMatrix, Vector3};

use super::Pixel;

/// Homography H with (x, y, 1)ᵀ ~ H (X, Y, 1)ᵀ for points of the plane z = 0 and their pixels; its last element is
/// positive. An error says that the points lie on a line or are fewer than four.
pub fn plane_to_image(points: &[Point3<f64>], pixels: &[Pixel]) -> Result<Matrix3<f64>> {
    ensure!(points.len() >= 4, "corners {}: must be at least 4", points.len());
    let plane: Vec<Pixel> = points.iter().map(|point| Pixel::new(point.x, point.y)).collect();
    let (from, to) = (normalisation(&plane)?, normalisation(pixels)?);
    let mut moments = SMatrix::<f64, 9, 9>::zeros();
    for (point, pixel) in plane.iter().zip(pixels) {
        let p = from * point.push(1.0);
        let q = to * pixel.push(1.0);
        #[rustfmt::skip]
        let rows = [
            [p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y, -q.x],
            [0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y, -q.y],
        ];
        for row in rows {
            let row = SMatrix::<f64, 1, 9>::from_row_slice(&row);
            moments += row.transpose() * row;
        }
    }
    let eigen = moments.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let mut sorted: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    ensure!(sorted[1] > 1e-9 * sorted[8], "corners: they lie on a line");
    let h = Matrix3::from_row_slice(eigen.eigenvectors.column(least).as_slice());
    let back = to.try_inverse().context("corners: their pixels coincide")?;
    let h = back * h * from;
    ensure!(h[(2, 2)] != 0.0, "corners: the board goes through the camera");
    Ok(h / h[(2, 2)])
}

/// Similarity that brings the points' centre to the origin and their mean distance from it to √2.
fn normalisation(points: &[Pixel]) -> Result<Matrix3<f64>> {
    let count = points.len() as f64;
    let centre = points.iter().sum::<Pixel>() / count;
    let spread = points.iter().map(|point| (point - centre).norm()).sum::<f64>() / count;
    ensure!(spread > 0.0, "corners: they coincide");
    let scale = std::f64::consts::SQRT_2 / spread;
    Ok(Matrix3::new_nonuniform_scaling(&nalgebra::Vector2::repeat(scale)) * Matrix3::new_translation(&-centre))
}

/// Where a homography takes a point of the plane.
pub fn apply(h: &Matrix3<f64>, x: f64, y: f64) -> Pixel {
    let image = h * Vector3::new(x, y, 1.0);
    image.xy() / image.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_homography_of_exact_points_is_found_again() {
        let h = Matrix3::new(300.0, -20.0, 310.0, 35.0, 280.0, 240.0, 0.2, -0.1, 1.0);
        let points: Vec<Point3<f64>> = (0..20)
            .map(|at| Point3::new((at % 5) as f64 * 0.1, (at / 5) as f64 * 0.1, 0.0))
            .collect();
        let pixels: Vec<Pixel> = points.iter().map(|point| apply(&h, point.x, point.y)).collect();
        let found = plane_to_image(&points, &pixels).expect("determined");
        assert!((found - h).norm() < 1e-6 * h.norm(), "{found}");
    }

    #[test]
    fn corners_on_a_line_are_refused() {
        let points: Vec<Point3<f64>> = (0..9).map(|at| Point3::new(at as f64, 2.0 * at as f64, 0.0)).collect();
        let pixels: Vec<Pixel> = points.iter().map(|point| Pixel::new(point.x, point.y)).collect();
        let error = plane_to_image(&points, &pixels).expect_err("a line");
        assert_eq!(error.to_string(), "corners: they lie on a line");
    }
}
