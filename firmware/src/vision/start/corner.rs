//! The end-of-seam corner: the pair of lines that meet as the joint's pattern says.
//!
//! A part has several edges, and lines several intersections: a lapped sheet's lower partner ends further on, along a line parallel to the
//! upper's end. What tells the start from the others is where along each line its edge is really seen: the seam's from the corner on to the right
//! and not to the left of it; the end's from the corner on to the side of the sheet. Each line's edge pixels are gathered in
//! cells, and cells that are seen where they should be count for a pair, those where they should not against it, each by its strength: so
//! rolling marks and scratches, which are long but weak, or strong but short, do not make a corner.

use super::edges::{Edges, Pattern, Points, SeamMark};
use super::hough::{LINES, Votes};
use super::line::{Fitted, Line, fit, refit};
use super::{Aim, GreyRefusal, stripe};
use crate::geometry::trig::sqrt;
use crate::vision::image::View;
use crate::vision::number::limit;
use hal::process::Sighting;

/// Length of a cell, px.
const CELL: usize = 8;
const CELLS: usize = super::SIDE.div_ceil(CELL);
/// Edge pixels that make a cell seen.
const SEEN: u8 = 3;
/// A line's own pixels, px.
const NEAR: f32 = 2.0;
/// Fewest votes of a line: two dozen weak pixels.
const VOTES: u16 = 24;
/// Strength, answers of the edge filter, beyond which a cell counts no more: 40 grey levels, so that glints do not outweigh edges.
const CEILING: u32 = 2000;
/// Cells from the corner on that are looked at: 24 mm.
const LOOKED: usize = 25;
/// Cells from the corner on of which the share must be seen too: 10 mm, less than from the upper sheet's end to the lower's.
const NEXT: usize = 10;
/// Cells next to the corner that are left out: the two edges' filters disturb each other there.
const SKIPPED: usize = 1;
/// Fewest cells of seam and of end in view, and the share of them that must be seen.
const FEWEST: usize = 4;
const SHARE: f32 = 0.4;
/// And of the nearest: edges are lost over up to 6 mm.
const SHARE_NEXT: f32 = 0.2;
/// A cell seen where the pattern has no edge counts against a pair by so much.
const AGAINST: f32 = 1.5;
/// Of a bend every corner lies on the same end, which says little of which is right: so much of its strength counts.
const END_OF_BEND: f32 = 0.1;
/// An edge whose cells past the corner are on average this strong, against those before it, goes on and has no corner there.
const GOES_ON: f32 = 0.5;
/// Fewest cells past the corner that say so.
const FEWEST_PAST: usize = 2;
/// A second corner with this share of the first one's score makes it unclear which is right.
const RIVAL: f32 = 0.85;
/// Corners nearer than this are the same, px.
const SAME: f32 = 4.0;
/// And those of a bend, px: the ends of two flanks of 15°, 25 mm long and seen from 20 mm beside, are two lines, and a third runs across both.
const SAME_OF_BEND: f32 = 10.0;
/// The corner is at least this far inside the image, px.
const BORDER: f32 = 8.0;
/// Furthest pixels of the final fits from the corner, px: 36 mm of seam for its direction, 15 mm for the corner, where a seam bent by
/// 2 mm over 250 mm is straight to 0.02 mm; 15 mm of the end.
const REACH_DIRECTION: f32 = 300.0;
const REACH_SEAM: f32 = 125.0;
const REACH_END: f32 = 125.0;
/// Times that a bend's line is looked at.
const TRACES: u8 = 2;
/// A mark on the very line moves its middle and leaves no more than half of itself to be seen: the variance that a bend's line has in common is so much
/// larger than what is left shows.
const COMMON: f32 = 4.0;
/// Largest standard deviation of the corner, px: 0.1 mm, …
const SIGMA_LIMIT: f32 = 0.8;
/// … and a corner is sure up to half of it, …
const SURE_SIGMA: f32 = 0.5 * SIGMA_LIMIT;
/// … and up to so much of its seam's direction, rad: 0.1°.
pub const SURE_SLOPE: f32 = 1.7e-3;

