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
