//! Edge pixels of the two directions that matter, thinned.
//!
//! Two 5 × 5 filters, a derivative across and a binomial along: one answers to the seam's edge, which runs along the image, one to the
//! part's end, which runs down it. Both are signed: the sheet whose edge it is lies on a known side, and is brighter than the crevice or the
//! void beside it. The bottom of a bend is no edge but a thin line, bright where its radius mirrors the light and dark where it does not: there
//! the second derivative answers, and both signs are kept apart. A pixel is kept where
//! its answer is the largest of the three across the edge (non-maximum suppression), and its place to a fraction of a pixel is the vertex of
//! the parabola through them. Integers throughout.

use super::line::Line;
use super::{Aim, SIDE};
use crate::vision::image::View;
use crate::vision::joint::Joint;

/// Edge pixels kept of each direction. An edge across the whole view has 450; scratches, streaks and noise make up the rest.
pub const POINTS: usize = 4096;
/// Rows that the filters reach over, and how far from the middle one.
const ROWS: usize = 5;
const REACH: usize = ROWS / 2;
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
    /// As a line, bright or dark.
    Line,
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
    /// The pattern of `joint`: the sheet with the edge is bright, left of travel is up in the image, and the part lies ahead (+x).
    pub fn of(joint: Joint) -> Self {
        let sheet = |left: bool| {
            let side = if left { -1 } else { 1 };
            Self {
                seam: SeamMark::Edge(side),
                end_side: side,
            }
        };
        match joint {
            Joint::Crank { upper_left, .. } => sheet(upper_left),
            Joint::Lip { sheet_left, .. } => sheet(sheet_left),
            Joint::Vee { .. } => Self {
                seam: SeamMark::Line,
                end_side: 0,
            },
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
    /// Along the image: the seam's; of a line those that are bright, and those that are dark.
    pub seam: [Points; 2],
    /// Down the image: the part's end's.
    pub end: Points,
    rows: Rows,
}

/// What the filters keep of an image: 10 KB, too much for a stack.
#[derive(Clone, Debug)]
struct Rows {
    columns: Columns,
    /// Answers of the last three rows; the filters' middle row is that of the second.
    seam: [[i32; SIDE]; 3],
    ends: [i32; SIDE],
}

impl Rows {
    /// Before the first row.
    const EMPTY: Self = Self {
        columns: Columns::EMPTY,
        seam: [[0; SIDE]; 3],
        ends: [0; SIDE],
    };
}

impl Edges {
    /// None.
    pub const fn new() -> Self {
        Self {
            seam: [const { heapless::Vec::new() }; 2],
            end: heapless::Vec::new(),
            rows: Rows::EMPTY,
        }
    }

    /// Finds the edge pixels of `view`: all that stand out, or the [`POINTS`] strongest of each kind; of the seam's, those where `aim` allows it.
    pub fn find(&mut self, view: &View, pattern: &Pattern, aim: &Aim) {
        let (mut seam, mut end) = (self.seam.each_mut().map(Strongest::of), Strongest::of(&mut self.end));
        match pattern.seam {
            SeamMark::Edge(_) => scan::<false>(view, pattern, aim, &mut self.rows, &mut seam, &mut end),
            SeamMark::Line => scan::<true>(view, pattern, aim, &mut self.rows, &mut seam, &mut end),
        }
        seam.iter_mut().for_each(Strongest::raise);
        end.raise();
    }
}

impl Default for Edges {
    fn default() -> Self {
        Self::new()
    }
}

/// The strongest pixels of those that have come: whenever there is no room for one more the weakest go, down to the level that leaves room
/// by all that came. That level only rises, so in the end those are there that are above its last, in the order in which they came.
struct Strongest<'a> {
    points: &'a mut Points,
    /// Of the answers of all that came.
    histogram: [u32; BINS],
    least: i32,
}

impl<'a> Strongest<'a> {
    /// None yet, in this memory.
    fn of(points: &'a mut Points) -> Self {
        points.clear();
        Self {
            points,
            histogram: [0; BINS],
            least: FLOOR,
        }
    }

    /// Takes the pixel at `along` and `across`, with the answers before, at and after it across the edge.
    fn take(&mut self, along: usize, across: usize, [before, answer, after]: [i32; 3]) {
        if let Some(count) = self.histogram.get_mut((answer / BIN) as usize) {
            *count += 1;
        }
        if answer < self.least {
            return;
        }
        // The vertex of the parabola lies within half a pixel, because the middle is largest.
        let bend = (2 * answer - before - after).max(1);
        let fine = FRACTION * (after - before) / (2 * bend);
        let point = Point {
            along: along as u16,
            across: (across as i32 * FRACTION + fine).max(0) as u16,
            strength: answer.min(i32::from(u16::MAX)) as u16,
        };
        if self.points.push(point).is_err() {
            self.raise();
            if answer >= self.least {
                let _ = self.points.push(point); // more came than there is room for, so the level has risen past one of them
            }
        }
    }

