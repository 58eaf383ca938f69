//! The edge of a lap joint, where the light goes over from one sheet's line to the other's.
//!
//! A row leans to the one line or the other by all its light between and beside them, and has its centre near the one or the other: a
//! glint deceives the two in different ways. Where light stands on both lines and the one is much too bright, that is a glint, and
//! the other is the line.

use super::edge::{Edge, Light, REACH, ROWS, SATURATED, Sides};
use super::image::View;
use super::number::limit;
use super::window::{EACH, Line, Sample};

/// Half the width over which light may lean, px: half a step and the half width of a line; ghosts and most glints lie beyond.
const LEAN_REACH: f32 = 7.0;
/// Light outside a line counts up to this multiple of that inside of it: a line lights both its halves, a glint beside it only one.
const OUTSIDE: f32 = 2.5;
/// Saturated pixels over no more than this, px, whose middle is further outside of both lines than …
const GLINT: usize = 7;
/// … this, px, are a glint beside the line: the line is what is left of the row …
const ASIDE: f32 = 2.0;
/// … without it and what it outshines, px.
const RIM: usize = 2;
/// Half the width over which a glare's middle is taken, px.
const GLARE_REACH: f32 = 16.0;
/// Pixels to either side of that middle that are compared.
const BESIDE: usize = 11;
/// What a glare leaves free of a line beside it, px of full brightness.
const FREE_WIDTH: f32 = 3.5;
/// A line as near to a glare's middle as this begins to be hidden, px.
const HIDDEN: f32 = 4.0;
/// A glare that is no wider than this hides no line, px, and …
const NARROW: f32 = 6.0;
/// … one this much wider may hide it whole.
const HIDING: f32 = 3.0;
/// Log odds for a line beside a glare rather than under it.
const SIDE_ODDS: f32 = 3.0;
/// Saturated pixels of a grain of speckle, which is no glare.
const GRAIN: usize = 1;
/// Rows with more saturated pixels than this spoil their neighbours, px.
const GLARE: usize = 2;
/// A row may turn the odds by exp(this), as speckle is correlated over two rows and heavy-tailed.
const ROW_LIMIT: f32 = 2.1;
/// Log odds per lean, which is 1 where all light is on one side and about 0.7 for a line of 7 px.
const LEAN_ODDS: f32 = 4.0;
/// A row with less light than this, grey levels times px, leans by chance or toward a glint in a drop-out: five times the noise of 4 of a
/// pixel over the reach.
const FAINT: f32 = 80.0;
/// A row brighter than usual, a specular stretch, is cut at this share of its own brightness: cut at the line's it would lean nowhere.
const OWN_CEILING: f32 = 0.7;
/// Of the sum of lean and centre this much is said: in part they are the same light.
const SHARED: f32 = 0.7;
/// Rows to either side of glare that it spoils, too, and what is left of what they say.
const SPOILT: usize = 2;
/// See [`SPOILT`].
const SPOILT_WEIGHT: f32 = 0.7;
/// Two lights, one on each line: the darker has at least this share of the line's brightness, …
const LEAST: f32 = 0.3;
/// … the brighter at least this, …
const TOO_BRIGHT: f32 = 1.3;
/// … and between them there is at most this share of the darker.
const VALLEY: f32 = 0.7;
/// Log odds for the darker of two lights.
const TWO_LIGHTS_ODDS: f32 = 1.5;

/// Columns of the line above the edge and of the one below.
type Columns = (f32, f32);

/// Locates the edge within [`REACH`] rows of row `expected`; `lines` gives the sheets' columns in a row, and `sigma` is the standard
/// deviation of a row's centre, px.
pub fn locate(view: &View, line: &Line, sigma: f32, expected: usize, lines: impl Fn(f32) -> Columns) -> Edge {
    let first = expected.saturating_sub(REACH);
    // What each row says, and whether it holds glare.
    let mut says = [(0.0_f32, false); ROWS];
    for (row, say) in (first..view.height()).zip(&mut says) {
        *say = say_of(view, line, sigma, row, lines(row as f32));
    }
    // With the edge above the first row, all rows lie below it; each row that it passes changes sides.
    let mut log_likelihood = [0.0_f32; ROWS + 1];
    let mut sum = 0.0_f32;
    for (index, (value, (say, _))) in log_likelihood.iter_mut().skip(1).zip(&says).enumerate() {
        let mut near = says.iter().skip(index.saturating_sub(SPOILT)).take(2 * SPOILT + 1);
        sum += if near.any(|(_, glare)| *glare) {
            SPOILT_WEIGHT * say
        } else {
            *say
        };
        *value = sum;
    }
    Edge::likeliest(&log_likelihood, (first + REACH) as f32 - 0.5, 1.0)
}

