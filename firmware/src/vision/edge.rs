//! Where along the line its sheet ends, row by row.
//!
//! Once the lines of both sheets are known, a row near the seam is asked which of them shows light: the pixels about each
//! are summed, cut at the line's own brightness, over the darker of the row's own two sides: a dim row counts as long as it shows
//! through the camera's noise. What a row can say is limited, so that a glint of a few rows moves the edge no further than its
//! own size, and a row without light says next to nothing. The sum of what the rows say, over
//! all places of the edge, is the logarithm of the place's likelihood; its mean and deviation are the answer.

use super::image::{self, View};
use super::number::limit;
use crate::geometry::trig::sqrt;

/// Rows about the expected place that are asked, to either side.
pub const REACH: usize = 32;
/// Half the width over which a single line's light is summed, px.
const HALF_BOX: usize = 2;
/// Half the width over which light may lean, px: half a step and the half width of a broad line; ghosts lie beyond.
const LEAN_REACH: f32 = 10.0;
/// Half the width over which a glare's centre is taken, px.
const GLARE_REACH: f32 = 16.0;
/// More saturated pixels than this are glare, px.
const GLARE: usize = 2;
/// A row may turn the odds by exp(this), as speckle is correlated over two rows and heavy-tailed.
const ROW_LIMIT: f32 = 2.0;
/// Log odds per lean, which is 1 where all light is on one side and about 0.7 for a line of 7 px.
const LEAN_ODDS: f32 = 4.0;
/// A row with less light than this, grey levels times px, leans by chance: twice the noise of 4 of a pixel over the reach.
const FAINT: f32 = 40.0;
/// A row with glare says this much of it.
const GLARE_WEIGHT: f32 = 0.2;
/// A saturated pixel.
const SATURATED: u8 = 250;
/// A sheet's line is there if it is brighter than its sides by this much, grey levels: 2.5 times the noise of 4 of a pixel,
/// averaged over box and side. A drop-out leaves less than a third of a line of 40 to 170.
const DIM: f32 = 6.0;
/// Log odds per grey level beyond.
const DIM_ODDS: f32 = 0.5;
/// Log odds for a sheet's line against a reflection, by the difference of their light in units of the brighter.
const REFLECTION_ODDS: f32 = 3.0;
/// Where pixels are saturated; grains of speckle saturate, too.
const SINGLE_GLARE_WEIGHT: f32 = 0.4;
/// Rows by which a sheet seems longer: a row's blur takes 0.18 to 0.25 of the light into the next, above [`DIM`] of most lines.
const LEAK: f32 = 1.0;
/// Width of a side and its distance from the box, px.
const SIDE: usize = 8;
/// See [`SIDE`].
const SIDE_AWAY: usize = 6;
/// A dark row says less against a sheet: it may have dropped out, and drop-outs come in runs.
const DARK_LIMIT: f32 = 0.8;

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// From one line to the other: a lap joint.
    Exchange,
    /// The line above the edge ends; what lies below is too far off to compare with.
    Ends,
    /// The line below the edge begins.
    Begins,
}

/// The edge's place.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Row, px.
    pub y: f32,
    /// Its standard deviation, px.
    pub sigma: f32,
}

/// Brightness of the line.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Background, grey levels.
    pub background: f32,
    /// Line above the background, grey levels.
    pub contrast: f32,
}

/// Locates the edge within [`REACH`] rows of row `expected`; `lines` gives the columns of the line above the edge and of the
/// one below, for a row.
pub fn locate(view: &View, light: Light, expected: usize, change: Change, lines: impl Fn(f32) -> (f32, f32)) -> Edge {
    let first = expected.saturating_sub(REACH);
    // Log odds that a row lies above the edge.
    let mut says = [0.0_f32; 2 * REACH];
    for (row, say) in (first..view.height()).zip(&mut says) {
        let (above, below) = lines(row as f32);
        *say = match change {
            Change::Exchange => lean(view, light, row, above, below),
            Change::Ends => one_of_two(view, light, row, above, below),
            Change::Begins => -one_of_two(view, light, row, below, above),
        };
    }
    // With the edge above the first row, all rows lie below it; each row that it passes changes sides.
    let mut log_likelihood = [0.0_f32; 2 * REACH + 1];
    let (mut sum, mut most) = (0.0_f32, 0.0_f32);
    for (value, say) in log_likelihood.iter_mut().skip(1).zip(&says) {
        sum += say;
        *value = sum;
        most = most.max(sum);
    }
    let (mut mass, mut moment, mut square) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (step, value) in log_likelihood.iter().enumerate() {
        let likelihood = decay(most - value);
        let at = step as f32 - REACH as f32;
        mass += likelihood;
        moment += likelihood * at;
        square += likelihood * at * at;
    }
    let mean = moment / mass;
    // Light leaks into the first row past a sheet's edge, and suffices there to be seen.
    let leak = match change {
        Change::Exchange => 0.0,
        Change::Ends => -LEAK,
        Change::Begins => LEAK,
    };
    Edge {
        y: first as f32 + REACH as f32 + mean - 0.5 + leak,
        // A row's own width: uniform over one row, √(1/12).
        sigma: sqrt((square / mass - mean * mean).max(0.083)),
    }
}