/// The corner at which the seam starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Its place, px.
    pub x: f32,
    /// See [`Self::x`].
    pub y: f32,
    /// Direction of the seam: px of y (down) per px of x.
    pub slope: f32,
    /// The middle (x, y) of the pixels that show the direction, px.
    pub middle: [f32; 2],
    /// Standard deviation of the place, px, and of the direction, rad.
    pub sigma: f32,
    /// See [`Self::sigma`].
    pub sigma_slope: f32,
    /// Quality: 0 worst, 255 best.
    pub quality: u8,
    /// How strongly the seam shows: the sum of its cells' strengths.
    pub strength: f32,
}

/// A line and where along it its edge is seen.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    fitted: Fitted,
    /// Strength by cell, zero where it is not seen.
    strength: [u16; CELLS],
}

/// Cells to one side of the corner: in view and seen, all and those next to it; and the strength of those seen.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    cells: usize,
    seen: usize,
    next: usize,
    next_seen: usize,
    strength: f32,
}

impl Side {
    fn of<'a>(cells: impl Iterator<Item = &'a u16>) -> Self {
        let mut side = Self::default();
        for (index, &strength) in cells.take(LOOKED).enumerate() {
            let seen = usize::from(strength > 0);
            side.cells += 1;
            side.seen += seen;
            if index < NEXT {
                side.next += 1;
                side.next_seen += seen;
            }
            side.strength += f32::from(strength);
        }
        side
    }

    /// An edge is here.
    fn holds(&self) -> bool {
        let share = |share: f32, seen: usize, cells: usize| seen as f32 >= share * cells as f32;
        self.cells >= FEWEST && share(SHARE, self.seen, self.cells) && share(SHARE_NEXT, self.next_seen, self.next)
    }

    /// The edge on `self`, which lies past the corner, is the one of `own` gone on.
    fn goes_on(&self, own: &Self) -> bool {
        let here = self.strength * own.cells as f32;
        self.cells >= FEWEST_PAST && here > GOES_ON * own.strength * self.cells as f32
    }
}

/// Finds the corner in an image's edges, with a seam that runs as `aim` allows: of a bend's two signs the one that shows more strongly. A bend's seam
/// is then looked at anew: its middles take the place of its edges.
pub fn find(
    view: &View,
    edges: &mut Edges,
    votes: &mut Votes,
    pattern: &Pattern,
    aim: &Aim,
) -> Result<Corner, GreyRefusal> {
    let ends = candidates(&edges.end, votes, 0.5 * (view.height() as f32 - 1.0), &Aim::ANYWHERE);
    let bend = matches!(pattern.seam, SeamMark::Line);
    let mut shown = |points: &Points| {
        let seams = candidates(points, votes, 0.5 * (view.width() as f32 - 1.0), aim);
        pair(view, &seams, &ends, pattern, aim)
    };
    let [bright, dark] = &mut edges.seam;
    let first = (shown(bright), bright, 1);
    if !bend {
        let (pair, points, _) = first;
        return refine([points, &edges.end], pattern, &pair?);
    }
    let second = (shown(dark), dark, -1);
    let strength = |pair: &Result<Pair, _>| pair.as_ref().map_or(0.0, |pair| pair.strength);
    let in_order = if strength(&second.0) > strength(&first.0) {
        [second, first]
    } else {
        [first, second]
    };
    let mut refused = GreyRefusal::NoSeam;
    for (pair, points, sign) in in_order {
        let found = pair.and_then(|mut pair| {
            let centred = centre(view, points, &mut pair.seam, &pair.end, sign);
            pair.common = centred.ok_or(GreyRefusal::NoCorner)?;
            refine([points, &edges.end], pattern, &pair)
        });
        match found {
            Ok(corner) => return Ok(corner),
            // Of two refusals the second tells no more than the first.
            Err(refusal) => refused = refusal,
        }
    }
    Err(refused)
}

/// The two lines of a corner, and how strongly its seam shows.
struct Pair {
    seam: Line,
    end: Line,
    strength: f32,
    /// Variance of a third of the seam's line that its pixels have in common, px².
    common: f32,
}

