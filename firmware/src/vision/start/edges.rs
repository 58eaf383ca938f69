//! Edge pixels of the two directions that matter, thinned.
//!
//! Two 5 × 5 filters, a derivative across and a binomial along: one answers to the seam's edge, which runs along the image, one to the
//! part's end, which runs down it. Both are signed: the sheet whose edge it is lies on a known side, and is brighter than the crevice or the
//! void beside it. The bottom of a bend is no edge but a thin line, bright where its radius mirrors the light and dark where it does not: there
//! the second derivative answers. A pixel is kept where
//! its answer is the largest of the three across the edge (non-maximum suppression), and its place to a fraction of a pixel is the vertex of
//! the parabola through them. Integers throughout.

use super::line::Line;
use super::{Aim, SIDE};
use crate::vision::image::View;
use crate::vision::joint::Joint;

/// Edge pixels kept of each direction. An edge across the whole view has 450; scratches, streaks and noise make up the rest.
pub const POINTS: usize = 4096;
/// Rows that the filters reach over.
const ROWS: usize = 5;
/// Least answer, in sums of the filter (48 per grey level of a step that fills it): a step of 3 grey levels.
const FLOOR: i32 = 100;
/// Bins of the histogram of answers, and their width.
const BINS: usize = 256;
const BIN: i32 = 48;
/// Answers are in a 64th of a pixel.
pub const FRACTION: i32 = 64;

/// How a seam shows in grey.
#[derive(Clone, Copy, Debug)]
pub enum SeamMark {
    /// As a change of brightness, of this sign, down the image.
    Edge(i32),
    /// As a line, bright (1) or dark (−1).
    Line(i32),
}

/// What the seam's start looks like in grey.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// How the seam shows.
    pub seam: SeamMark,
    /// Side of the seam on which the part's end shows: −1 above in the image, +1 below, 0 both, for a bend.
    pub end_side: i32,
}

impl Pattern {
    /// The patterns that `joint` may show: the sheet with the edge is bright, left of travel is up in the image, and the part lies ahead (+x).
    pub fn of(joint: Joint) -> heapless::Vec<Self, 2> {
        let sheet = |left: bool| {
            let side = if left { -1 } else { 1 };
            Self {
                seam: SeamMark::Edge(side),
                end_side: side,
            }
        };
        let bend = |sign: i32| Self {
            seam: SeamMark::Line(sign),
            end_side: 0,
        };
        match joint {
            Joint::Crank { upper_left, .. } => heapless::Vec::from_iter([sheet(upper_left)]),
            Joint::Lip { sheet_left, .. } => heapless::Vec::from_iter([sheet(sheet_left)]),
            Joint::Vee { .. } => heapless::Vec::from_iter([bend(-1), bend(1)]),
        }
    }
}

/// A pixel of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Point {
    /// Pixel along the edge's direction: x of the seam's, y of the end's.
    pub along: u16,
    /// Place across, in 1/[`FRACTION`] px: y of the seam's, x of the end's.
    pub across: u16,
    /// Answer of the filter.
    pub strength: u16,
}

impl Point {
    /// How far across it lies from `line`, px.
    pub fn off(&self, line: &Line) -> f32 {
        f32::from(self.across) * (1.0 / FRACTION as f32) - line.at(f32::from(self.along))
    }
}

/// The edge pixels of one direction.
pub type Points = heapless::Vec<Point, POINTS>;

/// The edge pixels of an image.
#[derive(Clone, Debug)]
pub struct Edges {
    /// Along the image: the seam's.
    pub seam: Points,
    /// Down the image: the part's end's.
    pub end: Points,
    rows: Rows,
}

/// What the filters keep of the rows that they reach over: 23 KB, too much for a stack.
#[derive(Clone, Debug)]
struct Rows {
    filtered: [Filtered; ROWS],
    /// Answers of the last three rows; the filters' middle row is that of the second.
    seam: [[i32; SIDE]; 3],
    ends: [i32; SIDE],
}

impl Rows {
    /// Before the first row.
    const EMPTY: Self = Self {
        filtered: [Filtered::EMPTY; ROWS],
        seam: [[0; SIDE]; 3],
        ends: [0; SIDE],
    };
}

impl Edges {
    /// None.
    pub const fn new() -> Self {
        Self {
            seam: heapless::Vec::new(),
            end: heapless::Vec::new(),
            rows: Rows::EMPTY,
        }
    }

    /// Finds the edge pixels of `view`: all that stand out, or the [`POINTS`] strongest of each direction; of the seam's, those where `aim` allows it.
    pub fn find(&mut self, view: &View, pattern: &Pattern, aim: &Aim) {
        let Self { seam, end, rows } = self;
        seam.clear();
        end.clear();
        let reach = aim.off + aim.slope * aim.middle;
        let wanted = |direction: usize, y: usize| direction == 1 || (y as f32 - aim.middle).abs() <= reach;
        let mut histograms = [[0_u32; BINS]; 2];
        scan(view, pattern, rows, |direction, _, y, [_, answer, _]| {
            if !wanted(direction, y) {
                return;
            }
            let histogram = histograms
                .get_mut(direction)
                .map(|histogram| histogram.get_mut((answer / BIN) as usize));
            if let Some(Some(count)) = histogram {
                *count += 1;
            }
        });
        let least = histograms.map(|histogram| level(&histogram));
        scan(view, pattern, rows, |direction, x, y, [before, answer, after]| {
            if answer < least.get(direction).copied().unwrap_or(i32::MAX) || !wanted(direction, y) {
                return;
            }
            let (points, along, across) = if direction == 0 {
                (&mut *seam, x, y)
            } else {
                (&mut *end, y, x)
            };
            // The vertex of the parabola lies within half a pixel, because the middle is largest.
            let bend = (2 * answer - before - after).max(1);
            let fine = FRACTION * (after - before) / (2 * bend);
            let point = Point {
                along: along as u16,
                across: (across as i32 * FRACTION + fine).max(0) as u16,
                strength: answer.min(i32::from(u16::MAX)) as u16,
            };
            // Full only if many share one bin of the histogram; the rest of them is no better.
            let _ = points.push(point);
        });
    }
}

