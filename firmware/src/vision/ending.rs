//! The edge of a sheet beside a gap, where its line ends.
//!
//! Outward from the sheet rows belong to the sheet, then to the gap, then to the next sheet. On the sheet its own line shows light, in the
//! gap none, on the next sheet that one's. What contradicts this has a price, and more of the same in the rows that follow a lower one:
//! drop-outs come in runs, and so do reflections. What is left of a line in a drop-out is dimmer than the camera's noise in any one
//! row; summed over the run it tells a drop-out from the gap. The likelihood of the sheet's end is that of the best place of the next
//! sheet's beginning.

use super::edge::{Edge, Light, REACH, ROWS, SATURATED, Sides};
use super::image::View;
use super::number::limit;

/// Half the width over which a line's light is summed, px.
const HALF_BOX: usize = 3;
/// Sides whose means are less than this apart, grey levels, show ambient light; beyond, one shows a reflection.
const AMBIENT: f32 = 5.0;
/// Standard deviation of a line's light over its sides, in units of that of a pixel: √(1/7 + 1/16), and a tenth for what differs.
const NOISE: f32 = 0.5;
/// Mean difference of two neighbours, in standard deviations of a pixel: 2/√π.
const DIFFERENCE: f32 = 1.128;
/// Light below this many standard deviations is dark.
const DARK: f32 = 3.0;
/// A row's light begins to say something at this many standard deviations, …
const SEEN: f32 = 2.0;
/// … and says all that it can this many further up.
const SURE: f32 = 6.0;
/// Price of a drop-out, of every row of it, and of every row of a light in the gap after the first: minus log likelihoods.
const DROP_OUT: f32 = 3.0;
/// See [`DROP_OUT`].
const DROP_OUT_ROW: f32 = 0.5;
/// Price of a light in the gap.
const REFLECTION: f32 = 3.0;
/// See [`DROP_OUT`].
const REFLECTION_ROW: f32 = 1.0;
/// Price of no gap at all.
const NO_GAP: f32 = 1.5;
/// Price of a row in which the other sheet's line shows all the light.
const CONTRADICTION: f32 = 4.0;
/// A saturated row's share of that price; grains of speckle saturate, too.
const GLARE_WEIGHT: f32 = 0.4;
/// Rows by which a sheet seems longer: a row's blur takes 0.18 to 0.25 of the light into the next, enough to be seen there.
const LEAK: f32 = 1.0;

/// Light of a row on the sheet's line and on the next sheet's, grey levels.
#[derive(Clone, Copy, Default)]
struct Row {
    own: f32,
    next: f32,
    glare: bool,
}

/// Locates the end of a sheet within [`REACH`] rows of row `expected`. The sheet lies above it, or below it if it `begins` there; `lines`
/// gives the columns of its line and of the next sheet's in a row.
pub fn locate(view: &View, light: Light, expected: usize, begins: bool, lines: impl Fn(f32) -> (f32, f32)) -> Edge {
    let first = expected.saturating_sub(REACH);
    let mut rows = [Row::default(); ROWS];
    let mut differences = 0;
    for (passed, row) in rows.iter_mut().enumerate() {
        let at = first + if begins { ROWS - 1 - passed } else { passed };
        let (own, next) = lines(at as f32);
        let (own, own_glare, roughness) = on_line(view, light, at, own);
        let (next, next_glare, _) = on_line(view, light, at, next);
        differences += roughness;
        *row = Row {
            own,
            next,
            glare: own_glare || next_glare,
        };
    }
    let pixel = differences as f32 / (ROWS * Sides::DIFFERENCES) as f32 / DIFFERENCE;
    let noise = NOISE * pixel.max(1.0);
    let passed = Edge::likeliest(&log_likelihood(&rows, noise), 0.0, 1.0);
    // Where the next sheet's line follows at once, that one's light outshines what leaks.
    let follows = rows
        .get((passed.y + REACH as f32 + 0.5) as usize)
        .map_or(0.0, |row| seen(row.next, noise));
    let passed_rows = passed.y - LEAK * (1.0 - follows);
    let middle = (first + REACH) as f32 - 0.5;
    Edge {
        y: if begins {
            middle - passed_rows
        } else {
            middle + passed_rows
        },
        ..passed
    }
}

/// Logarithm of the likelihood that the sheet ends with none, one, … of `rows` passed; `noise` is a light's standard deviation.
fn log_likelihood(rows: &[Row; ROWS], noise: f32) -> [f32; ROWS + 1] {
    let mut result = [0.0_f32; ROWS + 1];
    // From the far end: the next sheet, and before it the gap.
    let mut run = Run::default();
    let (mut on_next, mut beyond, mut lit_before) = (0.0_f32, 0.0_f32, false);
    for (value, row) in result.iter_mut().rev().skip(1).zip(rows.iter().rev()) {
        on_next += run.pass(row.next, row.own, row.glare, noise);
        let lit = seen(row.own.max(row.next), noise);
        beyond -= lit * if lit_before { REFLECTION_ROW } else { REFLECTION };
        lit_before = lit > 0.5;
        *value = if beyond > on_next {
            beyond
        } else {
            beyond = on_next;
            on_next - NO_GAP
        };
    }
    // From the sheet.
    run = Run::default();
    let mut on_sheet = 0.0_f32;
    for (value, row) in result.iter_mut().skip(1).zip(rows) {
        on_sheet += run.pass(row.own, row.next, row.glare, noise);
        *value += on_sheet;
    }
    result
}

