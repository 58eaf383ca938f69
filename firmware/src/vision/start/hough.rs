//! Straight lines by votes (Hough), in fixed memory.
//!
//! A line is across = intercept + slope · (along − middle). Every edge pixel votes, for each of 65 slopes within ±14°, for the intercept that
//! it lies on; lines are where votes heap up. Strong edges vote more, up to twenty times.

use super::edges::{FRACTION, Point, Points};
use super::line::{Fitted, Line, fit};
use super::{Aim, SIDE};

/// Slopes on either side of zero, and their step: at the end of 225 px half a step is 0.9 px, half a bin.
const HALF_SLOPES: i32 = 32;
const SLOPES: usize = 2 * HALF_SLOPES as usize + 1;
const SLOPES_PER_UNIT: i32 = 128;
/// Width of an intercept's bin, px; the outermost lines leave the image by 57 px at its middle.
const BIN: i32 = 2;
const MARGIN: i32 = 60;
const BINS: usize = (SIDE + 2 * MARGIN as usize) / BIN as usize + 1;
/// Lines kept.
pub const LINES: usize = 8;
/// Edge pixels this near to a line that was found are its own, its burr's and its crevice's, px: their votes are taken back.
const OWN: f32 = 5.0;
/// An edge pixel has one vote, and one more for each time that it answers this strongly, up to [`MOST`]: a step of 40 grey levels, so that glints do not
/// outvote edges.
const ONE_VOTE: u16 = 100;
const MOST: u16 = 20;

/// A line as voted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Voted {
    line: Line,
    votes: u16,
}

/// The ballot box: 36 KB.
#[derive(Clone, Debug)]
pub struct Votes {
    bins: [[u16; BINS]; SLOPES],
}

impl Default for Votes {
    fn default() -> Self {
        Self::new()
    }
}

