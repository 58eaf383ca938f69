//! Inclination of a sheet from the whole lit line, instead of from the 14 mm about the seam that finding it takes.
//!
//! Sheets are wavy: over 25 mm a plane is known three times better than over 7.

use crate::vision::camera::Pinhole;
use crate::vision::image::View;
use crate::vision::joint::Joint;
use crate::vision::sensor::SeamSensor;

/// Rows next to the seam that are left out: where the joint's edge is.
const SKIPPED: f32 = 6.0;
/// Furthest rows, px: 25 mm.
const REACH: f32 = 208.0;
/// Fewest rows with light, weighted: 5 mm.
const FEWEST: f32 = 40.0;
/// Residuals that count half, px, from the first fit to the last: a dent, then the sheet's waves.
const SOFT: [f32; 4] = [8.0, 4.0, 3.0, 3.0];

/// Slope of the lit line on the seam's own sheet (px of x per px of y) without what the lens adds; of a bend, the mean of both flanks. `None`
/// where no seam is found, or too little of the sheet is lit.
pub fn slope(sensor: &SeamSensor, camera: &Pinhole, joint: Joint, view: &View) -> Option<f32> {
    let find = sensor.find(view).ok()?;
    let line = sensor.trace(view).ok()?;
    let slope_of = |below: bool| {
        let own = move |y: f32| {
            let away = if below { y - find.y } else { find.y - y };
            away > SKIPPED && away < REACH
        };
        let rows = line
            .in_image()
            .iter()
            .map(|row| (row.y - find.y, row.x - find.x, row.weight));
        let line = fit(rows.filter(move |(y, ..)| own(y + find.y)), find.slope)?;
        let [x, y] = line.middle;
        Some(camera.slope(find.x + x, find.y + y, line.slope))
    };
    match joint {
        // Left of travel is up in the image: the lower sheet lies below it.
        Joint::Crank { upper_left, .. } => slope_of(upper_left),
        Joint::Lip { sheet_left, .. } => slope_of(!sheet_left),
        Joint::Vee { .. } => Some(0.5 * (slope_of(false)? + slope_of(true)?)),
    }
}

/// A straight line: its slope, and the middle (x, y) of what it was fitted to, where a lens that bends it a little leaves it that slope.
struct Straight {
    slope: f32,
    middle: [f32; 2],
}

/// Robust straight line through (y, x, weight). The first guess is the line through the origin with slope `guess`.
fn fit(rows: impl Iterator<Item = (f32, f32, f32)> + Clone, guess: f32) -> Option<Straight> {
    let (mut offset, mut slope) = (0.0_f32, guess);
    let mut middle = [0.0_f32; 2];
    for (round, soft) in SOFT.into_iter().enumerate() {
        let (mut w, mut wy, mut wyy, mut wx, mut wyx) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for (y, x, weight) in rows.clone() {
            let share = (x - offset - slope * y) / soft;
            let near = 1.0 / (1.0 + share * share);
            let weight = weight * near * near;
            w += weight;
            wy += weight * y;
            wyy += weight * y * y;
            wx += weight * x;
            wyx += weight * y * x;
        }
        let spread = w * wyy - wy * wy;
        // The first round may start far off, on a bend: only the last says how much is lit.
        let enough = if round + 1 < SOFT.len() { 1.0 } else { FEWEST };
        if w < enough || spread <= w * w {
            return None;
        }
        slope = (w * wyx - wy * wx) / spread;
        offset = (wx - slope * wy) / w;
        middle = [wx / w, wy / w];
    }
    Some(Straight { slope, middle })
}
