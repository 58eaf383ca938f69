//! The edge of a sheet beside a gap, where its line ends.
//!
//! Outward from the sheet rows belong to the sheet, then to the gap, then to the next sheet. On the sheet its own line shows light, in the
//! gap none, on the next sheet that one's. What contradicts this has a price, and more of the same in the rows that follow a lower one:
//! drop-outs come in runs, and so do reflections. A reflection is darker than what it reflects, so that light is not cut here. What is left
//! of a line in a drop-out is dimmer than the camera's noise in any one row; summed over the run it tells a drop-out from the gap. The
//! likelihood of the sheet's end is that of the best place of the next sheet's beginning, and better known where the length of the gap is.
//! The prices were tuned by hand on scenes of seeds 777, 1001, 1002 and 4711.

use super::edge::{Edge, REACH, ROWS, SATURATED, Sides};
use super::image::View;
use super::number::limit;

/// The width of either half over which a line's light is summed, the middle column aside, px.
const HALF_BOX: usize = 3;
/// Sides whose means are less than this apart, grey levels, show ambient light; beyond, one shows a reflection.
const AMBIENT: f32 = 5.0;
/// Standard deviation of a line's light over its sides, in units of that of a pixel: √(1/4 + 1/16), and a tenth for what differs.
const NOISE: f32 = 0.6;
/// Mean difference of two neighbours, in standard deviations of a pixel: 2/√π.
const DIFFERENCE: f32 = 1.128;
/// Light below this many standard deviations is dark.
const DARK: f32 = 3.0;
/// A row's light begins to say something at this many standard deviations, …
const SEEN: f32 = 1.5;
/// … and says all that it can this many further up.
const PLAIN: f32 = 10.0;
/// Price of a drop-out, of every row of it, and of every row of a light in the gap after the first: minus log likelihoods.
const DROP_OUT: f32 = 1.5;
/// See [`DROP_OUT`].
const DROP_OUT_ROW: f32 = 0.5;
/// Price of a light in the gap.
const REFLECTION: f32 = 2.4;
/// See [`DROP_OUT`].
const REFLECTION_ROW: f32 = 1.4;
/// Ends of the sheet that are less likely than the likeliest by exp(−this), whatever the gap, are not asked for a known one.
const IRRELEVANT: f32 = 25.0;
/// Price of no gap at all.
const NO_GAP: f32 = 1.5;
/// Price of a row in which the other sheet's line shows all the light.
const CONTRADICTION: f32 = 2.4;
/// A saturated row's share of that price; grains of speckle saturate, too.
const GLARE_WEIGHT: f32 = 0.35;
/// Rows by which a sheet seems longer: a row's blur takes 0.18 to 0.25 of the light into the next, enough to be seen there.
const LEAK: f32 = 1.0;

/// Light of a row on the sheet's line and on the next sheet's, grey levels.
#[derive(Clone, Copy, Default)]
struct Row {
    own: f32,
    next: f32,
    glare: bool,
}

/// How many lengths of the gap are told apart, rows: the expected one and so many to either side.
pub const GAPS: usize = 2 * GAP_REACH + 1;
/// See [`GAPS`].
const GAP_REACH: usize = 6;

/// What is known of the gap beside a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Gap {
    /// The shortest, rows; where both lines share rows it is negative.
    pub shortest: i32,
    /// Log likelihood of that length and of those that follow, a row longer each.
    pub log_likelihood: [f32; GAPS],
}

impl Gap {
    /// The shortest of the lengths about `expected`, rows.
    pub fn shortest_about(expected: f32) -> i32 {
        // Casts round toward zero.
        const ABOVE_ZERO: i32 = 1000;
        (expected + ABOVE_ZERO as f32 + 0.5) as i32 - ABOVE_ZERO - GAP_REACH as i32
    }
}

/// What the rows about the end of a sheet say.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Log likelihood of the rows that belong to the sheet, if none, one, … of them do.
    sheet: [f32; ROWS + 1],
    /// Of those that are left, if they belong to the next sheet.
    next: [f32; ROWS + 1],
    /// Price of the light in them, if they belong to the gap.
    lights: [f32; ROWS + 1],
    /// Log likelihood of all rows, whatever the gap, by the rows that belong to the sheet; and the most of it.
    alone: [f32; ROWS + 1],
    most: f32,
    /// How surely each row shows the next sheet's line.
    follows: [f32; ROWS],
    /// Row between the first half of the rows and the others, and the direction in which they pass.
    middle: f32,
    direction: f32,
}

