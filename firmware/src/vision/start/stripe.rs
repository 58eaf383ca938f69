//! The middle of a bend's line between two flanks of unlike brightness.
//!
//! The bottom of a bend is a line of up to a millimetre between two sheets that the light meets at unlike angles. The edge filter reaches over
//! two pixels to either side, less than such a line is wide: where it answers most the step from one sheet to the other pulls to the brighter's
//! side, by up to a pixel and a half. A step is the same at every distance from the middle, and a line is not: with E(u) the mean and D(u) the
//! difference of the light at u px below and above a row, and the line's middle δ px below that row, D(u) = step − 2 δ E′(u). E, of all columns
//! together, is known well, and δ of each column is the regression of its D on E′.

use super::edges::{FRACTION, Point, Points};
use super::line::Line;
use crate::vision::image::View;

/// Columns that are added up on either side of one: grain is a pixel wide.
const BESIDE: usize = 2;
const COLUMNS: f32 = (2 * BESIDE + 1) as f32;
/// Rows to either side that are looked at: the line's, and as many of the sheets, of which rolling marks make every row another.
const REACH: usize = 16;
/// Least height of the line over the sheets, grey levels: less is grain.
const FLOOR: f32 = 5.0;
/// Least height of the line in a column against that of all of them, below which it is lost there.
const LOST: f32 = 0.4;
/// Furthest middle from the row that is looked at, px: a line whose step pulled it, on a seam that is bent by 2 mm over 250 mm.
const FURTHEST: f32 = 3.0;

/// Pieces of the line in which what is left of the differences is looked at, and in each the differences less what they are fitted by.
pub const THIRDS: usize = 3;
const FREE: f32 = (REACH - 4) as f32;

/// Light at 1, 2, … px above and below a row, summed over the columns.
type Pairs = [(i32, i32); REACH];

/// Puts the middles of the line (bright: `sign` 1, dark: −1) near `line` in columns `from` to `to` in the place of `points`. Returns the variance of the
/// middle in a third of them, px²: rolling marks that run along with the line are as much of the difference, and wander slowly.
pub fn trace(view: &View, line: &Line, sign: i32, [from, to]: [f32; 2], points: &mut Points) -> f32 {
    points.clear();
    let sign = sign as f32;
    let first = (from as usize).max(BESIDE);
    let columns = || (first..view.width().saturating_sub(BESIDE)).take_while(|&x| (x as f32) < to);
    let seen = |x: usize| {
        let row = line.at(x as f32) + 0.5;
        let inside = row > REACH as f32 && row + (REACH as f32) < view.height() as f32;
        inside.then(|| (row as usize, pairs(view, x, row as usize)))
    };
    let mut all: Pairs = [(0, 0); REACH];
    let mut count = 0.0_f32;
    for (_, pairs) in columns().filter_map(seen) {
        for ((above, below), (a, b)) in all.iter_mut().zip(pairs) {
            *above += a;
            *below += b;
        }
        count += 1.0;
    }
    let height = height(&all) / count;
    if sign * height < FLOOR * COLUMNS {
        return 0.0;
    }
    // E′ at 2, 3, … px, less its mean; the outermost have no neighbour.
    let mut slopes = [0.0_f32; REACH - 2];
    let neighbours = all.iter().zip(all.iter().skip(2));
    for (slope, ((a, b), (c, d))) in slopes.iter_mut().zip(neighbours) {
        *slope = 0.25 * (c + d - a - b) as f32 / count;
    }
    let mean = slopes.iter().sum::<f32>() / slopes.len() as f32;
    slopes.iter_mut().for_each(|slope| *slope -= mean);
    let spread = slopes.iter().fold(0.0, |sum, slope| sum + slope * slope);
    let mut thirds = [([0_i32; REACH - 2], 0.0_f32); THIRDS];
    let per_third = THIRDS as f32 / count;
    let mut done = 0.0_f32;
    for x in columns() {
        let Some((row, pairs)) = seen(x) else { continue };
        if let Some((sums, columns)) = thirds.get_mut((done * per_third) as usize) {
            for (sum, (above, below)) in sums.iter_mut().zip(pairs.iter().skip(1)) {
                *sum += below - above;
            }
            *columns += 1.0;
        }
        done += 1.0;
        let gain = self::height(&pairs) / height;
        let differences = pairs.iter().skip(1).map(|(above, below)| (below - above) as f32);
        let common = slopes
            .iter()
            .zip(differences)
            .fold(0.0, |sum, (slope, difference)| sum + slope * difference);
        let off = -0.5 * common / (gain * spread);
        if gain > LOST && off.abs() <= FURTHEST {
            // There is a place for every column.
            let _ = points.push(Point {
                along: x as u16,
                across: ((row as f32 + off) * FRACTION as f32 + 0.5) as u16,
                strength: (gain * height.abs() / COLUMNS) as u16,
            });
        }
    }
    let variances = thirds.iter().map(|(sums, columns)| {
        let step = sums.iter().sum::<i32>() as f32 / sums.len() as f32;
        let each = || {
            slopes
                .iter()
                .zip(sums)
                .map(move |(slope, &sum)| (slope, sum as f32 - step))
        };
        let share = each().fold(0.0, |sum, (slope, off)| sum + slope * off) / spread;
        let left = each().fold(0.0, |sum, (slope, off)| {
            let left = off - share * slope;
            sum + left * left
        });
        left / (columns * columns * FREE * 4.0 * spread)
    });
    variances.sum::<f32>() / THIRDS as f32
}

