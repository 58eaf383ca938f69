//! Distortion of a lens, undone where a located image point becomes a ray: OpenCV's model of five numbers (Brown and Conrady's).
//!
//! A ray is (X/Z, Y/Z), x right and y down in the image as in OpenCV, so that the numbers of a calibration mean the same here.
//! With r² = x² + y²: x' = x(1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 xy + p2(r² + 2x²), y' = y(…) + p1(r² + 2y²) + 2 p2 xy.
//! Only points are undone, a handful in a frame: over the lengths that lines are fitted to, a lens that moves the image's corner by 1 %
//! bends them by less than 5 µm, and turns them by what [`Lens::straighten`] takes back.

use hal::wire_struct;

/// Steps of the inversion. Each leaves the part of the error that the radial term is twice over: a lens that moves the start view's
/// corner by 5 % leaves 0.02 µm of work, less than rounding.
const STEPS: usize = 5;

/// What a lens does to rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// k1, k2, k3.
    pub radial: [f32; 3],
    /// p1, p2.
    pub tangential: [f32; 2],
}

wire_struct!(Lens {
    radial: [f32; 3],
    tangential: [f32; 2]
});

impl Lens {
    /// A lens without distortion.
    pub const NONE: Self = Self {
        radial: [0.0; 3],
        tangential: [0.0; 2],
    };

    /// It does nothing: a point costs no more than the question.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Where the ray (x, y) appears.
    pub fn distort(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let (scale, [aside, down]) = self.parts([x, y]);
        [x * scale + aside, y * scale + down]
    }

    /// The ray that appears at (x, y): fixed-point iteration, as OpenCV's `undistortPoints`.
    pub fn undistort(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let mut ray = [x, y];
        for _ in 0..STEPS {
            let (scale, [aside, down]) = self.parts(ray);
            let rest = 1.0 / scale;
            ray = [(x - aside) * rest, (y - down) * rest];
        }
        ray
    }