impl Votes {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            bins: [[0; BINS]; SLOPES],
        }
    }

    /// The lines with the most votes of `points`, most first, each fitted before its pixels' votes are taken back; `middle` is the along
    /// about which slopes turn, px. Lines with fewer than `fewest` votes, and those that `aim` does not allow, are left out.
    pub fn lines(&mut self, points: &Points, middle: f32, fewest: u16, aim: &Aim) -> heapless::Vec<Fitted, LINES> {
        self.bins.iter_mut().for_each(|bins| bins.fill(0));
        for point in points {
            self.vote(point, middle, u16::saturating_add);
        }
        let mut lines = heapless::Vec::new();
        for _ in 0..LINES {
            let voted = self.most(middle, aim);
            if voted.votes < fewest {
                break;
            }
            let fitted = fit(points, &voted.line, 0.0, SIDE as f32, u16::MAX);
            let line = fitted.map_or(voted.line, |fitted| fitted.line);
            for point in points {
                if point.off(&line).abs() <= OWN || point.off(&voted.line).abs() <= BIN as f32 {
                    self.vote(point, middle, u16::saturating_sub);
                }
            }
            if let Some(fitted) = fitted {
                let _ = lines.push(fitted); // never full: as many rounds as places
            }
        }
        lines
    }

    /// Adds or takes away a pixel's votes. Of each slope and its opposite the intercepts lie as far on either side of the pixel.
    fn vote(&mut self, point: &Point, middle: f32, change: impl Fn(u16, u16) -> u16) {
        let weight = 1 + (point.strength / ONE_VOTE).min(MOST);
        let along = i32::from(point.along) * FRACTION - (middle * FRACTION as f32) as i32;
        let cast = |bins: &mut [u16; BINS], intercept: i32| {
            let bin = (intercept + MARGIN * FRACTION).max(0) as u32 / (BIN * FRACTION) as u32;
            if let Some(votes) = bins.get_mut(bin as usize) {
                *votes = change(*votes, weight);
            }
        };
        let across = i32::from(point.across);
        let (falling, others) = self.bins.split_at_mut(HALF_SLOPES as usize);
        let Some((level, rising)) = others.split_first_mut() else {
            return; // there are as many rising slopes as falling ones, and one between
        };
        cast(level, across);
        let mut rise = 0;
        for (rising, falling) in rising.iter_mut().zip(falling.iter_mut().rev()) {
            rise += along.unsigned_abs();
            let off = along.signum() * (rise / SLOPES_PER_UNIT as u32) as i32;
            cast(rising, across - off);
            cast(falling, across + off);
        }
    }

    /// The allowed line of the pair of neighbouring bins with the most votes.
    fn most(&self, middle: f32, aim: &Aim) -> Voted {
        let mut best = Voted::default();
        let [from, to] = [-1.0, 1.0].map(|side| aim.middle + side * aim.off);
        let bin = |intercept: f32| (intercept as i32 + MARGIN).max(0) as usize / BIN as usize;
        let (first, count) = (bin(from), bin(to).saturating_sub(bin(from)));
        for (slope, bins) in self.bins.iter().enumerate() {
            let slope = (slope as i32 - HALF_SLOPES) as f32 / SLOPES_PER_UNIT as f32;
            if slope.abs() > aim.slope {
                continue;
            }
            let pairs = bins.iter().zip(bins.iter().skip(1)).enumerate();
            for (bin, (&a, &b)) in pairs.skip(first).take(count) {
                let votes = a.saturating_add(b);
                if votes > best.votes {
                    let line = Line {
                        intercept: (BIN * bin as i32 - MARGIN + BIN) as f32,
                        slope,
                        middle,
                    };
                    best = Voted { line, votes };
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn of_each_slope_the_line_through_a_pixel_gets_its_votes(along in 0_u16..450, across in 0_u16..28_800, strength in 0_u16..9000) {
            let mut votes = Votes::new();
            votes.vote(&Point { along, across, strength }, 224.5, u16::saturating_add);
            for (index, bins) in votes.bins.iter().enumerate() {
                let turned = (index as i32 - HALF_SLOPES) * (i32::from(along) * FRACTION - 224 * FRACTION - FRACTION / 2);
                let bin = (i32::from(across) - turned / SLOPES_PER_UNIT + MARGIN * FRACTION) / (BIN * FRACTION);
                for (at, votes) in bins.iter().enumerate() {
                    let own = at as i32 == bin.max(0);
                    prop_assert_eq!(*votes, if own { 1 + (strength / 100).min(20) } else { 0 });
                }
            }
        }
    }

    #[test]
    fn two_lines_among_scattered_points_get_the_most_votes() {
        let mut points = Points::new();
        let mut push = |along: usize, across: f32| {
            points
                .push(Point {
                    along: along as u16,
                    across: (across * FRACTION as f32) as u16,
                    strength: 500,
                })
                .unwrap();
        };
        for along in 100..400 {
            push(along, 200.0 + 0.11 * (along as f32 - 224.5));
        }
        for along in 0..200 {
            push(along, 330.0 - 0.05 * (along as f32 - 224.5));
        }
        let mut state = 1_u32;
        for _ in 0..2500 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            push((state >> 8) as usize % 450, ((state >> 17) % 449) as f32);
        }
        let lines = Votes::new().lines(&points, 224.5, 500, &Aim::ANYWHERE);
        let [first, second] = lines.as_slice() else {
            panic!("{lines:?}");
        };
        assert!(
            (first.line.intercept - 200.0).abs() < 0.1 && (first.line.slope - 0.11).abs() < 0.002,
            "{first:?}"
        );
        assert!(
            (second.line.intercept - 330.0).abs() < 0.2 && (second.line.slope + 0.05).abs() < 0.002,
            "{second:?}"
        );
        // The second alone, where a seam is expected.
        let aim = Aim {
            middle: 330.0,
            off: 32.0,
            slope: 0.14,
        };
        let lines = Votes::new().lines(&points, 224.5, 500, &aim);
        let [only] = lines.as_slice() else {
            panic!("{lines:?}");
        };
        assert!((only.line.intercept - 330.0).abs() < 0.2, "{only:?}");
    }
}