/// Log odds that a row lies above the edge, and whether it holds glare.
fn say_of(view: &View, line: &Line, sigma: f32, row: usize, columns: Columns) -> (f32, bool) {
    let (above, below) = columns;
    let first = (0.5 * (above + below) - LEAN_REACH).max(0.0) as usize;
    let last = first + 2 * LEAN_REACH as usize + 1;
    let dark = Sides::of(view, row, first, last).darker();
    if let Some(odds) = two_lights(view, line.light, row, columns, dark) {
        return (odds, false);
    }
    let (lean, glare) = lean(view, line.light, row, columns, (first, last), dark);
    // A row between two whose centres were taken goes by both.
    let centre = |at: usize| {
        let sample = line.centres.get(at).filter(|sample| sample.weight > 0.0);
        sample.map_or(0.0, |sample| centre_of(sample, columns, 1.0 / (sigma * sigma)))
    };
    let centre = 0.5 * (centre(row / EACH) + centre(row.div_ceil(EACH)));
    (SHARED * (lean + centre), glare)
}

/// Log odds that a centre is that of a row above the edge; `precision` is one over the variance of a row's centre.
fn centre_of(sample: &Sample, (above, below): Columns, precision: f32) -> f32 {
    let (a, b) = (sample.x - above, sample.x - below);
    // As robust as a fit: it may turn the odds by twice ROW_LIMIT at most.
    let cost = |away: f32| {
        let square = away * away * precision;
        0.5 * square / (1.0 + square / (2.0 * ROW_LIMIT))
    };
    sample.weight * (cost(b) - cost(a))
}

/// Log odds that a row with a light on each line lies above the edge, if the one is too bright to be the line.
fn two_lights(view: &View, light: Light, row: usize, (above, below): Columns, dark: f32) -> Option<f32> {
    let at = |x: f32| {
        let x = (x + 0.5).max(0.0) as usize;
        let three = view.span(row, x.saturating_sub(1), x + 2);
        three.iter().fold(0, |sum, &pixel| sum + u32::from(pixel)) as f32 / 3.0 - dark
    };
    let outward = if above > below { 1.5 } else { -1.5 };
    let on_above = at(above).max(at(above + outward));
    let on_below = at(below).max(at(below - outward));
    let (least, most) = (on_above.min(on_below), on_above.max(on_below));
    if least < LEAST * light.contrast
        || most < TOO_BRIGHT * light.contrast
        || at(0.5 * (above + below)) > VALLEY * least
    {
        return None;
    }
    Some(if on_above < on_below {
        TWO_LIGHTS_ODDS
    } else {
        -TWO_LIGHTS_ODDS
    })
}

/// Log odds that a row lies above the edge, by how far its light in columns `first..last` leans toward column `above` rather than `below`;
/// and whether there is glare.
fn lean(
    view: &View,
    light: Light,
    row: usize,
    (above, below): Columns,
    (first, last): (usize, usize),
    dark: f32,
) -> (f32, bool) {
    let middle = 0.5 * (above + below);
    let per_px = 2.0 / (above - below);
    let pixels = view.span(row, first, last);
    // The brightest place of three pixels, whatever a grain of speckle shows.
    let triples = pixels.iter().zip(pixels.iter().skip(1)).zip(pixels.iter().skip(2));
    let brightest = triples.fold(0, |most, ((a, b), c)| *a.min(b).min(c).max(&most));
    let own = dark + OWN_CEILING * (f32::from(brightest) - dark);
    let ceiling = own.max(light.background + light.contrast) as u8;
    // Beyond either line light counts fully for its side: whole numbers suffice there.
    let half = if above > below { middle - below } else { middle - above };
    let between = (middle - half + 1.0).max(0.0) as usize;
    let beyond = (middle + half) as usize + 1;
    let (left, rest) = pixels.split_at(between.saturating_sub(first).min(pixels.len()));
    let (inner, right) = rest.split_at(beyond.saturating_sub(between.max(first)).min(rest.len()));
    let (outside_left, left_saturated) = cut(left, ceiling, dark);
    let (outside_right, right_saturated) = cut(right, ceiling, dark);
    let mut saturated = left_saturated + right_saturated;
    let (mut inside_left, mut inside_right, mut sum) = (0.0_f32, 0.0_f32, 0.0_f32);
    let mut at = (first + left.len()) as f32 - middle;
    for &pixel in inner {
        let light = f32::from(pixel.min(ceiling)) - dark;
        if at < 0.0 {
            inside_left += light;
        } else {
            inside_right += light;
        }
        sum += at * light;
        saturated += usize::from(pixel >= SATURATED);
        at += 1.0;
    }
    let counted = |outside: f32, inside: f32| outside.min(OUTSIDE * inside.max(0.0));
    let on_left = counted(outside_left, inside_left);
    let on_right = counted(outside_right, inside_right);
    let mass = inside_left + inside_right + on_left + on_right;
    sum = sum * per_px
        + if above > below {
            on_right - on_left
        } else {
            on_left - on_right
        };
    let odds = |sum: f32, mass: f32| {
        let lit = if mass > FAINT { mass } else { FAINT };
        (limit(LEAN_ODDS * sum / lit, -ROW_LIMIT, ROW_LIMIT), false)
    };
    if saturated <= GRAIN {
        return odds(sum, mass);
    }
    let is_saturated = |&pixel: &u8| pixel >= SATURATED;
    let from = first + pixels.iter().position(is_saturated).unwrap_or(0);
    let to = first + pixels.iter().rposition(is_saturated).unwrap_or(0) + 1;
    let aside = 0.5 * (from + to - 1) as f32 - middle;
    if to - from <= GLINT && if aside < 0.0 { -aside } else { aside } > half + ASIDE {
        let (mut mass, mut sum) = (0.0_f32, 0.0_f32);
        for (&pixel, column) in pixels.iter().zip(first..) {
            if column + RIM < from || column >= to + RIM {
                let light = f32::from(pixel.min(ceiling)) - dark;
                mass += light;
                sum += limit((column as f32 - middle) * per_px, -1.0, 1.0) * light;
            }
        }
        return odds(sum, mass);
    }
    (beside_glare(view, light, row, (above, below)), saturated > GLARE)
}