fn pairs(view: &View, x: usize, row: usize) -> Pairs {
    let light = |row: usize| -> i32 {
        let span = view.span(row, x - BESIDE, x + BESIDE + 1);
        span.iter().map(|&level| i32::from(level)).sum()
    };
    core::array::from_fn(|u| (light(row - u - 1), light(row + u + 1)))
}

/// How far the line stands over its foot: the light between 1 and 2 px from its middle, less that between 6 and 7.
fn height(pairs: &Pairs) -> f32 {
    let [(a, b), (c, d), _, _, _, (e, f), (g, h), ..] = pairs;
    0.25 * (a + b + c + d - e - f - g - h) as f32
}

#[cfg(test)]
mod tests {
    use super::super::SIDE;
    use super::super::line::fit;
    use super::*;
    use crate::geometry::trig::sqrt;
    extern crate std;
    use std::vec::Vec;

    const LINE: Line = Line {
        intercept: 224.3,
        slope: 0.03,
        middle: 224.5,
    };

    /// A Gaussian line of this height and standard deviation (px) on [`LINE`], where the light steps from 100 to 100 + `step`.
    fn image(height: f32, sigma: f32, step: f32) -> Vec<u8> {
        let mut state = 1_u32;
        let pixel = |at: usize| {
            let below = (at / SIDE) as f32 - LINE.at((at % SIDE) as f32);
            // No exponential is needed: (1 − t²/8)⁴ is within 0.02 of exp(−t²/2) where it is not zero.
            let t = below / sigma;
            let near = (1.0 - t * t / 8.0).max(0.0);
            let blurred = below / sqrt(below * below + 1.0);
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = (state >> 24) as f32 / 32.0 - 4.0;
            (100.5 + height * near * near * near * near + 0.5 * step * (1.0 + blurred) + noise) as u8
        };
        (0..SIDE * SIDE).map(pixel).collect()
    }

    #[test]
    fn between_unlike_sheets_the_middle_is_found_to_a_tenth_of_a_pixel_from_three_half_pixels_away() {
        for (height, sigma, step) in [(40.0, 2.5, 30.0), (-30.0, 1.5, 25.0), (25.0, 2.0, 0.0)] {
            let pixels = image(height, sigma, step);
            let view = View::new(&pixels, SIDE, SIDE).unwrap();
            let (sign, mut points) = (height.signum() as i32, Points::new());
            let mut line = Line {
                intercept: LINE.intercept + 1.5,
                ..LINE
            };
            for _ in 0..2 {
                trace(&view, &line, sign, [30.0, 420.0], &mut points);
                line = fit(&points, &line, 0.0, SIDE as f32, u16::MAX).unwrap().line;
            }
            let (off, turn) = (line.intercept - LINE.intercept, line.slope - LINE.slope);
            assert!(
                off.abs() < 0.1 && turn.abs() < 2e-4,
                "{off} px, {turn} with {height}, {step}"
            );
            assert!(points.iter().all(|point| (30..420).contains(&point.along)));
            trace(&view, &line, -sign, [30.0, 420.0], &mut points);
            assert!(points.is_empty(), "the line is not of the other sign");
        }
    }
}
