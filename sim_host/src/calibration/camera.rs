//! The camera: pinhole behind a lens, OpenCV's model.
//!
//! With (x', y') where the [`Lens`] shows the ray (X/Z, Y/Z), the pixel is (fx x' + cx, fy y' + cy).

use nalgebra::{Matrix2, Matrix2x3, Point3, SMatrix, Vector2};

use super::Pixel;
use super::lens::Lens;

/// Numbers in a camera: fx, fy, cx, cy, then the distortion.
pub const PARAMETERS: usize = 9;

/// Derivative of a pixel by the camera's numbers, in their order.
pub type PixelByCamera = SMatrix<f64, 2, PARAMETERS>;

/// Intrinsic parameters of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Focal length along x, px.
    pub fx: f64,
    /// Focal length along y, px.
    pub fy: f64,
    /// Principal point, x, px.
    pub cx: f64,
    /// Principal point, y, px.
    pub cy: f64,
    /// k1, k2, p1, p2, k3, in OpenCV's order; dimensionless.
    pub distortion: [f64; 5],
}

/// Which numbers of the lens distortion are estimated; the others stay zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distortion {
    /// None: a plain pinhole.
    None,
    /// k1 only.
    Radial1,
    /// k1, k2, p1, p2: all that a narrow view can tell.
    Brown,
    /// k1, k2, p1, p2, k3.
    Full,
}

impl Distortion {
    /// For each number of the camera, whether it is estimated.
    pub fn free(self) -> [bool; PARAMETERS] {
        let first = self != Self::None;
        let brown = matches!(self, Self::Brown | Self::Full);
        let full = self == Self::Full;
        [true, true, true, true, first, brown, brown, brown, full]
    }
}

impl Camera {
    /// The camera's numbers in the order of [`PixelByCamera`].
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        [self.fx, self.fy, self.cx, self.cy, k1, k2, p1, p2, k3]
    }

    /// The camera of these numbers.
    pub fn from_parameters([fx, fy, cx, cy, distortion @ ..]: [f64; PARAMETERS]) -> Self {
        Self {
            fx,
            fy,
            cx,
            cy,
            distortion,
        }
    }

    /// Image of a point in Σ_C, m; its z must be positive.
    pub fn project(&self, point: &Point3<f64>) -> Pixel {
        let ray = Vector2::new(point.x / point.z, point.y / point.z);
        self.pixel(&self.lens().distort(&ray))
    }

    /// Image of a point in Σ_C, m, with its derivatives by the camera's numbers and by the point.
    pub fn project_with_derivatives(&self, point: &Point3<f64>) -> (Pixel, PixelByCamera, Matrix2x3<f64>) {
        let (x, y) = (point.x / point.z, point.y / point.z);
        let ray = Vector2::new(x, y);
        let distorted = self.lens().distort(&ray);
        let r2 = x * x + y * y;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let (fx, fy) = (self.fx, self.fy);
        #[rustfmt::skip]
        let by_camera = PixelByCamera::from_row_slice(&[
            distorted.x, 0.0, 1.0, 0.0, fx * x * r2, fx * x * r4, fx * 2.0 * x * y, fx * (r2 + 2.0 * x * x), fx * x * r6,
            0.0, distorted.y, 0.0, 1.0, fy * y * r2, fy * y * r4, fy * (r2 + 2.0 * y * y), fy * 2.0 * x * y, fy * y * r6,
        ]);
        let ray_by_point = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / point.z;
        let by_point = Matrix2::new(fx, 0.0, 0.0, fy) * self.lens().by_ray(&ray) * ray_by_point;
        (self.pixel(&distorted), by_camera, by_point)
    }

    /// Direction (X/Z, Y/Z) that a pixel looks in.
    pub fn ray(&self, pixel: &Pixel) -> Vector2<f64> {
        let seen = Vector2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy);
        self.lens().undistort(&seen)
    }

    /// Its lens.
    pub fn lens(&self) -> Lens {
        Lens(self.distortion)
    }

    fn pixel(&self, distorted: &Vector2<f64>) -> Pixel {
        Pixel::new(self.fx * distorted.x + self.cx, self.fy * distorted.y + self.cy)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LEFT: Camera = Camera {
        fx: 532.8,
        fy: 532.9,
        cx: 342.5,
        cy: 233.9,
        distortion: [-0.281, 0.025, 0.0012, -0.00014, 0.163],
    };

    proptest! {
        #[test]
        fn derivatives_are_those_of_differences(x in -0.3..0.3_f64, y in -0.2..0.2_f64, z in 0.2..1.0_f64) {
            let point = Point3::new(x * z, y * z, z);
            let (pixel, by_camera, by_point) = LEFT.project_with_derivatives(&point);
            prop_assert_eq!(pixel, LEFT.project(&point));
            const STEP: f64 = 1e-6;
            for at in 0..PARAMETERS {
                let moved = |by: f64| {
                    let mut numbers = LEFT.parameters();
                    numbers[at] += by;
                    Camera::from_parameters(numbers).project(&point)
                };
                let difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                prop_assert!((difference - by_camera.column(at)).norm() < 1e-6, "number {}: {}", at, difference);
            }
            for at in 0..3 {
                let moved = |by: f64| {
                    let mut point = point;
                    point[at] += by;
                    LEFT.project(&point)
                };
                let difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                prop_assert!((difference - by_point.column(at)).norm() < 1e-4, "axis {}: {}", at, difference);
            }
        }

        #[test]
        fn the_ray_of_a_pixel_goes_through_what_it_shows(x in -0.55..0.55_f64, y in -0.4..0.4_f64) {
            let ray = LEFT.ray(&LEFT.project(&Point3::new(x, y, 1.0)));
            prop_assert!((ray - Vector2::new(x, y)).norm() < 1e-12, "{}", ray);
        }
    }
}