    /// Lets go what lies below the level.
    fn raise(&mut self) {
        let least = level(&self.histogram);
        self.points.retain(|point| i32::from(point.strength) >= least);
        self.least = least;
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

/// Five rows filtered down the image, by column.
#[derive(Clone, Debug)]
struct Columns {
    /// Binomial 1 4 6 4 1.
    smooth: [i16; SIDE],
    /// Derivative −1 −2 0 2 1.
    slope: [i16; SIDE],
    /// What the seam's mark is: that derivative or the second, −1 0 2 0 −1, with an edge's sign.
    mark: [i16; SIDE],
}

impl Columns {
    const EMPTY: Self = Self {
        smooth: [0; SIDE],
        slope: [0; SIDE],
        mark: [0; SIDE],
    };

    fn filter(&mut self, [r0, r1, r2, r3, r4]: [&[u8]; ROWS], seam: SeamMark) {
        let pixels = r0.iter().zip(r1).zip(r2).zip(r3).zip(r4);
        let out = self.smooth.iter_mut().zip(&mut self.slope).zip(&mut self.mark);
        for (((((a, b), c), d), e), ((smooth, slope), mark)) in pixels.zip(out) {
            let five = [a, b, c, d, e].map(|v| i32::from(*v));
            let (down, [a, _, c, _, e]) = (derivative(five), five);
            *smooth = binomial(five) as i16;
            *slope = down as i16;
            *mark = match seam {
                SeamMark::Edge(sign) => sign * down,
                SeamMark::Line => 2 * c - a - e,
            } as i16;
        }
    }
}

fn five(window: &[i16]) -> [i32; ROWS] {
    match window {
        &[a, b, c, d, e] => [a, b, c, d, e].map(i32::from),
        _ => [0; ROWS], // windows are of five
    }
}

fn binomial([a, b, c, d, e]: [i32; ROWS]) -> i32 {
    a + 4 * b + 6 * c + 4 * d + e
}

fn derivative([a, b, _, d, e]: [i32; ROWS]) -> i32 {
    e + 2 * d - 2 * b - a
}

/// Filters the image and hands on every local maximum, of the seam's answers those where `aim` allows it; and, with `BOTH` signs, every minimum.
fn scan<const BOTH: bool>(
    view: &View,
    pattern: &Pattern,
    aim: &Aim,
    rows: &mut Rows,
    [along, opposite]: &mut [Strongest; 2],
    down: &mut Strongest,
) {
    let reach = aim.off + aim.slope * aim.middle;
    let (width, height) = (view.width().min(SIDE), view.height().min(SIDE));
    let Rows { columns, seam, ends } = rows;
    seam.fill([0; SIDE]);
    ends.fill(0);
    let mut seam = seam.each_mut();
    for middle in REACH..height.saturating_sub(REACH) {
        columns.filter(core::array::from_fn(|row| view.row(middle + row - REACH)), pattern.seam);
        seam.rotate_left(1);
        let [above, here, below] = &mut seam;
        answer::<BOTH>(columns, width, below, ends);
        for (x, window) in ends.get(..width).unwrap_or(&[]).windows(3).enumerate() {
            if let &[before, at, after] = window
                && at >= FLOOR
                && at >= before
                && at > after
            {
                down.take(middle, x + 1, [before, at, after]);
            }
        }
        // Rows middle − 2, middle − 1, middle; before the third row there is no middle one.
        if middle > REACH + 1 && ((middle - 1) as f32 - aim.middle).abs() <= reach {
            for (x, ((&above, &here), &below)) in above.iter().zip(&**here).zip(&**below).enumerate().take(width) {
                if here >= FLOOR && here >= above && here > below {
                    along.take(x, middle - 1, [above.max(0), here, below.max(0)]);
                }
                if BOTH && here <= -FLOOR && here <= above && here < below {
                    opposite.take(x, middle - 1, [-above.min(0), -here, -below.min(0)]);
                }
            }
        }
    }
}

/// Answers of the middle row to seam and end; the outer two pixels stay zero.
fn answer<const BOTH: bool>(columns: &Columns, width: usize, seam: &mut [i32; SIDE], ends: &mut [i32; SIDE]) {
    let out = seam.iter_mut().zip(ends).skip(REACH);
    let [smooth, slope, mark] =
        [&columns.smooth, &columns.slope, &columns.mark].map(|filtered| filtered.get(..width).unwrap_or(&[]));
    let filtered = smooth.windows(ROWS).zip(slope.windows(ROWS)).zip(mark.windows(ROWS));
    for (((smooth, slope), mark), (seam, end)) in filtered.zip(out) {
        let (right, down) = (derivative(five(smooth)), binomial(five(slope)));
        // Steeper than 1 : 1 against its own direction it is the other's, or a scratch; noise turns weak edges by that much.
        *end = if right > down.abs() { right } else { 0 };
        let mark = binomial(five(mark));
        let strength = if BOTH { mark.abs() } else { mark };
        *seam = if strength > right.abs() { mark } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    /// What the module's first paragraph says, a pixel at a time: 5 × 5 sums, all maxima, and then the strongest of them.
    fn plainly(view: &View, pattern: &Pattern) -> [Vec<Point>; 3] {
        const BINOMIAL: [i32; ROWS] = [1, 4, 6, 4, 1];
        const DERIVATIVE: [i32; ROWS] = [-1, -2, 0, 2, 1];
        const SECOND: [i32; ROWS] = [-1, 0, 2, 0, -1];
        let (width, height) = (view.width(), view.height());
        let sum = |x: usize, y: usize, along: [i32; ROWS], down: [i32; ROWS]| -> i32 {
            let row = |j: usize| (0..ROWS).map(move |i| along[i] * i32::from(view.row(y + j - REACH)[x + i - REACH]));
            (0..ROWS).map(|j| down[j] * row(j).sum::<i32>()).sum()
        };
        let inside = |at: usize, size: usize| (REACH..size - REACH).contains(&at);
        let answer = |x: usize, y: usize| -> [i32; 3] {
            if !inside(x, width) || !inside(y, height) {
                return [0; 3];
            }
            let right = sum(x, y, DERIVATIVE, BINOMIAL);
            let down = sum(x, y, BINOMIAL, DERIVATIVE);
            let [mark, opposite] = match pattern.seam {
                SeamMark::Edge(sign) => [sign * down, 0],
                SeamMark::Line => [1, -1].map(|sign| sign * sum(x, y, BINOMIAL, SECOND)),
            };
            [(mark, right), (opposite, right), (right, down)]
                .map(|(this, other)| if this > other.abs() { this } else { 0 })
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let answers: Vec<[i32; 3]> = places.map(|(x, y)| answer(x, y)).collect();
        let of = |kind: usize, x: usize, y: usize| answers[y * width + x][kind];
        let (mut found, mut counts) = ([Vec::new(), Vec::new(), Vec::new()], [[0_u32; BINS]; 3]);
        let mut keep = |kind: usize, along: usize, across: usize, [before, at, after]: [i32; 3]| {
            if at >= FLOOR && at >= before && at > after {
                counts[kind][(at / BIN) as usize] += 1;
                let fine = FRACTION * (after - before) / (2 * (2 * at - before - after));
                found[kind].push(Point {
                    along: along as u16,
                    across: (across as i32 * FRACTION + fine) as u16,
                    strength: at as u16,
                });
            }
        };
        for y in REACH..height - REACH {
            for x in 1..width - 1 {
                keep(2, y, x, [-1, 0, 1].map(|off| of(2, x.wrapping_add_signed(off), y)));
            }
            if y > REACH + 1 {
                for (kind, x) in [0, 1].into_iter().flat_map(|kind| (0..width).map(move |x| (kind, x))) {
                    keep(kind, x, y - 1, [2, 1, 0].map(|up| of(kind, x, y - up)));
                }
            }
        }
        for (found, counts) in found.iter_mut().zip(&counts) {
            found.retain(|point| i32::from(point.strength) >= level(counts));
        }
        found
    }

    #[test]
    fn the_edge_pixels_are_those_of_plain_sums_also_where_only_the_strongest_fit() {
        let marks = [SeamMark::Edge(-1), SeamMark::Edge(1), SeamMark::Line];
        let mut edges = Edges::new();
        let mut state = 1_u32;
        // A step, a line and an end under more and more noise, in images of two sizes in the same memory.
        for (round, noise) in [0, 2, 8, 40, 120].into_iter().enumerate() {
            let (width, height) = if round % 2 == 0 { (SIDE, SIDE) } else { (200, 120) };
            let mut pixels = Vec::new();
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let part = if x > width / 3 + y / 9 && y < height / 2 + x / 12 {
                    60
                } else {
                    10
                };
                let line = if y == height / 4 { 50 } else { 0 };
                pixels.push((part + line + (state >> 24) * noise / 256) as u8);
            }
            let view = View::new(&pixels, width, height).unwrap();
            for seam in marks {
                let pattern = Pattern { seam, end_side: 0 };
                edges.find(&view, &pattern, &Aim::ANYWHERE);
                let [seam, opposite, end] = plainly(&view, &pattern);
                assert!(!end.is_empty() && seam.len().max(opposite.len()).max(end.len()) <= POINTS);
                assert_eq!(
                    ([&edges.seam[0][..], &edges.seam[1][..]], &edges.end[..]),
                    ([&seam[..], &opposite[..]], &end[..]),
                    "{pattern:?}, noise {noise}"
                );
            }
        }
    }
}
