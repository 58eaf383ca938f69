//! What a lens does to rays: radial and tangential distortion, OpenCV's model of five numbers.
//!
//! With x = X/Z, y = Y/Z of Σ_C, r² = x² + y²:
//! x' = x(1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 xy + p2(r² + 2x²), y' = y(…) + p1(r² + 2y²) + 2 p2 xy.

use nalgebra::{Matrix2, Vector2};

/// Steps of the inversion at most. Newton's method: each doubles the digits, and the start is within
/// a tenth, so five reach f64; the rest is for the corners of strong lenses.
const STEPS: usize = 10;
/// What is left of a ray's tangents when it has been found: rounding.
const FOUND: f64 = 1e-15;

/// k1, k2, p1, p2, k3, in OpenCV's order; dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens(pub [f64; 5]);

impl Lens {
    /// A lens without distortion.
    pub const NONE: Self = Self([0.0; 5]);

    /// Where a ray appears.
    pub fn distort(&self, ray: &Vector2<f64>) -> Vector2<f64> {
        let [k1, k2, p1, p2, k3] = self.0;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// The ray that appears at `seen`.
    pub fn undistort(&self, seen: &Vector2<f64>) -> Vector2<f64> {
        let mut ray = *seen;
        for _ in 0..STEPS {
            let excess = self.distort(&ray) - seen;
            if excess.amax() < FOUND {
                break;
            }
            // A lens that folds the image over itself has no inverse there: the last direction is then as good as any.
            let Some(inverse) = self.by_ray(&ray).try_inverse() else {
                break;
            };
            ray -= inverse * excess;
        }
        ray
    }

    /// As the core describes it.
    pub fn of_core(&self) -> firmware::vision::lens::Lens {
        let [k1, k2, p1, p2, k3] = self.0.map(|number| number as f32);
        firmware::vision::lens::Lens {
            radial: [k1, k2, k3],
            tangential: [p1, p2],
        }
    }

    /// Derivative of [`Self::distort`].
    pub fn by_ray(&self, ray: &Vector2<f64>) -> Matrix2<f64> {
        let [k1, k2, p1, p2, k3] = self.0;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let radial_by_r2 = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let mixed = 2.0 * (x * y * radial_by_r2 + p1 * x + p2 * y);
        Matrix2::new(
            radial + 2.0 * x * x * radial_by_r2 + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + 2.0 * y * y * radial_by_r2 + 6.0 * p1 * y + 2.0 * p2 * x,
        )
    }
}