/// The pair of a seam and an end that meet as the pattern says.
fn pair(
    view: &View,
    seams: &[Candidate],
    ends: &[Candidate],
    pattern: &Pattern,
    aim: &Aim,
) -> Result<Pair, GreyRefusal> {
    if seams.is_empty() {
        return Err(GreyRefusal::NoSeam);
    }
    if ends.is_empty() {
        return Err(GreyRefusal::NoEnd);
    }
    let (width, height) = (view.width(), view.height());
    let mut scores = [(0.0_f32, 0.0_f32, 0.0_f32); LINES * LINES];
    let mut best: Option<(f32, f32, &Candidate, &Candidate)> = None;
    let mut at_border = false;
    let pairs = seams.iter().flat_map(|seam| ends.iter().map(move |end| (seam, end)));
    for ((seam, end), record) in pairs.zip(&mut scores) {
        let (x, y) = meet(&seam.fitted.line, &end.fitted.line);
        let inside = |at: f32, size: usize| at > BORDER && at < size as f32 - 1.0 - BORDER;
        if !inside(x, width) || !inside(y, height) {
            continue;
        }
        let (before, after) = sides(&seam.strength, x, width);
        let (above, below) = sides(&end.strength, y, height);
        let (own, past) = match pattern.end_side {
            0 if above.strength > below.strength => (above, Side::default()),
            0 => (below, Side::default()),
            ..0 => (above, below),
            1.. => (below, above),
        };
        if after.cells < FEWEST || own.cells < FEWEST {
            at_border = true;
            continue;
        }
        if !after.holds() || !own.holds() || past.goes_on(&own) || before.goes_on(&after) {
            continue;
        }
        let end_counts = if pattern.end_side == 0 { END_OF_BEND } else { 1.0 };
        let score = after.strength + end_counts * own.strength - AGAINST * (before.strength + past.strength);
        let score = score * aim.weight(&seam.fitted.line);
        *record = (score, x, y);
        if best.is_none_or(|(most, ..)| score > most) {
            best = Some((score, after.strength, seam, end));
        }
    }
    let Some((score, strength, seam, end)) = best.filter(|best| best.0 > 0.0) else {
        return Err(if at_border {
            GreyRefusal::AtBorder
        } else {
            GreyRefusal::NoCorner
        });
    };
    let (x, y) = meet(&seam.fitted.line, &end.fitted.line);
    let same = if pattern.end_side == 0 { SAME_OF_BEND } else { SAME };
    let elsewhere = |&&(_, u, v): &&(f32, f32, f32)| (u - x) * (u - x) + (v - y) * (v - y) > same * same;
    let next = scores
        .iter()
        .filter(elsewhere)
        .fold(0.0_f32, |most, other| most.max(other.0));
    if next > RIVAL * score {
        return Err(GreyRefusal::Unclear);
    }
    Ok(Pair {
        seam: seam.fitted.line,
        end: end.fitted.line,
        strength,
        common: 0.0,
    })
}

/// Puts the middles of a bend's line, bright or dark, in the place of its edges, and moves `seam` there.
fn centre(view: &View, points: &mut Points, seam: &mut Line, end: &Line, sign: i32) -> Option<f32> {
    let (x, _) = meet(seam, end);
    let along = [x + (SKIPPED * CELL) as f32, x + REACH_DIRECTION];
    let mut common = 0.0;
    // From the second on the middle is looked for where it is.
    for _ in 0..TRACES {
        common = stripe::trace(view, seam, sign, along, points);
        *seam = fit(points, seam, 0.0, super::SIDE as f32, u16::MAX)?.line;
    }
    Some(common)
}

