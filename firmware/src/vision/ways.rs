//! Ways through the bands' candidates, by dynamic programming.
//!
//! A way gains by the brightness of the candidates it passes, and pays for sideways jumps and for bands that it skips. What sheets and
//! the step of a lap joint move aside from one band to the next is all but free; a reflection lies further off.

use super::band::{BANDS, CANDIDATES, Candidate};
use super::number::limit;
use super::track::Track;

/// Longest run of bands that a line may skip: 32 rows from seen to seen, 3.8 mm, more than the gap and shadow of a sheet's edge.
pub const SKIP: usize = 3;
/// Sideways drift per band that costs nothing, px: a flank of 15° with the sensor 10° tilted drifts 4 px in 8 rows.
pub const FREE_DRIFT: f32 = 4.0;
/// Price of a pixel of drift beyond, in units of one well-lit band: the step of a lap joint costs a third of a band's worth at most, a ghost
/// 20 px aside three bands'.
const DRIFT_PRICE: f32 = 0.2;
/// Ceiling of that price: a jump anywhere, for dents.
const JUMP_PRICE: f32 = 4.0;
/// Price of a skipped band.
pub const SKIP_PRICE: f32 = 0.15;
/// Gain of a candidate as bright as the line, less this, is the gain of none: keeps noise from being worth passing.
const GAIN_FLOOR: f32 = 0.15;

/// The best way to a candidate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    /// The candidate's column, px.
    pub x: f32,
    /// Sum of the gains less the prices; not above 0 where there is no candidate.
    pub score: f32,
    /// Candidate passed before: bands back (0 for none) and its index.
    back: u8,
    index: u8,
}

/// The best ways to each candidate.
#[derive(Clone, Copy, Debug)]
pub struct Ways {
    /// By band and candidate.
    pub nodes: [[Node; CANDIDATES]; BANDS],
    /// Best score of each band: a band that cannot better what nearer ones gave is passed over as a whole.
    pub tops: [f32; BANDS],
    /// Best score of all, its band and candidate.
    pub best: (f32, usize, usize),
}

impl Ways {
    /// The ways through `bands`, one after the other; candidates of contrast `typical` (grey levels) or more gain fully.
    pub fn through<'a>(bands: impl Iterator<Item = &'a [Candidate; CANDIDATES]>, typical: f32) -> Self {
        let mut ways = Self {
            nodes: [[Node::default(); CANDIDATES]; BANDS],
            tops: [0.0; BANDS],
            best: (0.0, 0, 0),
        };
        for (band, candidates) in bands.take(BANDS).enumerate() {
            let (past, rest) = ways.nodes.split_at_mut(band.min(BANDS));
            let (past_tops, rest_tops) = ways.tops.split_at_mut(band.min(BANDS));
            let (Some(row), Some(top)) = (rest.first_mut(), rest_tops.first_mut()) else {
                break;
            };
            for (index, (node, candidate)) in row.iter_mut().zip(candidates).enumerate() {
                if candidate.contrast <= 0.0 {
                    continue;
                }
                let gain = (candidate.contrast / typical).min(1.0) - GAIN_FLOOR;
                let mut best = Node {
                    x: candidate.x,
                    ..Node::default()
                };
                let before = past.iter().rev().zip(past_tops.iter().rev()).take(SKIP + 1);
                for (skipped, (before, top)) in before.enumerate() {
                    let skip_price = SKIP_PRICE * skipped as f32;
                    if top - skip_price <= best.score {
                        continue;
                    }
                    let free = FREE_DRIFT * (skipped + 1) as f32;
                    for (from, previous) in before.iter().enumerate() {
                        // Candidates come strongest first; none follows an empty one.
                        if previous.score <= best.score {
                            continue;
                        }
                        let drift = distance(candidate.x, previous.x) - free;
                        let score = previous.score - limit(DRIFT_PRICE * drift, 0.0, JUMP_PRICE) - skip_price;
                        if score > best.score {
                            best.score = score;
                            best.back = skipped as u8 + 1;
                            best.index = from as u8;
                        }
                    }
                }
                best.score += gain;
                *node = best;
                if best.score > *top {
                    *top = best.score;
                }
                let (most, ..) = ways.best;
                if best.score > most {
                    ways.best = (best.score, band, index);
                }
            }
        }
        ways
    }

    /// Writes the best way to a candidate into `track`; `place` tells where in the image a band of these ways is.
    pub fn trace(&self, mut band: usize, mut index: usize, place: impl Fn(usize) -> Option<usize>, track: &mut Track) {
        for _ in 0..BANDS {
            let Some(node) = self.nodes.get(band).and_then(|row| row.get(index)) else {
                break;
            };
            if node.score <= 0.0 {
                break;
            }
            if let Some(x) = place(band).and_then(|band| track.x.get_mut(band)) {
                *x = Some(node.x);
                track.seen += 1;
            }
            let back = usize::from(node.back);
            if back == 0 || back > band {
                break;
            }
            band -= back;
            index = usize::from(node.index);
        }
    }
}

/// Distance of two columns, px.
pub fn distance(a: f32, b: f32) -> f32 {
    if a > b { a - b } else { b - a }
}