/// How surely light is seen, 0..=1.
fn seen(light: f32, noise: f32) -> f32 {
    limit((light - SEEN * noise) / (SURE * noise), 0.0, 1.0)
}

/// Dark rows next to each other on a line.
#[derive(Clone, Copy, Default)]
struct Run {
    rows: f32,
    /// Sum of what light they show, and the log likelihood of all of them.
    light: f32,
    odds: f32,
}

impl Run {
    /// Log likelihood of a further row of a line that shows light `own` while the other line shows `other`.
    fn pass(&mut self, own: f32, other: f32, glare: bool, noise: f32) -> f32 {
        let brighter = own.max(other);
        if brighter < DARK * noise {
            self.rows += 1.0;
            self.light += own.max(0.0);
            let price = DROP_OUT + DROP_OUT_ROW * self.rows;
            let dim = self.light * self.light / (2.0 * self.rows * noise * noise);
            let before = self.odds;
            self.odds = dim.min(price) - price;
            return self.odds - before;
        }
        *self = Self::default();
        let worse = limit((other - own) / brighter, 0.0, 1.0);
        -CONTRADICTION * worse * seen(brighter, noise) * if glare { GLARE_WEIGHT } else { 1.0 }
    }
}

/// Light about column `x` over its sides in the same row, grey levels, whether a pixel there is saturated, and the roughness of its sides.
fn on_line(view: &View, light: Light, row: usize, x: f32) -> (f32, bool, u32) {
    let middle = (x + 0.5).max(0.0) as usize;
    let (first, last) = (middle.saturating_sub(HALF_BOX), middle + HALF_BOX + 1);
    let ceiling = (light.background + light.contrast) as u32;
    let (mut sum, mut saturated) = (0_u32, false);
    for &pixel in view.span(row, first, last) {
        sum += u32::from(pixel).min(ceiling);
        saturated |= pixel >= SATURATED;
    }
    let (dark, roughness) = Sides::of(view, row, first, last).dark(AMBIENT);
    (sum as f32 / (2 * HALF_BOX + 1) as f32 - dark, saturated, roughness)
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    const SIDE: usize = 250;
    /// Columns of the sheet's line and of the next sheet's, the row in which the one ends and the one in which the other begins.
    const LINES: (f32, f32) = (100.0, 125.0);
    const END: usize = 130;
    const NEXT: usize = 140;

    /// The sheet above, the next one below; noise of one grey level, the same in every run.
    fn image() -> Vec<u8> {
        let mut pixels: Vec<u8> = (0..SIDE * SIDE).map(|at| 20 + (at * 7 % 5 % 3) as u8).collect();
        light(&mut pixels, 0..END, LINES.0, 80);
        light(&mut pixels, NEXT..SIDE, LINES.1, 80);
        pixels
    }

    fn light(pixels: &mut [u8], rows: core::ops::Range<usize>, x: f32, level: u8) {
        for row in pixels.chunks_exact_mut(SIDE).skip(rows.start).take(rows.len()) {
            for pixel in &mut row[x as usize - 3..=x as usize + 3] {
                *pixel += level;
            }
        }
    }

    fn darken(pixels: &mut [u8], rows: core::ops::Range<usize>) {
        for row in pixels.chunks_exact_mut(SIDE).skip(rows.start).take(rows.len()) {
            row.fill(21);
        }
    }

    fn found(pixels: &[u8], expected: usize, begins: bool) -> f32 {
        let view = View::new(pixels, SIDE, SIDE).unwrap();
        let light = Light {
            background: 21.0,
            contrast: 80.0,
        };
        locate(&view, light, expected, begins, |_| LINES).y
    }

    /// Rows by which the sheet of [`image`] is found too long.
    fn too_long(pixels: &[u8]) -> f32 {
        found(pixels, 134, false) - (END as f32 - 0.5 - LEAK)
    }

    #[test]
    fn a_sheet_ends_where_its_line_does_less_what_a_row_leaks_whichever_side_it_lies_on() {
        let above = image();
        assert!(too_long(&above).abs() < 0.3, "{} rows", too_long(&above));
        let below: Vec<u8> = above.rchunks_exact(SIDE).flatten().copied().collect();
        let row = found(&below, SIDE - 134, true);
        assert!((row - ((SIDE - END) as f32 - 0.5 + LEAK)).abs() < 0.3, "row {row}");
    }

    #[test]
    fn a_drop_out_on_the_sheet_does_not_end_it() {
        let mut pixels = image();
        darken(&mut pixels, 118..123);
        assert!(too_long(&pixels).abs() < 0.5, "{} rows", too_long(&pixels));
    }

    #[test]
    fn what_a_drop_out_leaves_of_the_line_at_its_end_is_seen() {
        let mut pixels = image();
        darken(&mut pixels, 124..END);
        light(&mut pixels, 124..END, LINES.0, 2);
        assert!(too_long(&pixels).abs() < 2.0, "{} rows", too_long(&pixels));
    }

    #[test]
    fn reflections_of_either_line_beside_the_other_move_nothing() {
        let mut of_next = image();
        light(&mut of_next, NEXT..NEXT + 25, LINES.0, 70);
        assert!(too_long(&of_next).abs() < 0.5, "{} rows", too_long(&of_next));
        let mut of_sheet = image();
        light(&mut of_sheet, 105..END, LINES.1, 70);
        assert!(too_long(&of_sheet).abs() < 0.5, "{} rows", too_long(&of_sheet));
    }
}