/// Corner and direction from the pixels near them.
fn refine([seams, ends]: [&Points; 2], pattern: &Pattern, pair: &Pair) -> Result<Corner, GreyRefusal> {
    let Pair {
        seam,
        end,
        strength,
        common,
    } = pair;
    let (x, y) = meet(seam, end);
    let skip = (SKIPPED * CELL) as f32;
    let near = |fitted: Option<Fitted>| fitted.ok_or(GreyRefusal::NoCorner);
    let seam_near = near(refit(seams, seam, x + skip, x + REACH_SEAM))?;
    let seam_far = near(refit(seams, seam, x + skip, x + REACH_DIRECTION))?;
    let (mut sum, mut weights) = (0.0_f32, 0.0_f32);
    for (side, from, to) in [(-1, y - REACH_END, y - skip), (1, y + skip, y + REACH_END)] {
        if side == -pattern.end_side {
            continue;
        }
        // Seen from beside, a bend's two ends are two lines: the one that was not voted for may be missed.
        let Some(end) = refit(ends, end, from, to) else {
            continue;
        };
        let (at, _) = meet(&seam_near.line, &end.line);
        let weight = 1.0 / end.variance_at(y);
        sum += weight * at;
        weights += weight;
    }
    let x = sum / weights;
    let variance = seam_near.variance_at(x) + 1.0 / weights;
    let sigma = sqrt(variance);
    // Negated, so that what is no number is refused.
    let known = sigma <= SIGMA_LIMIT;
    if !known {
        return Err(GreyRefusal::Unclear);
    }
    let [_, slope_variance] = seam_far.variance;
    // Three thirds of a length: their middles are a third of it apart.
    let length = REACH_DIRECTION / stripe::THIRDS as f32;
    let sigma_slope = sqrt(slope_variance.max(COMMON * common / (2.0 * length * length)));
    let sure = (SURE_SIGMA / sigma).min(SURE_SLOPE / sigma_slope);
    Ok(Corner {
        x,
        y: seam_near.line.at(x),
        slope: seam_far.line.slope,
        middle: [seam_far.mean, seam_far.line.at(seam_far.mean)],
        sigma,
        sigma_slope,
        quality: limit(f32::from(Sighting::SURE) * sure, 0.0, 255.0) as u8,
        strength: *strength,
    })
}

/// The lines of one direction, and where along them their edge is seen.
fn candidates(points: &Points, votes: &mut Votes, middle: f32, aim: &Aim) -> heapless::Vec<Candidate, LINES> {
    let seen = |fitted: &Fitted| {
        let mut cells = [(0_u8, 0_u32); CELLS];
        for point in points {
            if point.off(&fitted.line).abs() <= NEAR
                && let Some((count, sum)) = cells.get_mut(usize::from(point.along) / CELL)
            {
                *count = count.saturating_add(1);
                *sum += u32::from(point.strength);
            }
        }
        Candidate {
            fitted: *fitted,
            strength: cells.map(|(count, sum)| {
                if count < SEEN {
                    return 0;
                }
                (sum / CELL as u32).min(CEILING) as u16
            }),
        }
    };
    let mut candidates = heapless::Vec::new();
    for fitted in &votes.lines(points, middle, VOTES, aim) {
        let _ = candidates.push(seen(fitted)); // as many as lines, for which there is room
    }
    candidates
}

/// Cells before and after `at` (px) on a line across an image of `size` px; the nearest are left out.
fn sides(strength: &[u16; CELLS], at: f32, size: usize) -> (Side, Side) {
    let corner = (at as usize) / CELL;
    // The filters do not reach the image's border.
    let cells = (size / CELL).saturating_sub(1).min(CELLS);
    let in_view = strength.get(..cells).unwrap_or(&[]);
    let before = in_view.get(1..corner.saturating_sub(SKIPPED)).unwrap_or(&[]);
    (
        Side::of(before.iter().rev()),
        Side::of(in_view.iter().skip(corner + 1 + SKIPPED)),
    )
}

/// Where a seam (x along) and an end (y along) meet.
fn meet(seam: &Line, end: &Line) -> (f32, f32) {
    // y = s(x), x = e(y): the product of two slopes within ±0.3 keeps the denominator near 1.
    let (s0, e0) = (seam.at(0.0), end.at(0.0));
    let x = (e0 + end.slope * s0) / (1.0 - end.slope * seam.slope);
    (x, seam.at(x))
}