    /// Direction, of any length, in which a line runs through `ray` that appears there in direction (dx, dy).
    pub fn straighten(&self, [x, y]: [f32; 2], [dx, dy]: [f32; 2]) -> [f32; 2] {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let r2 = x * x + y * y;
        let (scale, _) = self.parts([x, y]);
        let by_r2 = k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3));
        // The derivative of the distortion is symmetric: its inverse, but for the determinant.
        let mixed = 2.0 * (x * y * by_r2 + p1 * x + p2 * y);
        let x_by_x = scale + 2.0 * x * x * by_r2 + 2.0 * p1 * y + 6.0 * p2 * x;
        let y_by_y = scale + 2.0 * y * y * by_r2 + 6.0 * p1 * y + 2.0 * p2 * x;
        [y_by_y * dx - mixed * dy, x_by_x * dy - mixed * dx]
    }

    /// The radial factor and the tangential shift.
    fn parts(&self, [x, y]: [f32; 2]) -> (f32, [f32; 2]) {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let (xx, yy, xy) = (x * x, y * y, 2.0 * (x * y));
        let r2 = xx + yy;
        let scale = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        (scale, [p1 * xy + p2 * (r2 + 2.0 * xx), p1 * (r2 + 2.0 * yy) + p2 * xy])
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::vision::camera::Pinhole;
    extern crate std;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// A lens that moves the start view's corner by about 1 % of the half diagonal inward.
    pub const REAL: Lens = Lens {
        radial: [-0.16, 0.1, 0.0],
        tangential: [0.0008, -0.0006],
    };

    /// The same model in f64, written out as in OpenCV's documentation.
    fn distort(lens: &Lens, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, k3] = lens.radial.map(f64::from);
        let [p1, p2] = lens.tangential.map(f64::from);
        let r2 = x * x + y * y;
        let scale = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
        [
            x * scale + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * scale + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// Largest tangent of a ray in the start view: its corner, 27 mm to each side of the axis at 150 mm.
    const SIDE: f64 = 0.18;

    proptest! {
        #[test]
        fn a_ray_is_found_again_to_half_a_micrometre_of_work(
            x in -SIDE..SIDE, y in -SIDE..SIDE,
            k1 in -0.6_f32..0.6, k2 in -1.0_f32..1.0, k3 in -2.0_f32..2.0,
            p1 in -0.005_f32..0.005, p2 in -0.005_f32..0.005,
        ) {
            // Up to 4 % at the corner from k1, and what the others add.
            let lens = Lens { radial: [k1, k2, k3], tangential: [p1, p2] };
            let seen = distort(&lens, [x, y]).map(|value| value as f32);
            let [u, v] = lens.undistort(seen).map(f64::from);
            let off_um = (u - x).hypot(v - y) * 0.150e6;
            prop_assert!(off_um < 0.5, "{} µm at ({}, {})", off_um, x, y);
        }

        #[test]
        fn a_direction_is_that_of_two_rays_close_by(
            x in -SIDE..SIDE, y in -SIDE..SIDE, angle in 0.0..core::f64::consts::TAU,
        ) {
            const STEP: f64 = 1e-4;
            let (dx, dy) = (STEP * angle.cos(), STEP * angle.sin());
            let [one, other] = [distort(&REAL, [x - dx, y - dy]), distort(&REAL, [x + dx, y + dy])];
            let seen = [other[0] - one[0], other[1] - one[1]].map(|value| value as f32);
            let [u, v] = REAL.straighten([x as f32, y as f32], seen).map(f64::from);
            let sine = (u * dy - v * dx) / (u.hypot(v) * STEP);
            prop_assert!(sine.abs() < 1e-5 && u * dx + v * dy > 0.0, "{} rad", sine);
        }
    }

    #[test]
    fn a_lens_of_one_percent_bends_a_fitted_line_by_less_than_five_micrometres_and_turns_it_by_what_is_taken_back() {
        // The slit's line 10.6 mm aside, over the 14 mm about a seam up to 8 mm from the middle; rays in units of the distance, 150 mm.
        let mut worst = (0.0_f64, 0.0_f64, 0.0_f64);
        for seam_mm in [-8.0, -4.0, 0.0, 4.0, 8.0] {
            let rows: Vec<[f64; 2]> = (-56..=56)
                .map(|row| distort(&REAL, [10.6 / 150.0, (seam_mm + f64::from(row) * 0.125) / 150.0]))
                .collect();
            let n = rows.len() as f64;
            let mean = |at: usize| rows.iter().map(|row| row[at]).sum::<f64>() / n;
            let (x, y) = (mean(0), mean(1));
            let product = |a: usize, b: usize| {
                rows.iter()
                    .map(|row| (row[a] - mean(a)) * (row[b] - mean(b)))
                    .sum::<f64>()
            };
            let slope = product(0, 1) / product(1, 1);
            let bend = rows
                .iter()
                .map(|row| (row[0] - x - slope * (row[1] - y)).abs())
                .fold(0.0, f64::max);
            let ray = REAL.undistort([x as f32, y as f32]);
            let [aside, down] = REAL.straighten(ray, [slope as f32, 1.0]);
            worst = (
                worst.0.max(bend * 150e3),
                worst.1.max(slope.abs()),
                worst.2.max(f64::from(aside / down).abs()),
            );
        }
        let (bend_um, turned, left) = worst;
        assert!(bend_um < 5.0, "{bend_um} µm");
        // 0.06° of the sheet's inclination, of which a hundredth is left.
        assert!((5e-4..2e-3).contains(&turned) && left < 2e-5, "{turned} and {left} rad");
    }

    #[test]
    fn a_pixel_in_the_image_s_corner_is_placed_as_without_the_lens() {
        let real = Pinhole {
            lens: REAL,
            ..Pinhole::START
        };
        let focal = f64::from(real.height_m) / f64::from(real.pixel_m);
        let (mut moved_um, mut left_um) = (0.0_f64, 0.0_f64);
        for (x, y) in [(0.0, 0.0), (449.0, 0.0), (0.0, 449.0), (449.0, 449.0)] {
            let straight = [x - 224.5, y - 224.5].map(|px| px / focal);
            let [u, v] = distort(&REAL, straight).map(|ray| (ray * focal + 224.5) as f32);
            let off_um = |at: [f32; 2]| {
                let [right, up] = at.map(|m| f64::from(m) * 1e6);
                (right - straight[0] * 150e3).hypot(up + straight[1] * 150e3)
            };
            moved_um = moved_um.max(off_um(Pinhole::START.on_work(u, v)));
            left_um = left_um.max(off_um(real.on_work(u, v)));
        }
        assert!(
            (300.0..450.0).contains(&moved_um) && left_um < 0.1,
            "{moved_um} and {left_um} µm"
        );
    }
}