/// Log odds that a row lies above the edge, by how far its light leans toward column `above` rather than `below`.
fn lean(view: &View, light: Light, row: usize, above: f32, below: f32) -> f32 {
    let middle = 0.5 * (above + below);
    let per_px = 2.0 / (above - below);
    let first = (middle - LEAN_REACH).max(0.0) as usize;
    let last = first + 2 * LEAN_REACH as usize + 1;
    let ceiling = (light.background + light.contrast) as u8;
    let dark = darker_side(view, row, first, last);
    // Beyond either line light counts fully for its side: whole numbers suffice there.
    let half = if above > below { middle - below } else { middle - above };
    let between = (middle - half + 1.0).max(0.0) as usize;
    let beyond = (middle + half) as usize + 1;
    let pixels = view.span(row, first, last);
    let (left, rest) = pixels.split_at(between.saturating_sub(first).min(pixels.len()));
    let (inner, right) = rest.split_at(beyond.saturating_sub(between.max(first)).min(rest.len()));
    let (on_left, left_saturated) = cut(left, ceiling, dark);
    let (on_right, right_saturated) = cut(right, ceiling, dark);
    let mut saturated = left_saturated + right_saturated;
    let mut mass = on_left + on_right;
    let mut sum = if above > below {
        on_right - on_left
    } else {
        on_left - on_right
    };
    let mut at = (first + left.len()) as f32;
    for &pixel in inner {
        let side = (at - middle) * per_px;
        at += 1.0;
        let light = f32::from(pixel.min(ceiling)) - dark;
        mass += light;
        sum += side * light;
        saturated += usize::from(pixel >= SATURATED);
    }
    if saturated <= GLARE {
        let lit = if mass > FAINT { mass } else { FAINT };
        return limit(LEAN_ODDS * sum / lit, -ROW_LIMIT, ROW_LIMIT);
    }
    // Cut at the line's brightness, a broad glare covers both places alike: its centre tells more than its inside.
    let first = (middle - GLARE_REACH).max(0.0) as usize;
    let (mut mass, mut moment) = (0.0_f32, 0.0_f32);
    for (index, &pixel) in view
        .span(row, first, first + 2 * GLARE_REACH as usize + 1)
        .iter()
        .enumerate()
    {
        let bright = (f32::from(pixel) - light.background - light.contrast).max(0.0);
        mass += bright;
        moment += bright * ((first + index) as f32 - middle);
    }
    let leaning = limit(moment / mass.max(1.0) * per_px, -1.0, 1.0);
    GLARE_WEIGHT * limit(LEAN_ODDS * leaning, -ROW_LIMIT, ROW_LIMIT)
}

/// Light of `pixels`, cut at `ceiling`, over `dark`, grey levels times px; and how many are saturated.
fn cut(pixels: &[u8], ceiling: u8, dark: f32) -> (f32, usize) {
    let (mut sum, mut saturated) = (0_u32, 0);
    for &pixel in pixels {
        sum += u32::from(pixel.min(ceiling));
        saturated += usize::from(pixel >= SATURATED);
    }
    (sum as f32 - pixels.len() as f32 * dark, saturated)
}

/// Log odds that a row shows the sheet at column `sheet` rather than the gap or the next sheet at `next`. Where the next sheet is
/// the brighter the sheet has ended, whatever reflection lies on its continuation.
fn one_of_two(view: &View, light: Light, row: usize, sheet: f32, next: f32) -> f32 {
    let (own, own_glare) = single(view, light, row, sheet);
    let (other, other_glare) = single(view, light, row, next);
    let brighter = if own > other { own } else { other };
    if brighter < DIM {
        // The gap, or a drop-out.
        return -DARK_LIMIT;
    }
    let surely = limit(DIM_ODDS * (brighter - DIM), 0.0, ROW_LIMIT);
    let log_odds = limit(REFLECTION_ODDS * (own - other) / brighter, -surely, surely);
    if own_glare || other_glare {
        SINGLE_GLARE_WEIGHT * log_odds
    } else {
        log_odds
    }
}

/// Light about column `x` over the darker of its two sides in the same row, grey levels, and whether a pixel there is saturated.
fn single(view: &View, light: Light, row: usize, x: f32) -> (f32, bool) {
    let middle = (x + 0.5).max(0.0) as usize;
    let first = middle.saturating_sub(HALF_BOX);
    let pixels = view.span(row, first, middle + HALF_BOX + 1);
    let ceiling = (light.background + light.contrast) as u32;
    let (mut sum, mut saturated) = (0_u32, 0);
    for &pixel in pixels {
        sum += u32::from(pixel).min(ceiling);
        saturated += usize::from(pixel >= SATURATED);
    }
    let dark = darker_side(view, row, first, middle + HALF_BOX + 1);
    (sum as f32 / (2 * HALF_BOX + 1) as f32 - dark, saturated > 0)
}

/// Mean of the darker of the two sides of columns `first..last`, grey levels: a ghost lies on one side only.
fn darker_side(view: &View, row: usize, first: usize, last: usize) -> f32 {
    let side = |from: usize| {
        let (fours, _) = view.span(row, from, from + SIDE).as_chunks();
        fours.iter().fold(0, |total, &four| total + image::sum([four]))
    };
    let dark = side(first.saturating_sub(SIDE_AWAY + SIDE)).min(side(last + SIDE_AWAY));
    dark as f32 / SIDE as f32
}

/// exp(−cost) as (1 + cost/64)⁻⁶⁴: 1 % high at a cost of 1, twice as high at 10, where a place no longer counts.
pub fn decay(cost: f32) -> f32 {
    let mut power = 1.0 + cost / 64.0;
    for _ in 0..6 {
        power *= power;
    }
    1.0 / power
}
