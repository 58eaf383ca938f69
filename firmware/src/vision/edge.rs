//! Where along the line its sheet ends, from what each row says.
//!
//! Once the lines of both sheets are known, a row near the seam is asked which of them shows light: `exchange` where one sheet's line
//! follows the other's in the very next row, `ending` where a sheet ends beside a gap. What a row can say is limited, so that a
//! glint of a few rows moves the edge no further than its own size, and a row without light says next to nothing. The sum of what
//! the rows say, over all places of the edge, is the logarithm of the place's likelihood. The answer is the mean over the few rows that
//! together are likeliest: where two places compete, the mean over both would be neither.

use super::image::{self, View};
use crate::geometry::trig::sqrt;

/// Rows about the expected place that are asked, to either side.
pub const REACH: usize = 32;
/// Rows that are asked.
pub const ROWS: usize = 2 * REACH;
/// Rows that together are one place: 0.5 mm to either side of their middle.
const PLACE: usize = 9;
/// Rows beyond which a place is another one: 1 mm.
const FAR: usize = 8;
/// A place this share as likely as the likeliest beside it is as good.
const ALIKE: f32 = 0.98;
/// A saturated pixel.
pub const SATURATED: u8 = 250;
/// Width of a side and its distance from what it is beside, px.
const SIDE: usize = 8;
/// See [`SIDE`].
const SIDE_AWAY: usize = 6;

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
    /// Its standard deviation, px: of all places it may have.
    pub sigma: f32,
    /// How likely it is within half a place of there, 0..=1.
    pub share: f32,
    /// How likely it is more than a millimetre from there, 0..=1.
    pub far: f32,
}

/// Brightness of the line.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Background, grey levels.
    pub background: f32,
    /// Line above the background, grey levels.
    pub contrast: f32,
}

impl Edge {
    /// The edge whose logarithm of the likelihood is given with none, one, … of [`ROWS`] rows passed, `direction` rows apart, the first
    /// half of which pass before row `middle`.
    pub fn likeliest(log_likelihood: &[f32; ROWS + 1], middle: f32, direction: f32) -> Self {
        let most = log_likelihood.iter().fold(f32::MIN, |most, &value| most.max(value));
        let likelihood = log_likelihood.map(|value| decay(most - value));
        let mut masses = [0.0_f32; ROWS + 2 - PLACE];
        for (mass, rows) in masses.iter_mut().zip(likelihood.windows(PLACE)) {
            *mass = rows.iter().sum();
        }
        let (best, most) = masses.iter().enumerate().fold(
            (0, 0.0_f32),
            |best, (at, &mass)| {
                if mass > best.1 { (at, mass) } else { best }
            },
        );
        // Where its neighbours are about as likely, as in a drop-out longer than a place, it is in the middle of them.
        let alike = |mass: &&f32| **mass >= ALIKE * most;
        let (before, after) = masses.split_at_checked(best).unwrap_or_default();
        let first = best - before.iter().rev().take_while(alike).count();
        let last = best + after.iter().take_while(alike).count();
        let rows = likelihood.get(first..last + PLACE - 1).unwrap_or(&likelihood);
        let (best, all) = (Moments::of(rows, first), Moments::of(&likelihood, 0));
        let mean = best.moment / best.mass;
        // About the answer, not about the mean of all.
        let square = (all.square - 2.0 * mean * all.moment) / all.mass + mean * mean;
        let about = (mean + REACH as f32 + 0.5) as usize;
        let before = likelihood.get(..about.saturating_sub(FAR)).unwrap_or(&[]);
        let after = likelihood.get(about + FAR + 1..).unwrap_or(&[]);
        // Each by itself: of all less what is near, rounding would leave nothing.
        let far: f32 = before.iter().sum::<f32>() + after.iter().sum::<f32>();
        let there = masses.get(about.saturating_sub(PLACE / 2)).unwrap_or(&0.0);
        Self {
            y: middle + direction * mean,
            // A row's own width: uniform over one row, √(1/12).
            sigma: sqrt(square.max(0.083)),
            share: there / all.mass,
            far: far / all.mass,
        }
    }
}

/// Likelihood of several places of the edge, and its first and second moment about half of [`ROWS`].
#[derive(Default)]
struct Moments {
    mass: f32,
    moment: f32,
    square: f32,
}

