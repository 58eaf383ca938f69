//! The edge of a lap joint, where the light goes over from one sheet's line to the other's.
//!
//! A [`RowNet`] looks at the light of each row between and beside the two lines, and at what it made of the rows about it, and says how much likelier
//! the row lies above the edge than below it. What glints, drop-outs, ghosts and speckle do to a row, and for how many rows running, it has learnt from
//! rendered images in which the edge is known (`sim_host::training::rows`): not row by row, but so that the sum over all rows, the edge's
//! likelihood, is right.

mod weights;

use super::edge::{Edge, Light, REACH, ROWS, SATURATED, Sides};
use super::image::View;
use super::number::limit;

pub use weights::LAP;

/// Pixels of a row to either side of the middle between the lines that the net sees: half a step, a line's half width, and a glint beside it.
const ASIDE: usize = 10;
/// All of them.
pub const PIXELS: usize = 2 * ASIDE + 1;
/// Pairs of neighbours, in which light brighter than the line is told.
pub const PAIRS: usize = ASIDE;
/// Half the width beside which a row's dark is taken, px.
const DARK_BESIDE: usize = 7;
/// Light over the line's own, in its brightness, beyond which it is all the same.
const GLARE: f32 = 2.0;
/// What such a pixel counts, and as much more one that is saturated; two of them are 1.
const HALF_GLARE: f32 = 63.5;
const PER_GLARE: f32 = 1.0 / (4.0 * HALF_GLARE);
/// Half the distance of the lines that is usual, px.
const HALF_STEP: f32 = 3.0;

/// Neurons that see one row.
pub const SEEING: usize = 8;
/// Rows whose seeing neurons are joined, from the row itself.
pub const TAPS: [isize; 5] = [-6, -2, 0, 2, 6];
/// Neurons that join them.
pub const JOINING: usize = 4;

/// Weights. Each neuron passes on its sum where that is positive.
#[derive(Clone, Debug, PartialEq)]
pub struct RowNet {
    /// Thresholds of the neurons that see.
    pub seen: [f32; SEEING],
    /// Their weights, by what a [`Row`] shows.
    pub light: [[f32; SEEING]; PIXELS],
    /// See [`Self::light`].
    pub glare: [[f32; SEEING]; PAIRS],
    /// See [`Self::light`].
    pub place: [[f32; SEEING]; 2],
    /// Thresholds of the neurons that join.
    pub joined: [f32; JOINING],
    /// Their weights, by tap and by neuron that sees.
    pub taps: [[[f32; JOINING]; SEEING]; TAPS.len()],
    /// Log odds by threshold, by neuron that joins, and by neuron that sees the row itself.
    pub bias: f32,
    /// See [`Self::bias`].
    pub output: [f32; JOINING],
    /// See [`Self::bias`].
    pub direct: [f32; SEEING],
}

/// What a row shows. The line above the edge is on the left: rows are mirrored where it is not.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Light over the dark beside it and up to the line's brightness, grey levels.
    light: [u8; PIXELS],
    /// Light over that.
    glare: [u8; PAIRS],
    /// One over the line's brightness.
    per_level: f32,
    /// Where the middle between the lines lies in its pixel, and half their distance less the usual one, px.
    place: [f32; 2],
}

impl Row {
    /// Nothing in sight.
    const NOTHING: Self = Self {
        light: [0; PIXELS],
        glare: [0; PAIRS],
        per_level: 1.0,
        place: [0.0; 2],
    };

