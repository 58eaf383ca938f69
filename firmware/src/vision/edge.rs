//! Where along the line its sheet ends, row by row.
//!
//! Once the lines of both sheets are known, a row near the seam is asked which of them shows light: the pixels about each
//! are summed, cut at the line's own brightness. What a row can say is limited, so that a glint of a few rows moves the
//! edge no further than its own size, and a row without light says next to nothing. The sum of what the rows say, over
//! all places of the edge, is the logarithm of the place's likelihood; its mean and deviation are the answer.

use super::image::View;
use super::number::{limit, sqrt};

/// Rows about the expected place that are asked, to either side.
pub const REACH: usize = 24;
/// Half the width over which a single line's light is summed, px.
const HALF_BOX: usize = 2;
/// Half the width over which light may lean, px: half a step and the half width of a broad line; ghosts lie beyond.
const LEAN_REACH: f32 = 10.0;
/// What a line on one side leans by, in px of its full brightness: a width of 7 px, 0.65 of it counted.
const LEAN_PX: f32 = 4.5;
/// Half the width over which a glare's centre is taken, px.
const GLARE_REACH: f32 = 16.0;
/// More saturated pixels than this are glare, px.
const GLARE: usize = 2;
/// A row may turn the odds by exp(this), as speckle is correlated over two rows and heavy-tailed.
const ROW_LIMIT: f32 = 2.0;
/// Log odds per share of the line's brightness by which one place outshines the other: difference of the means (0.7) by the
/// variance of such a share under speckle (0.35²), halved for its correlation from row to row.
const ODDS_PER_SHARE: f32 = 0.7 / (0.35 * 0.35) * 0.5;
/// A row with a saturated pixel in either box says this much of it.
const GLARE_WEIGHT: f32 = 0.2;
/// A saturated pixel.
const SATURATED: u8 = 250;
/// A single line is there if it shows more than this share of its brightness; a drop-out shows less.
const LIT: f32 = 0.3;
/// Log odds per share beyond: with 0.6 of the light a row says all it may.
const LIT_ODDS: f32 = 6.0;
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
        let (log_odds, glare) = match change {
            Change::Exchange => {
                let (lean, glare) = lean(view, light, row, above, below);
                (ODDS_PER_SHARE * lean, glare)
            }
            Change::Ends => single(view, light, row, above),
            Change::Begins => {
                let (log_odds, glare) = single(view, light, row, below);
                (-log_odds, glare)
            }
        };
        let trust = if glare { GLARE_WEIGHT } else { 1.0 };
        *say = trust * limit(log_odds, -ROW_LIMIT, ROW_LIMIT);
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
    Edge {
        y: first as f32 + REACH as f32 + mean - 0.5,
        // A row's own width: uniform over one row, √(1/12).
        sigma: sqrt((square / mass - mean * mean).max(0.083)),
    }
}

/// How far the light of a row leans toward column `above` (+1) or `below` (−1), and whether pixels there are saturated.
fn lean(view: &View, light: Light, row: usize, above: f32, below: f32) -> (f32, bool) {
    let middle = 0.5 * (above + below);
    let per_px = 2.0 / (above - below);
    let first = (middle - LEAN_REACH).max(0.0) as usize;
    let (mut sum, mut saturated) = (0.0_f32, 0);
    for (index, &pixel) in view
        .span(row, first, first + 2 * LEAN_REACH as usize + 1)
        .iter()
        .enumerate()
    {
        let side = limit(((first + index) as f32 - middle) * per_px, -1.0, 1.0);
        sum += side * limit(f32::from(pixel) - light.background, 0.0, light.contrast);
        saturated += usize::from(pixel >= SATURATED);
    }
    if saturated <= GLARE {
        return (sum / (light.contrast * LEAN_PX), false);
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
    (limit(moment / mass.max(1.0) * per_px, -1.0, 1.0), true)
}

/// Log odds that a single line is there, and whether a pixel about it is saturated.
fn single(view: &View, light: Light, row: usize, x: f32) -> (f32, bool) {
    let middle = (x + 0.5).max(0.0) as usize;
    let pixels = view.span(row, middle.saturating_sub(HALF_BOX), middle + HALF_BOX + 1);
    let (mut sum, mut saturated) = (0.0_f32, 0);
    for &pixel in pixels {
        sum += limit(f32::from(pixel) - light.background, 0.0, light.contrast);
        saturated += usize::from(pixel >= SATURATED);
    }
    let share = sum / (light.contrast * (2 * HALF_BOX + 1) as f32);
    (limit(LIT_ODDS * (share - LIT), -DARK_LIMIT, ROW_LIMIT), saturated > 0)
}

/// exp(−cost) as (1 + cost/64)⁻⁶⁴: 1 % high at a cost of 1, twice as high at 10, where a place no longer counts.
pub fn decay(cost: f32) -> f32 {
    let mut power = 1.0 + cost / 64.0;
    for _ in 0..6 {
        power *= power;
    }
    1.0 / power
}