impl Moments {
    /// Those of the places from `first` on.
    fn of(likelihood: &[f32], first: usize) -> Self {
        let mut sums = Self::default();
        let mut at = first as f32 - REACH as f32;
        for likelihood in likelihood {
            sums.mass += likelihood;
            sums.moment += likelihood * at;
            sums.square += likelihood * at * at;
            at += 1.0;
        }
        sums
    }
}

/// The two sides of columns `first..last`.
pub struct Sides<'a> {
    left: &'a [u8],
    right: &'a [u8],
}

impl<'a> Sides<'a> {
    /// Those in row `row`.
    pub fn of(view: &View<'a>, row: usize, first: usize, last: usize) -> Self {
        let left = first.saturating_sub(SIDE_AWAY + SIDE);
        let right = last + SIDE_AWAY;
        Self {
            left: view.span(row, left, left + SIDE),
            right: view.span(row, right, right + SIDE),
        }
    }

    /// Mean of each side, grey levels.
    fn means(&self) -> (f32, f32) {
        let mean = |side: &[u8]| {
            let (fours, _) = side.as_chunks();
            fours.iter().fold(0, |total, &four| total + image::sum([four])) as f32 / SIDE as f32
        };
        (mean(self.left), mean(self.right))
    }

    /// The darker side's mean, grey levels: a ghost lies on one side only.
    pub fn darker(&self) -> f32 {
        let (left, right) = self.means();
        left.min(right)
    }

    /// Mean of both sides, grey levels, or of the darker where they are more than `apart` apart; and the sum of the differences of
    /// neighbours in the darker, of which there are [`Self::DIFFERENCES`].
    pub fn dark(&self, apart: f32) -> (f32, u32) {
        let (left, right) = self.means();
        let (dark, difference, quiet) = if left < right {
            (left, right - left, self.left)
        } else {
            (right, left - right, self.right)
        };
        let neighbours = quiet.iter().zip(quiet.iter().skip(1));
        let roughness = neighbours.fold(0, |sum, (&a, &b)| sum + u32::from(a.abs_diff(b)));
        (
            if difference < apart {
                dark + 0.5 * difference
            } else {
                dark
            },
            roughness,
        )
    }

    /// See [`Self::dark`].
    pub const DIFFERENCES: usize = SIDE - 1;
}

/// exp(−cost) as (1 + cost/64)⁻⁶⁴: 1 % high at a cost of 1, twice as high at 10, where a place no longer counts.
pub fn decay(cost: f32) -> f32 {
    let mut power = 1.0 + cost / 64.0;
    for _ in 0..6 {
        power *= power;
    }
    1.0 / power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The edge where the rows say nothing against places `even`, and much against all others but, by `less`, `other`.
    fn edge(even: core::ops::Range<usize>, other: usize, less: f32) -> Edge {
        let mut log_likelihood = [-100.0; ROWS + 1];
        log_likelihood[other] = -less;
        log_likelihood[even].fill(0.0);
        Edge::likeliest(&log_likelihood, 0.0, 1.0)
    }

    #[test]
    fn of_two_places_the_likelier_is_the_answer_and_not_their_mean() {
        for (less, share) in [(0.01, 0.5), (0.5, 0.62), (3.0, 0.95)] {
            let edge = edge(10..11, 30, less);
            assert!((edge.y + 22.0).abs() < 0.1, "row {} at {less}", edge.y);
            assert!((edge.share - share).abs() < 0.02, "share {} at {less}", edge.share);
            assert!(edge.sigma > 4.0, "{} rows at {less}", edge.sigma);
        }
    }

    #[test]
    fn how_likely_it_is_a_millimetre_off_is_known_though_that_is_next_to_nothing() {
        for (less, far) in [(3.0, 0.05), (10.0, 8e-5), (20.0, 3e-8)] {
            let at = edge(10..11, 30, less).far;
            assert!((0.5..1.5).contains(&(at / far)), "{at} at {less}");
        }
        // Within a millimetre it is the same place.
        assert!(edge(10..11, 18, 3.0).far < 1e-9);
    }

    #[test]
    fn of_many_places_alike_it_is_the_middle_one_as_likely_as_its_rows() {
        let edge = edge(20..50, 34, 0.0);
        assert!((edge.y - 2.5).abs() < 0.1, "row {}", edge.y);
        assert!((edge.share - 9.0 / 30.0).abs() < 0.02, "share {}", edge.share);
        assert!((edge.sigma - 8.7).abs() < 0.3, "{} rows", edge.sigma);
    }
}
