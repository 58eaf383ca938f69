//! The plane of the sheet, from the light sections on it.

use super::{Section, StartRefusal, beyond, within};
use crate::geometry::rotation::{length, unit};
use nalgebra::Vector3;

/// Shortest distance between the outer light sections, m: the sheet's pitch is known to their noise (0.05 mm) over this.
const BASE_MIN: f32 = 0.008;

/// Distance that a lit point may lie off the common plane, m: a dent of 0.25 mm and a bent sheet.
const OFF_PLANE: f32 = 0.5e-3;

/// Angle that a lit line may lean out of the common plane, rad: 3°, the slope of a dent under a light section.
const LEANING: f32 = 0.052;

/// Distance at which a lit line's direction counts as a point would, m: the standard deviation of rows over a lit half of the view.
const LEVER: f32 = 0.007;

/// Standard deviation of a lit point's height, m; of the slope with which the sheet leaves its plane at the corner, m/m: undulation and dents; and
/// how much that changes, 1/m: dents are a centimetre wide. Over 300 rendered harsh lap joints: 0.04 mm, 20e-3 and 1.7.
const HEIGHT_SIGMA: f32 = 0.04e-3;
const SLOPE_SIGMA: f32 = 20e-3;
const CHANGE_SIGMA: f32 = 1.7;

/// How high over its plane the sheet is at the corner: what near sections say, along their own slope, and far ones hardly.
pub(super) struct Rise {
    /// Normal equations of height (m) and slope: 1, distance and its square, summed by weight.
    normal: [f32; 3],
    right: [f32; 2],
}

impl Rise {
    pub(super) fn new() -> Self {
        Self {
            normal: [0.0, 0.0, 1.0 / (SLOPE_SIGMA * SLOPE_SIGMA)],
            right: [0.0; 2],
        }
    }

    /// A lit point `ahead` (m) of the corner and `height` (m) over the plane.
    pub(super) fn add(&mut self, ahead: f32, height: f32) {
        let change = CHANGE_SIGMA * ahead * ahead;
        let weight = 1.0 / (HEIGHT_SIGMA * HEIGHT_SIGMA + change * change);
        let [ones, firsts, seconds] = &mut self.normal;
        let [zeroth, first] = &mut self.right;
        *ones += weight;
        *firsts += weight * ahead;
        *seconds += weight * ahead * ahead;
        *zeroth += weight * height;
        *first += weight * height * ahead;
    }

    /// Height at the corner, m.
    pub(super) fn at_corner(&self) -> f32 {
        let ([n, a, aa], [h, ha]) = (self.normal, self.right);
        (aa * h - a * ha) / (n * aa - a * a)
    }
}

/// Unit normal (on `toward`'s side) and middle of the plane that fits the sections' points and directions best.
pub(super) fn plane(sections: &[Section], toward: &Vector3<f32>) -> Result<(Vector3<f32>, Vector3<f32>), StartRefusal> {
    let [first, .., last] = sections else {
        return Err(StartRefusal::Incomplete);
    };
    let base = last.point - first.point;
    if !beyond(length(&base), BASE_MIN) {
        return Err(StartRefusal::TooNear);
    }
    let zero = Vector3::zeros();
    let share = 1.0 / sections.len() as f32;
    let middle = sections.iter().fold(zero, |sum, section| sum + section.point) * share;
    let across = sections.iter().fold(zero, |sum, section| sum + section.across);
    let flat = |v: Vector3<f32>| unit(&v).ok_or(StartRefusal::TooFlat);
    let rough = flat(base.cross(&across))?;
    let rough = if rough.dot(toward) < 0.0 { -rough } else { rough };
    // n = rough + a·e + b·f: squares of (P − middle)·n and of LEVER·D·n, each linear in a and b, are least in sum.
    let e = flat(base)?;
    let f = rough.cross(&e);
    let (mut ee, mut ef, mut ff, mut er, mut fr) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
    for section in sections {
        for row in [section.point - middle, section.across * LEVER] {
            let (x, y, rest) = (row.dot(&e), row.dot(&f), row.dot(&rough));
            ee += x * x;
            ef += x * y;
            ff += y * y;
            er += x * rest;
            fr += y * rest;
        }
    }
    let determinant = ee * ff - ef * ef;
    // Lit lines that run along the seam span no plane: their angle's sine is below 0.1.
    if !beyond(determinant, 0.01 * ee * ff) {
        return Err(StartRefusal::TooFlat);
    }
    let a = (ef * fr - ff * er) / determinant;
    let b = (ef * er - ee * fr) / determinant;
    Ok((flat(rough + e * a + f * b)?, middle))
}

/// A section lies in the plane with all others, `height` (m) off it.
pub(super) fn check_even(section: &Section, height: f32, normal: &Vector3<f32>) -> Result<(), StartRefusal> {
    if within(height, OFF_PLANE) && within(section.across.dot(normal), LEANING) {
        Ok(())
    } else {
        Err(StartRefusal::Uneven)
    }
}