impl Profile {
    /// Asks the rows within [`REACH`] rows of row `expected` for the end of a sheet. The sheet lies above it, or below it if it `begins`
    /// there; `lines` gives the columns of its line and of the next sheet's in a row.
    pub fn read(view: &View, expected: usize, begins: bool, lines: impl Fn(f32) -> (f32, f32)) -> Self {
        let first = expected.saturating_sub(REACH);
        let mut rows = [Row::default(); ROWS];
        let mut differences = 0;
        for (passed, row) in rows.iter_mut().enumerate() {
            let at = first + if begins { ROWS - 1 - passed } else { passed };
            let (own, next) = lines(at as f32);
            let (own, own_glare, roughness) = on_line(view, at, own);
            let (next, next_glare, _) = on_line(view, at, next);
            differences += roughness;
            *row = Row {
                own,
                next,
                glare: own_glare || next_glare,
            };
        }
        let pixel = differences as f32 / (ROWS * Sides::DIFFERENCES) as f32 / DIFFERENCE;
        let noise = NOISE * pixel.max(1.0);
        let mut profile = Self::of(&rows, noise);
        profile.middle = (first + REACH) as f32 - 0.5;
        profile.direction = if begins { -1.0 } else { 1.0 };
        profile
    }

    /// That of `rows`, in which a light's standard deviation is `noise`.
    fn of(rows: &[Row; ROWS], noise: f32) -> Self {
        let mut profile = Self {
            sheet: [0.0; ROWS + 1],
            next: [0.0; ROWS + 1],
            lights: [0.0; ROWS + 1],
            alone: [0.0; ROWS + 1],
            most: f32::MIN,
            follows: [0.0; ROWS],
            middle: 0.0,
            direction: 1.0,
        };
        let mut run = Run::default();
        let mut sum = 0.0_f32;
        for (sheet, row) in profile.sheet.iter_mut().skip(1).zip(rows) {
            sum += run.pass(row.own, row.next, row.glare, noise);
            *sheet = sum;
        }
        // From the far end.
        run = Run::default();
        let (mut on_next, mut lights, mut lit_before) = (0.0_f32, 0.0_f32, false);
        let backward = profile.next.iter_mut().zip(&mut profile.lights).rev().skip(1);
        for (((next, light), follows), row) in backward.zip(profile.follows.iter_mut().rev()).zip(rows.iter().rev()) {
            on_next += run.pass(row.next, row.own, row.glare, noise);
            *next = on_next;
            let lit = seen(row.own.max(row.next), noise);
            lights += lit * if lit_before { REFLECTION_ROW } else { REFLECTION };
            lit_before = lit > 0.5;
            *light = lights;
            *follows = seen(row.next, noise);
        }
        // Likeliest beginning of the next sheet beyond a gap, with all the light to the far end as its price.
        let mut beyond = f32::MIN;
        let on_next = profile.next.iter().zip(&profile.lights).zip(&profile.sheet);
        for (alone, ((&next, &lights), &sheet)) in profile.alone.iter_mut().zip(on_next).rev() {
            let (apart, close) = (beyond - lights, next - NO_GAP);
            *alone = sheet + if apart > close { apart } else { close };
            beyond = beyond.max(next + lights);
            profile.most = profile.most.max(*alone);
        }
        profile
    }

    /// The end of the sheet, whatever the gap beside it.
    pub fn edge(&self) -> Edge {
        self.edge_of(&self.alone)
    }

    /// The same where the gap is known.
    pub fn edge_beside(&self, gap: &Gap) -> Edge {
        let mut log_likelihood = [self.most - 2.0 * IRRELEVANT; ROWS + 1];
        for (value, (end, lights, sheet)) in log_likelihood.iter_mut().zip(self.ends()) {
            let Some(end) = end else { continue };
            let mut most = f32::MIN;
            for (at, log_likelihood) in (end + gap.shortest..).zip(gap.log_likelihood) {
                let here = self.beyond(lights, at) + log_likelihood;
                if here > most {
                    most = here;
                }
            }
            *value = sheet + most;
        }
        self.edge_of(&log_likelihood)
    }

    /// Log likelihood of all rows with each length of the gap from `shortest` on, at the sheet's best end.
    pub fn gaps(&self, shortest: i32) -> [f32; GAPS] {
        let mut gaps = [self.most - 2.0 * IRRELEVANT; GAPS];
        for (end, lights, sheet) in self.ends() {
            let Some(end) = end else { continue };
            for (gap, at) in gaps.iter_mut().zip(end + shortest..) {
                let here = sheet + self.beyond(lights, at);
                if here > *gap {
                    *gap = here;
                }
            }
        }
        gaps
    }