impl Default for Edges {
    fn default() -> Self {
        Self::new()
    }
}

/// Answer above which at most [`POINTS`] lie, and never less than [`FLOOR`].
fn level(histogram: &[u32; BINS]) -> i32 {
    let mut above = 0;
    for (bin, count) in histogram.iter().enumerate().rev() {
        above += count;
        if above > POINTS as u32 {
            return (BIN * (bin as i32 + 1)).max(FLOOR);
        }
    }
    FLOOR
}

/// A row filtered along x: smoothed, and its derivative.
#[derive(Clone, Copy, Debug)]
struct Filtered {
    smooth: [i16; SIDE],
    slope: [i16; SIDE],
}

impl Filtered {
    const EMPTY: Self = Self {
        smooth: [0; SIDE],
        slope: [0; SIDE],
    };
}

/// Filters the image and calls `each`(direction, x, y, answers before, at and after it across the edge) at every local maximum.
fn scan(view: &View, pattern: &Pattern, rows: &mut Rows, mut each: impl FnMut(usize, usize, usize, [i32; 3])) {
    let (width, height) = (view.width().min(SIDE), view.height().min(SIDE));
    let Rows { filtered, seam, ends } = rows;
    filtered.fill(Filtered::EMPTY);
    seam.fill([0; SIDE]);
    ends.fill(0);
    for y in 0..height {
        filtered.rotate_left(1);
        if let Some(newest) = filtered.last_mut() {
            filter_row(view.row(y), newest);
        }
        if y + 1 < ROWS {
            continue;
        }
        // The middle of the five rows is image row y − 2.
        seam.rotate_left(1);
        let [.., newest] = &mut *seam;
        answer(filtered, pattern, newest, ends);
        let middle = y - ROWS / 2;
        for (x, window) in ends.get(..width).unwrap_or(&[]).windows(3).enumerate() {
            if let &[before, at, after] = window
                && at >= FLOOR
                && at >= before
                && at > after
            {
                each(1, x + 1, middle, [before, at, after]);
            }
        }
        // Rows middle − 2, middle − 1, middle; before the third row there is no middle one.
        if y > ROWS {
            let [above, here, below] = &*seam;
            for (x, ((&above, &here), &below)) in above.iter().zip(here).zip(below).enumerate().take(width) {
                if here >= FLOOR && here >= above && here > below {
                    each(0, x, middle - 1, [above, here, below]);
                }
            }
        }
    }
}

/// Binomial 1 4 6 4 1 and derivative −1 −2 0 2 1 along a row; the outer two pixels stay zero.
fn filter_row(pixels: &[u8], row: &mut Filtered) {
    let taps = pixels.windows(5);
    let out = row.smooth.iter_mut().zip(&mut row.slope).skip(2);
    for (five, (smooth, slope)) in taps.zip(out) {
        if let &[a, b, c, d, e] = five {
            let [a, b, c, d, e] = [a, b, c, d, e].map(i16::from);
            *smooth = a + 4 * b + 6 * c + 4 * d + e;
            *slope = e + 2 * d - 2 * b - a;
        }
    }
}

/// Answers of the middle row to seam and end.
fn answer(rows: &[Filtered; ROWS], pattern: &Pattern, seam: &mut [i32; SIDE], ends: &mut [i32; SIDE]) {
    let [r0, r1, r2, r3, r4] = rows;
    let smooth = r0
        .smooth
        .iter()
        .zip(&r1.smooth)
        .zip(&r2.smooth)
        .zip(r3.smooth.iter().zip(&r4.smooth));
    let slopes = r0
        .slope
        .iter()
        .zip(&r1.slope)
        .zip(&r2.slope)
        .zip(r3.slope.iter().zip(&r4.slope));
    let out = seam.iter_mut().zip(ends.iter_mut());
    for ((smooth, slopes), (seam, end)) in smooth.zip(slopes).zip(out) {
        let (((a, b), c), (d, e)) = slopes;
        let right = [a, b, c, d, e].map(|v| i32::from(*v));
        let right = right[0] + 4 * right[1] + 6 * right[2] + 4 * right[3] + right[4];
        let (((a, b), c), (d, e)) = smooth;
        let [a, b, c, d, e] = [a, b, c, d, e].map(|v| i32::from(*v));
        let down = e + 2 * d - 2 * b - a;
        // Steeper than 1 : 1 against its own direction it is the other's, or a scratch; noise turns weak edges by that much.
        *end = if right > down.abs() { right } else { 0 };
        let signed = match pattern.seam {
            SeamMark::Edge(sign) => sign * down,
            SeamMark::Line(sign) => sign * (2 * c - a - e),
        };
        *seam = if signed > right.abs() { signed } else { 0 };
    }
}