    /// Row `row`, in which the line above the edge and the one below have these columns.
    fn of(view: &View, line: Light, row: usize, (above, below): (f32, f32)) -> Self {
        let middle = 0.5 * (above + below);
        let centre = (middle + 0.5).max(0.0) as usize;
        let beside = centre.saturating_sub(DARK_BESIDE);
        let dark = Sides::of(view, row, beside, beside + 2 * DARK_BESIDE + 1).darker() as u8;
        let brightness = line.contrast.max(1.0);
        let bright = brightness as u8;
        let mut shows = Self {
            per_level: 1.0 / brightness,
            ..Self::NOTHING
        };
        let pixels = view.span(row, centre.wrapping_sub(ASIDE), centre + ASIDE + 1);
        let mut brightest = 0;
        for (light, &pixel) in shows.light.iter_mut().zip(pixels) {
            let level = pixel.saturating_sub(dark);
            *light = level.min(bright);
            brightest = brightest.max(level);
        }
        let mirrored = above > below;
        if mirrored {
            shows.light.reverse();
        }
        if brightest > bright {
            shows.add_glare(pixels, dark.saturating_add(bright), mirrored);
        }
        let (side, half) = (middle - centre as f32, 0.5 * (below - above));
        shows.place = if mirrored {
            [-side, -half - HALF_STEP]
        } else {
            [side, half - HALF_STEP]
        };
        shows
    }

    #[inline(never)] // few rows have any
    fn add_glare(&mut self, pixels: &[u8], line: u8, mirrored: bool) {
        for (at, &pixel) in pixels.iter().enumerate() {
            if pixel > line {
                let over = limit(f32::from(pixel - line) * self.per_level, 0.0, GLARE) * (HALF_GLARE / GLARE);
                let saturated = if pixel >= SATURATED { HALF_GLARE } else { 0.0 };
                let at = if mirrored { PIXELS - 1 - at } else { at };
                if let Some(glare) = self.glare.get_mut(at / 2) {
                    *glare += (over + saturated) as u8;
                }
            }
        }
    }

    /// All that the net takes, each about 0 to 1.
    pub fn inputs(&self) -> impl Iterator<Item = f32> {
        let light = self.light.iter().map(|&level| f32::from(level) * self.per_level);
        let glare = self.glare.iter().map(|&glare| f32::from(glare) * PER_GLARE);
        light.chain(glare).chain(self.place)
    }
}

/// What the neurons say of all rows that are asked.
#[derive(Clone, Debug)]
pub struct Activity {
    /// Those that see, by row.
    pub seen: [[f32; SEEING]; ROWS],
    /// Those that join.
    pub joined: [[f32; JOINING]; ROWS],
    /// Log odds that the row lies above the edge.
    pub says: [f32; ROWS],
}

impl RowNet {
    /// What the net says of rows that show this.
    pub fn run(&self, rows: impl Iterator<Item = Row>) -> Activity {
        let mut activity = Activity {
            seen: [[0.0; SEEING]; ROWS],
            joined: [[0.0; JOINING]; ROWS],
            says: [0.0; ROWS],
        };
        for (seen, row) in activity.seen.iter_mut().zip(rows) {
            *seen = self.see(&row);
        }
        let rows = activity.joined.iter_mut().zip(&mut activity.says).zip(&activity.seen);
        for (row, ((joined, says), own)) in rows.enumerate() {
            *joined = self.join(&activity.seen, row);
            *says = self.bias + product(&self.output, joined) + product(&self.direct, own);
        }
        activity
    }

    fn see(&self, row: &Row) -> [f32; SEEING] {
        let by_level = levels(&row.light, &self.light);
        let mut sums = self.seen;
        add(&mut sums, row.per_level, &by_level);
        if row.glare != [0; PAIRS] {
            add(&mut sums, PER_GLARE, &levels(&row.glare, &self.glare));
        }
        for (place, weights) in row.place.into_iter().zip(&self.place) {
            add(&mut sums, place, weights);
        }
        sums.map(|sum| sum.max(0.0))
    }

    fn join(&self, seen: &[[f32; SEEING]; ROWS], row: usize) -> [f32; JOINING] {
        let mut sums = self.joined;
        for (weights, tap) in self.taps.iter().zip(TAPS) {
            // Rows that were not asked say nothing.
            let Some(seen) = seen.get(row.wrapping_add_signed(tap)) else {
                continue;
            };
            for (&seen, weights) in seen.iter().zip(weights) {
                add(&mut sums, seen, weights);
            }
        }
        sums.map(|sum| sum.max(0.0))
    }
}

/// Sums of the weights, each as often as its level says.
fn levels(levels: &[u8], weights: &[[f32; SEEING]]) -> [f32; SEEING] {
    let mut sums = [0.0; SEEING];
    for (&level, weights) in levels.iter().zip(weights) {
        if level > 0 {
            add(&mut sums, f32::from(level), weights);
        }
    }
    sums
}