    /// By the rows that belong to the sheet: their number, if it is not out of the question, the price of all light beyond, and their log
    /// likelihood.
    fn ends(&self) -> impl Iterator<Item = (Option<i32>, f32, f32)> {
        let by_rows = self.alone.iter().zip(&self.lights).zip(&self.sheet).zip(0..);
        by_rows.map(|(((&alone, &lights), &sheet), end)| {
            let asked = alone > self.most - IRRELEVANT;
            (asked.then_some(end), lights, sheet)
        })
    }

    fn edge_of(&self, log_likelihood: &[f32; ROWS + 1]) -> Edge {
        let passed = Edge::likeliest(log_likelihood, 0.0, 1.0);
        // Where the next sheet's line follows at once, that one's light outshines what leaks.
        let follows = self
            .follows
            .get((passed.y + REACH as f32 + 0.5) as usize)
            .copied()
            .unwrap_or(0.0);
        Edge {
            y: self.middle + self.direction * (passed.y - LEAK * (1.0 - follows)),
            ..passed
        }
    }

    /// Log likelihood of the rows after the sheet, if the next one begins in row `at` of them, where `lights` is the price of all light
    /// beyond the sheet.
    fn beyond(&self, lights: f32, at: i32) -> f32 {
        let at = at.max(0) as usize;
        match (self.next.get(at), self.lights.get(at)) {
            (Some(next), Some(after)) => next - (lights - after).max(0.0),
            _ => -lights,
        }
    }
}

/// How surely light is seen, 0..=1.
fn seen(light: f32, noise: f32) -> f32 {
    limit((light - SEEN * noise) / (PLAIN * noise), 0.0, 1.0)
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
/// It is that of the darker half: a line lights both, most glints only one.
fn on_line(view: &View, row: usize, x: f32) -> (f32, bool, u32) {
    let middle = (x + 0.5).max(0.0) as usize;
    let (first, last) = (middle.saturating_sub(HALF_BOX), middle + HALF_BOX + 1);
    let mut saturated = false;
    let mut half = |from: usize| {
        view.span(row, from, from + HALF_BOX + 1).iter().fold(0, |sum, &pixel| {
            saturated |= pixel >= SATURATED;
            sum + u32::from(pixel)
        })
    };
    let light = half(first).min(half(middle));
    let (dark, roughness) = Sides::of(view, row, first, last).dark(AMBIENT);
    (light as f32 / (HALF_BOX + 1) as f32 - dark, saturated, roughness)
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
        Profile::read(&view, expected, begins, |_| LINES).edge().y
    }

    /// Rows by which the sheet of [`image`] is found too long.
    fn too_long(pixels: &[u8]) -> f32 {
        found(pixels, 134, false) - (END as f32 - 0.5 - LEAK)
    }

    #[test]
    fn a_sheet_ends_where_its_line_does_less_what_a_row_leaks_whichever_side_it_lies_on() {
        let above = image();
        assert!(too_long(&above).abs() < 0.5, "{} rows", too_long(&above));
        let below: Vec<u8> = above.rchunks_exact(SIDE).flatten().copied().collect();
        let row = found(&below, SIDE - 134, true);
        assert!((row - ((SIDE - END) as f32 - 0.5 + LEAK)).abs() < 0.5, "row {row}");
    }

    #[test]
    fn a_drop_out_on_the_sheet_does_not_end_it() {
        let mut pixels = image();
        darken(&mut pixels, 118..123);
        assert!(too_long(&pixels).abs() < 0.5, "{} rows", too_long(&pixels));
    }

    #[test]
    fn a_drop_out_beside_the_gap_is_told_from_it_where_its_length_is_known() {
        let mut pixels = image();
        darken(&mut pixels, 124..END);
        let view = View::new(&pixels, SIDE, SIDE).unwrap();
        let profile = Profile::read(&view, 134, false, |_| LINES);
        let shortest = Gap::shortest_about((NEXT - END) as f32);
        let log_likelihood = core::array::from_fn(|at| -0.5 * (at as f32 - GAP_REACH as f32).powi(2));
        let known = Gap {
            shortest,
            log_likelihood,
        };
        let end = END as f32 - 0.5 - LEAK;
        let (alone, with_gap) = (profile.edge().y - end, profile.edge_beside(&known).y - end);
        // The next sheet may have dropped out as well: the end lies between what either way says.
        assert!(alone < -5.5 && with_gap.abs() < 3.0, "{alone} and {with_gap} rows");
        // As the rows show it, it is longer.
        let shown = profile.gaps(shortest);
        let likeliest = (0..GAPS).max_by(|&a, &b| shown[a].total_cmp(&shown[b])).unwrap();
        assert!((likeliest as f32 - (GAP_REACH + 6) as f32).abs() < 1.5, "{shown:?}");
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
