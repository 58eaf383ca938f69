//! Pinhole camera and slit plane in the sensor frame Σ_S.
//!
//! The camera's centre is at (0, 0, h_z), looking along −z; image x is +X, image y is −Y. The slit plane is
//! x = c − z·tan φ (3.1), and as calibrated may lean a little along y. The exact pinhole formula is used, not the paper's orthographic
//! approximation (3.11), which is 6 % off at the image's border. What the [`Lens`] does to a pixel is undone before, and is in what [`Pinhole::pixel`] says.

use super::lens::Lens;
use hal::wire_struct;
use nalgebra::Vector3;

/// Distance between the planes of the two slits on z = 0, m (l_CD). Assumed: the paper does not print it.
pub const SLIT_DISTANCE_M: f32 = 0.021_25;

/// Geometry of one camera and one slit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Size of a pixel on the plane z = 0, m (ζ).
    pub pixel_m: f32,
    /// Principal point (x, y), px.
    pub centre_px: [f32; 2],
    /// Height of the camera's centre over z = 0, m (h_z).
    pub height_m: f32,
    /// Tangent of the angle between the slit plane and the camera's axis (tan φ).
    pub tan_slit: f32,
    /// Where the slit plane meets z = 0, m (c).
    pub slit_offset_m: f32,
    /// How far the slit plane leans along y, m/m: it is x = c − z·tan φ − y·lean. Zero where the slit is mounted as drawn.
    pub slit_lean: f32,
    /// What the lens does to the rays, by the focal length h_z/ζ.
    pub lens: Lens,
}

wire_struct!(Pinhole {
    pixel_m: f32,
    centre_px: [f32; 2],
    height_m: f32,
    tan_slit: f32,
    slit_offset_m: f32,
    slit_lean: f32,
    lens: Lens
});

impl Pinhole {
    /// The cell's own sensor: 250 × 250 px of 0.12 mm and φ = 45° (5.2); h_z = 150 mm assumed, because the paper does not
    /// print it; one slit through the origin.
    pub const TRACKING: Self = Self {
        pixel_m: 0.000_12,
        centre_px: [124.5, 124.5],
        height_m: 0.150,
        tan_slit: 1.0,
        slit_offset_m: 0.0,
        slit_lean: 0.0,
        lens: Lens::NONE,
    };

    /// The two-slit sensor: 400 × 240 px of 1/8 mm and φ = 45° (chapter 3) behind the same lens, a plane for each slit, the nearer
    /// to the nozzle first. It is the paper's slit 2, and the one further ahead the paper's slit 1.
    pub const TWO_SLITS: [Self; 2] = [
        Self::of_two(-0.5 * SLIT_DISTANCE_M),
        Self::of_two(0.5 * SLIT_DISTANCE_M),
    ];

    const fn of_two(slit_offset_m: f32) -> Self {
        Self {
            pixel_m: 0.000_125,
            centre_px: [199.5, 119.5],
            height_m: Self::TRACKING.height_m,
            tan_slit: 1.0,
            slit_offset_m,
            slit_lean: 0.0,
            lens: Lens::NONE,
        }
    }

    /// Where the ray of pixel (`x`, `y`) meets the plane z = 0, m of Σ_S.
    pub fn on_work(&self, x: f32, y: f32) -> [f32; 2] {
        let seen = self.appears(x, y);
        let [right, down] = if self.lens.is_none() {
            seen
        } else {
            self.undistort(seen).map(|slope| slope * self.height_m)
        };
        [right, -down]
    }

    /// Direction (px right, px down), of any length, of a line through pixel (`x`, `y`) as it would look without the lens' distortion.
    pub fn straighten(&self, x: f32, y: f32, direction: [f32; 2]) -> [f32; 2] {
        if self.lens.is_none() {
            return direction;
        }
        self.lens.straighten(self.undistort(self.appears(x, y)), direction)
    }

    /// Where pixel (`x`, `y`) appears to look on the plane z = 0, m right and m down.
    fn appears(&self, x: f32, y: f32) -> [f32; 2] {
        let [centre_x, centre_y] = self.centre_px;
        [self.pixel_m * (x - centre_x), self.pixel_m * (y - centre_y)]
    }

    /// Tangents of the ray that appears there.
    fn undistort(&self, seen: [f32; 2]) -> [f32; 2] {
        let per_height = 1.0 / self.height_m;
        self.lens.undistort(seen.map(|m| m * per_height))
    }

    /// Slope of a lit line through pixel (`x`, `y`), px of x per px of y, as it would look without the lens' distortion.
    pub fn slope(&self, x: f32, y: f32, slope: f32) -> f32 {
        let [aside, down] = self.straighten(x, y, [slope, 1.0]);
        aside / down
    }