/// Adds `by` times `weights` to `sums`.
fn add<const N: usize>(sums: &mut [f32; N], by: f32, weights: &[f32; N]) {
    for (sum, weight) in sums.iter_mut().zip(weights) {
        *sum += by * weight;
    }
}

fn product<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// What the rows about an edge show the net, to learn from.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The first row.
    pub first: usize,
    /// All of them.
    pub rows: [Row; ROWS],
}

impl Asked {
    /// About row `expected`; `lines` gives the columns of the line above the edge and of the one below in a row.
    pub(super) fn about(view: &View, line: Light, expected: usize, lines: impl Fn(f32) -> (f32, f32)) -> Self {
        let mut asked = Self {
            first: first_of(expected),
            rows: [Row::NOTHING; ROWS],
        };
        for (own, row) in asked.rows.iter_mut().zip(rows(view, line, expected, lines)) {
            *own = row;
        }
        asked
    }
}

fn first_of(expected: usize) -> usize {
    expected.saturating_sub(REACH)
}

fn rows(view: &View, line: Light, expected: usize, lines: impl Fn(f32) -> (f32, f32)) -> impl Iterator<Item = Row> {
    let first = first_of(expected);
    (first..first + ROWS).map(move |row| Row::of(view, line, row, lines(row as f32)))
}

/// Locates the edge within [`REACH`] rows of row `expected`; `lines` as in [`Asked::about`].
pub(super) fn locate(view: &View, line: Light, expected: usize, lines: impl Fn(f32) -> (f32, f32)) -> Edge {
    let Activity { says, .. } = LAP.run(rows(view, line, expected, lines));
    Edge::likeliest(&likelihood(&says), (first_of(expected) + REACH) as f32 - 0.5, 1.0)
}

/// Logarithm of the likelihood of the edge after none, one, … of the rows, but for a constant: with the edge above the first row all rows lie below it, and
/// each row that it passes changes sides.
pub fn likelihood(says: &[f32; ROWS]) -> [f32; ROWS + 1] {
    let mut likelihood = [0.0_f32; ROWS + 1];
    let mut sum = 0.0;
    for (value, say) in likelihood.iter_mut().skip(1).zip(says) {
        sum += say;
        *value = sum;
    }
    likelihood
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::{vec, vec::Vec};

    const SIDE: usize = 250;
    /// Columns of the line above the edge and below it, and the edge.
    const LINES: (f32, f32) = (110.0, 116.0);
    const EDGE: f32 = 129.5;
    const LIGHT: Light = Light {
        background: 20.0,
        contrast: 80.0,
    };

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
        locate(&view, LIGHT, 132, |_| LINES)
    }

    #[test]
    fn the_edge_is_found_to_a_fraction_of_a_row_and_says_so() {
        let edge = found(&image());
        assert!((edge.y - EDGE).abs() < 0.3, "row {}", edge.y);
        assert!(edge.sigma < 1.0, "{} rows", edge.sigma);
    }

    #[test]
    fn an_image_and_its_mirror_image_have_their_edge_in_the_same_row() {
        let pixels = image();
        let mirrored: Vec<u8> = pixels
            .chunks_exact(SIDE)
            .flat_map(|row| row.iter().rev().copied())
            .collect();
        let view = View::new(&mirrored, SIDE, SIDE).unwrap();
        let columns = LINES;
        let last = (SIDE - 1) as f32;
        let edge = locate(&view, LIGHT, 132, |_| (last - columns.0, last - columns.1));
        assert!((edge.y - found(&pixels).y).abs() < 1e-3, "row {}", edge.y);
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
        // As likely in each of the ten it would be 130.5 ± 2.9; the net leans to the lower end, within what it says.
        assert!((2.5..4.0).contains(&edge.sigma), "{} rows", edge.sigma);
        assert!((edge.y - 130.5).abs() < edge.sigma, "row {} ± {}", edge.y, edge.sigma);
        assert!(edge.far > 1e-6, "{}", edge.far);
    }
}
