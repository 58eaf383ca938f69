//! Ways through the bands' candidates, by dynamic programming.
//!
//! A way gains by the brightness of the candidates it passes, and pays for sideways jumps and for bands that it skips. The jump's price has
//! a ceiling, so that the low step of a lap joint is paid for once.

use super::band::{BANDS, CANDIDATES, Candidate};
use super::number::limit;
use super::track::Track;

/// Longest run of bands that a line may skip: 32 rows from seen to seen, 3.8 mm, more than the gap and shadow of a sheet's edge.
pub const SKIP: usize = 3;
/// Sideways drift per band that costs nothing, px: a flank of 15° with the sensor 10° tilted drifts 4 px in 8 rows.
pub const FREE_DRIFT: f32 = 4.0;
/// Price of a pixel of drift beyond, in units of one well-lit band. A step of 6 px costs an eighth of a band's worth,
/// a ghost 20 px aside one band's.
const DRIFT_PRICE: f32 = 0.06;
/// Ceiling of that price: a jump anywhere, for a sheet edge's drop.
const JUMP_PRICE: f32 = 2.0;
/// The joint's own step is paid for like this many pixels of drift, and what it differs from the expected: a reflection that leaves a
/// shorter way aside shall not be cheaper.
const STEP_DRIFT: f32 = 12.0;
/// Price of a skipped band.
pub const SKIP_PRICE: f32 = 0.15;
/// Gain of a candidate as bright as the line, less this, is the gain of none: keeps noise from being worth passing.
const GAIN_FLOOR: f32 = 0.15;

/// What it costs a way to move aside, in units of one well-lit band.
#[derive(Clone, Copy, Debug)]
pub struct Aside {
    /// Price of a pixel beyond [`FREE_DRIFT`].
    pub per_px: f32,
    /// Ceiling of that price.
    pub most: f32,
    /// The step that there may be, px; 0 for none.
    pub step: f32,
}

impl Aside {
    /// For a line that steps aside by `step` (px) of its own.
    pub fn with_step(step: f32) -> Self {
        Self {
            per_px: DRIFT_PRICE,
            most: JUMP_PRICE,
            step,
        }
    }
}

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
    pub fn through<'a>(
        bands: impl Iterator<Item = &'a [Candidate; CANDIDATES]>,
        typical: f32,
        price_aside: Aside,
    ) -> Self {
        let Aside { per_px, most, step } = price_aside;
        let mut nodes = [[Node::default(); CANDIDATES]; BANDS];
        let mut tops = [0.0_f32; BANDS];
        let mut end = (0.0_f32, 0_usize, 0_usize);
        for (band, candidates) in bands.take(BANDS).enumerate() {
            let (past, rest) = nodes.split_at_mut(band.min(BANDS));
            let (past_tops, rest_tops) = tops.split_at_mut(band.min(BANDS));
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
                    let bands_apart = (skipped + 1) as f32;
                    for (from, previous) in before.iter().enumerate() {
                        // Candidates come strongest first; none follows an empty one.
                        if previous.score <= best.score {
                            continue;
                        }
                        let aside = distance(candidate.x, previous.x)
                            .min(STEP_DRIFT + distance(candidate.x, previous.x + step));
                        let drift = aside - FREE_DRIFT * bands_apart;
                        let price = limit(per_px * drift, 0.0, most) + skip_price;
                        if previous.score - price > best.score {
                            best.score = previous.score - price;
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
                if best.score > end.0 {
                    end = (best.score, band, index);
                }
            }
        }
        Self { nodes, tops, best: end }
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