    /// Point of the slit plane (Σ_S, m) that appears at pixel (`x`, `y`). The image must lie on the near side of
    /// the pixel whose ray is parallel to the slit plane: x < h_z·tan φ / ζ from the centre, 1250 px for the cell's.
    pub fn point(&self, x: f32, y: f32) -> Vector3<f32> {
        let [x_m, y_m] = self.on_work(x, y);
        let reach = self.height_m * self.tan_slit;
        let t = (self.slit_offset_m - reach) / (x_m + self.slit_lean * y_m - reach);
        Vector3::new(x_m * t, y_m * t, self.height_m * (1.0 - t))
    }

    /// Direction in Σ_S of the lit line that runs through `point` (m) with [`Self::slope`] `slope`, toward
    /// the image's top, +Y_S: see [`line_direction`].
    pub fn direction(&self, point: &Vector3<f32>, slope: f32) -> Vector3<f32> {
        line_direction(point, slope, self.height_m, [self.tan_slit, self.slit_lean])
    }

    /// Pixel (x, y) at which a point of Σ_S below the camera appears.
    pub fn pixel(&self, point: &Vector3<f32>) -> [f32; 2] {
        let [centre_x, centre_y] = self.centre_px;
        let scale = self.height_m / ((self.height_m - point.z) * self.pixel_m);
        let straight = [point.x * scale, -(point.y * scale)];
        let [x, y] = if self.lens.is_none() {
            straight
        } else {
            let focal = self.height_m / self.pixel_m;
            let ray = straight.map(|px| px / focal);
            self.lens.distort(ray).map(|slope| slope * focal)
        };
        [centre_x + x, centre_y + y]
    }
}

/// Direction of the lit line through `point` (Σ_S, m), toward +Y_S and not normalised, from its `slope` in the image (px of x per px
/// of y): the derivative of the exact triangulation along the line. `height_m`, `tan_slit` and `lean` as in [`Pinhole`]; where the slit
/// plane stands does not matter.
pub fn line_direction(point: &Vector3<f32>, slope: f32, height_m: f32, [tan_slit, lean]: [f32; 2]) -> Vector3<f32> {
    let t = 1.0 - point.z / height_m; // scale from the plane z = 0 to the point, along its ray
    let (x, y) = (point.x / t, point.y / t);
    let (dx, dy) = (-slope, 1.0); // the image's y axis points down, Σ_S's up
    let dt = -t / (x + lean * y - height_m * tan_slit) * (dx + lean * dy);
    Vector3::new(dx * t + x * dt, dy * t + y * dt, -height_m * dt)
}

#[cfg(test)]
mod tests {
    use super::super::lens;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn five_pixels_to_the_left_is_a_sheets_thickness_up() {
        let point = Pinhole::TRACKING.point(119.5, 124.5);
        assert!((point.z - 0.000_597_6).abs() < 1e-6, "{} m", point.z);
    }

    proptest! {
        #[test]
        fn a_pixels_point_is_on_the_slit_plane_and_appears_there(
            x in 0.0_f32..249.0, y in 0.0_f32..249.0, lean in -0.03_f32..0.03,
        ) {
            for lens in [Lens::NONE, lens::tests::REAL] {
                let camera = Pinhole { slit_lean: lean, lens, ..Pinhole::TRACKING };
                let point = camera.point(x, y);
                prop_assert!((point.x + point.z + lean * point.y).abs() < 2e-8);
                let [u, v] = camera.pixel(&point);
                prop_assert!((u - x).abs() < 1e-3 && (v - y).abs() < 1e-3);
            }
        }

        #[test]
        fn each_of_two_slits_has_its_own_plane(x in 0.0_f32..399.0, y in 0.0_f32..239.0) {
            for (camera, c) in Pinhole::TWO_SLITS.iter().zip([-0.010_625, 0.010_625]) {
                let point = camera.point(x, y);
                prop_assert!((point.x + point.z - c).abs() < 3e-8);
            }
        }

        #[test]
        fn a_lines_direction_leads_from_one_of_its_points_to_another(
            x in 50.0_f32..350.0, y in 20.0_f32..220.0, slope in -0.5_f32..0.5, slit in 0_usize..2,
            lean in -0.03_f32..0.03,
        ) {
            for lens in [Lens::NONE, lens::tests::REAL] {
                let camera = Pinhole { slit_lean: lean, lens, ..Pinhole::TWO_SLITS[slit] };
                let (one, other) = (camera.point(x + 4.0 * slope, y + 4.0), camera.point(x - 4.0 * slope, y - 4.0));
                let direction = camera.direction(&camera.point(x, y), camera.slope(x, y, slope));
                let off = (other - one).cross(&direction);
                let lengths = (other - one).dot(&direction);
                prop_assert!(off.dot(&off) < 1e-7 * lengths * lengths && lengths > 0.0, "{:?}", off);
            }
        }
    }
}
