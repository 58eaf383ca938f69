//! What each pixel of the start view sees of the two sheets, each continued beyond its edges.
//!
//! The sheets are smooth (no dent is narrower than 12 mm): camera rays are met with them on every fifteenth pixel and interpolated linearly,
//! which is off by less than 5 µm on the sheet. Which sheet is really there is decided at each pixel.

use super::SIDE;
use crate::camera::optics::{CAMERA_HEIGHT_M, Optics};
use crate::cell::panel::{Panel, Patch, Sheet};
use nalgebra::{Isometry3, Point3, Vector3};

/// Pixels from knot to knot, and knots: one before the image and one after it.
const PITCH: usize = 15;
const KNOTS: usize = SIDE / PITCH + 3;

/// A point of one sheet as a pixel sees it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spot {
    /// Distance to the left of the seam and along it from its start, m.
    pub left: f64,
    /// See [`Self::left`].
    pub along: f64,
    /// Cosine between the camera's ray and the sheet's normal.
    pub facing: f64,
    /// Width of sheet that a pixel sees, m.
    pub pixel_m: f64,
    /// 1 on the part, 0 past its border.
    pub on_part: f64,
}

impl Spot {
    fn mix(&self, other: &Self, f: f64) -> Self {
        let blend = |a: f64, b: f64| a + f * (b - a);
        Self {
            left: blend(self.left, other.left),
            along: blend(self.along, other.along),
            facing: blend(self.facing, other.facing),
            pixel_m: blend(self.pixel_m, other.pixel_m),
            on_part: blend(self.on_part, other.on_part),
        }
    }
}

/// The two sheets before one pose of the camera.
pub struct Surfaces {
    knots: [Vec<Spot>; 2],
}

impl Surfaces {
    /// Meets the sheets of `panel` with the rays through `optics` of a sensor at `t_b_s`.
    pub fn of(optics: &Optics, panel: &Panel, t_b_s: &Isometry3<f64>) -> Self {
        let t_w_s = panel.t_b_w().inverse() * t_b_s;
        let patch = panel.around(&t_w_s.translation.vector, 0.045);
        Self {
            knots: [Sheet::Base, Sheet::Other].map(|sheet| meet_all(optics, &patch, &t_w_s, sheet)),
        }
    }

    /// What pixel (`x`, `y`) sees of the base sheet and of the other.
    pub fn at(&self, x: usize, y: usize) -> [Spot; 2] {
        let split = |at: usize| {
            let at = (at + PITCH) as f64 / PITCH as f64;
            let index = at as usize;
            (index, at - index as f64)
        };
        let ((column, fx), (row, fy)) = (split(x), split(y));
        [0, 1].map(|sheet| {
            let knot = |row: usize, column: usize| &self.knots[sheet][row * KNOTS + column];
            let above = knot(row, column).mix(knot(row, column + 1), fx);
            let below = knot(row + 1, column).mix(knot(row + 1, column + 1), fx);
            above.mix(&below, fy)
        })
    }
}

fn meet_all(optics: &Optics, patch: &Patch, t_w_s: &Isometry3<f64>, sheet: Sheet) -> Vec<Spot> {
    let at = |knot: usize| (knot * PITCH) as f64 - PITCH as f64;
    let mut points = Vec::with_capacity(KNOTS * KNOTS);
    let mut spots = Vec::with_capacity(KNOTS * KNOTS);
    let mut far = 1.0; // share of the ray to z = 0: sheets are continuous, so the last one's is a good guess
    for row in 0..KNOTS {
        for column in 0..KNOTS {
            let ray = optics.ray(at(column), at(row));
            let (share, spot) = meet(patch, t_w_s, sheet, &ray, far);
            far = share;
            points.push(Vector3::new(0.0, 0.0, CAMERA_HEIGHT_M) + ray * share);
            spots.push(Spot {
                pixel_m: optics.pixel_m * share,
                ..spot
            });
        }
    }
    // Normals from neighbours, one-sided at the rim.
    for row in 0..KNOTS {
        for column in 0..KNOTS {
            let point = |row: usize, column: usize| points[row.min(KNOTS - 1) * KNOTS + column.min(KNOTS - 1)];
            let right = point(row, column + 1) - point(row, column.saturating_sub(1));
            let up = point(row.saturating_sub(1), column) - point(row + 1, column);
            let toward_camera = Vector3::new(0.0, 0.0, CAMERA_HEIGHT_M) - point(row, column);
            spots[row * KNOTS + column].facing = right.cross(&up).normalize().dot(&toward_camera.normalize());
        }
    }
    spots
}

/// Where the camera's `ray` (to z = 0) meets a sheet, by secants: share of the ray, and the place on the sheet.
fn meet(patch: &Patch, t_w_s: &Isometry3<f64>, sheet: Sheet, ray: &Vector3<f64>, guess: f64) -> (f64, Spot) {
    let clearance = |share: f64| {
        let point = Vector3::new(0.0, 0.0, CAMERA_HEIGHT_M) + ray * share;
        patch.clearance(&(t_w_s * Point3::from(point)).coords)
    };
    let mut slope = -CAMERA_HEIGHT_M;
    let mut share = guess;
    let mut here = clearance(share);
    for _ in 0..5 {
        let above = here.above[sheet as usize];
        if above.abs() < 1e-7 {
            break;
        }
        let next_share = (share - above / slope).clamp(0.5, 1.5);
        if next_share == share {
            break;
        }
        let next = clearance(next_share);
        slope = (next.above[sheet as usize] - above) / (next_share - share);
        (share, here) = (next_share, next);
    }
    let spot = Spot {
        left: here.left,
        along: here.along,
        on_part: f64::from(u8::from(here.on_part)),
        ..Spot::default()
    };
    (share, spot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::panel::tests::{harsh_arc, level};
    use crate::cell::panel::{Joint, Side};
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn the_true_corners_pixel_sees_the_corner() {
        for seed in 0..20 {
            let joint = [Joint::crank(Side::Left), Joint::vee(), Joint::lip(Side::Right)][seed as usize % 3];
            let panel = harsh_arc(joint, seed);
            let seam = panel.seam(0.0);
            let tilt = UnitQuaternion::from_euler_angles(0.05, -0.06, 0.04);
            let pose = Isometry3::from_parts(
                Translation3::from(seam.p + Vector3::new(0.004, -0.006, 0.005)),
                level(&seam) * tilt,
            );
            let (x, y) = Optics::START.project(&pose.inverse_transform_point(&seam.p.into()).coords);
            let [base, _] = Surfaces::of(&Optics::START, &panel, &pose).at(x.round() as usize, y.round() as usize);
            // Rounding to the pixel's centre is 0.7 px at most.
            assert!(
                base.left.abs() < 1.5e-4 && base.along.abs() < 1.5e-4,
                "{base:?} with seed {seed}"
            );
            // Tilt, slopes of bend and dents, and the ray's own slant make 21° at most.
            assert!(base.facing > 0.93 && base.facing <= 1.0, "{}", base.facing);
        }
    }
}