/// Log odds that a row with glare lies above the edge. Cut at the line's brightness a glare covers both places alike, but it is as broad to
/// either side of its middle: what is lopsided is the line beside it.
fn beside_glare(view: &View, light: Light, row: usize, (above, below): Columns) -> f32 {
    let middle = 0.5 * (above + below);
    let bright = (light.background + light.contrast) as u8;
    let first = (middle - GLARE_REACH).max(0.0) as usize;
    let (mut mass, mut moment, mut width) = (0_u32, 0_u32, 0_u32);
    for (&pixel, at) in view
        .span(row, first, first + 2 * GLARE_REACH as usize + 1)
        .iter()
        .zip(0..)
    {
        let over = u32::from(pixel.saturating_sub(bright));
        mass += over;
        moment += over * at;
        width += over.min(1);
    }
    let glare = first as f32 + moment as f32 / mass.max(1) as f32;
    let centre = (glare + 0.5) as usize;
    let right = view.span(row, centre + 1, centre + 1 + BESIDE);
    let left = view.span(row, centre.saturating_sub(BESIDE), centre);
    let cut = |pixel: u8| i32::from(pixel.min(bright));
    let lopsided = right
        .iter()
        .zip(left.iter().rev())
        .fold(0, |sum, (&a, &b)| sum + cut(a) - cut(b));
    let side = limit(lopsided as f32 / (FREE_WIDTH * light.contrast), -1.0, 1.0);
    // As a line so far aside would show itself.
    let expected = |x: f32| limit((x - glare) / HIDDEN, -1.0, 1.0);
    let (if_above, if_below) = (expected(above), expected(below));
    // Neither beside it nor under it, the line has dropped out.
    let hides = limit((width as f32 - NARROW) / HIDING, 0.0, 1.0);
    let shown = hides.max(if side < 0.0 { -side } else { side });
    let odds = shown * SIDE_ODDS * (if_above - if_below) * (side - 0.5 * (if_above + if_below));
    limit(odds, -ROW_LIMIT, ROW_LIMIT)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::edge::Edge;
    extern crate std;
    use std::{vec, vec::Vec};

    const SIDE: usize = 250;
    /// Columns of the line above the edge and below it, and the edge.
    const LINES: Columns = (110.0, 116.0);
    const EDGE: f32 = 129.5;

    fn image() -> Vec<u8> {
        let mut pixels = vec![20_u8; SIDE * SIDE];
        for (y, row) in pixels.chunks_exact_mut(SIDE).enumerate() {
            let x = if (y as f32) < EDGE { LINES.0 } else { LINES.1 } as usize;
            row[x - 3..=x + 3].fill(100);
        }
        pixels
    }

    fn found(pixels: &[u8]) -> Edge {
        let view = View::new(pixels, SIDE, SIDE).unwrap();
        let mut line = Line::EMPTY;
        line.light = crate::vision::edge::Light {
            background: 20.0,
            contrast: 80.0,
        };
        locate(&view, &line, 0.7, 132, |_| LINES)
    }

    #[test]
    fn the_edge_is_found_to_a_fraction_of_a_row_and_says_so() {
        let edge = found(&image());
        assert!((edge.y - EDGE).abs() < 0.3, "row {}", edge.y);
        assert!(edge.sigma < 1.0, "{} rows", edge.sigma);
    }

    #[test]
    fn a_glint_on_the_other_sheets_line_does_not_lengthen_that_sheet() {
        let mut pixels = image();
        for row in pixels.chunks_exact_mut(SIDE).skip(130).take(6) {
            row[104..=109].fill(255);
        }
        let edge = found(&pixels);
        assert!((edge.y - EDGE).abs() < 2.0, "row {}", edge.y);
    }

    #[test]
    fn rows_without_light_leave_it_open_where_among_them_the_edge_is() {
        let mut pixels = image();
        for row in pixels.chunks_exact_mut(SIDE).skip(126).take(10) {
            row.fill(20);
        }
        let edge = found(&pixels);
        assert!((edge.y - 130.5).abs() < 0.5, "row {}", edge.y);
        assert!((2.0..4.0).contains(&edge.sigma), "{} rows", edge.sigma);
    }
}
