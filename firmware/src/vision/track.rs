//! The one line that runs through the image.
//!
//! Dynamic programming over the bands' candidates: a line gains by the brightness of the candidates it passes and pays
//! for sideways jumps and for bands that it skips. A ghost or a scratch is shorter or darker than the line and so loses
//! as a whole, even where the line itself drops out. The jump's price has a ceiling, so that the step of a joint is paid
//! for once.

use super::band::{self, BANDS, CANDIDATES, Candidate};
use super::image::View;
use super::number::limit;
use super::sensor::{Refusal, SEEN, TRACKED};

/// Longest run of bands that a line may skip: 32 rows from seen to seen, 3.8 mm, more than the gap and shadow of a sheet's edge.
const SKIP: usize = 3;
/// Sideways drift per band that costs nothing, px: a flank of 15° with the sensor 10° tilted drifts 4 px in 8 rows.
const FREE_DRIFT: f32 = 4.0;
/// Price of a pixel of drift beyond, in units of one well-lit band. A step of 6 px costs an eighth of a band's worth,
/// a ghost 20 px aside one band's.
const DRIFT_PRICE: f32 = 0.06;
/// Ceiling of that price: a jump anywhere, for a sheet edge's drop.
const JUMP_PRICE: f32 = 2.0;
/// The joint's own step is paid for like this many pixels of drift, and what it differs from the expected: a reflection that leaves a
/// shorter way aside shall not be cheaper.
const STEP_DRIFT: f32 = 12.0;
/// Price of a skipped band.
const SKIP_PRICE: f32 = 0.15;
/// Gain of a candidate as bright as the line, less this, is the gain of none: keeps noise from being worth passing.
const GAIN_FLOOR: f32 = 0.15;

/// Weakest line, grey levels over the background: twice the noise of a dark image summed over a candidate's area.
const FAINTEST: u8 = 4;
/// A second line with this share of the first one's score makes it doubtful which is which.
const RIVAL: f32 = 0.88;

/// Where the line is in each band: NaN-free, `None` where it is not seen.
#[derive(Clone, Copy, Debug)]
pub struct Track {
    /// Column by band, px.
    pub x: [Option<f32>; BANDS],
    /// Sum of the gains less the prices: about the number of well-lit bands.
    pub score: f32,
    /// Bands in which the line is seen.
    pub seen: usize,
}

#[derive(Clone, Copy, Default)]
struct Node {
    x: f32,
    score: f32,
    /// Candidate passed before: bands back (0 for none) and its index.
    back: u8,
    index: u8,
}

/// Finds the line, which may step aside by `step` px at the joint: its track and its usual contrast.
pub fn follow(view: &View, step: f32) -> Result<(Track, f32), Refusal> {
    let mut bands = [[Candidate::default(); CANDIDATES]; BANDS];
    let count = band::count(view.height());
    let (mut sum, mut lit) = (0.0_f32, 0.0_f32);
    for (index, band) in bands.iter_mut().take(count).enumerate() {
        *band = band::candidates(view, index, FAINTEST);
        let [strongest, ..] = band;
        if strongest.contrast > 0.0 {
            sum += strongest.contrast;
            lit += 1.0;
        }
    }
    let fewest = SEEN * count.min(band::count(TRACKED)) as f32;
    if lit < fewest {
        return Err(Refusal::NoLine);
    }
    let in_image = bands.get(..count).unwrap_or(&[]);
    // The strongest are the line's where it is lit; glints raise the mean, drop-outs lower it.
    let first_guess = sum / lit;
    let track = best(in_image, first_guess, step);
    if (track.seen as f32) < fewest {
        return Err(Refusal::NoLine);
    }
    let (mut sum, mut seen) = (0.0_f32, 0.0_f32);
    for (band, x) in bands.iter_mut().zip(&track.x) {
        let Some(x) = x else { continue };
        for candidate in band {
            let away = candidate.x - x;
            if away == 0.0 {
                sum += candidate.contrast.min(2.0 * first_guess);
                seen += 1.0;
            }
            // What is not on the line is left for a rival.
            if away * away < 8.0 * 8.0 {
                candidate.contrast = 0.0;
            }
        }
    }
    let rival = best(bands.get(..count).unwrap_or(&[]), first_guess, step);
    if rival.score > RIVAL * track.score {
        return Err(Refusal::TwoLines);
    }
    Ok((track, sum / seen))
}

/// The best line through `bands`; candidates of contrast `typical` (grey levels) or more gain fully.
fn best(bands: &[[Candidate; CANDIDATES]], typical: f32, step: f32) -> Track {
    let mut nodes = [[Node::default(); CANDIDATES]; BANDS];
    // Best score of each band: a band that cannot better what nearer ones gave is passed over as a whole.
    let mut tops = [0.0_f32; BANDS];
    let mut end = (0.0_f32, 0_usize, 0_usize);
    for (band, candidates) in bands.iter().take(BANDS).enumerate() {
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
                    let aside =
                        distance(candidate.x, previous.x).min(STEP_DRIFT + distance(candidate.x, previous.x + step));
                    let drift = aside - FREE_DRIFT * bands_apart;
                    let price = limit(DRIFT_PRICE * drift, 0.0, JUMP_PRICE) + skip_price;
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
    let mut track = Track {
        x: [None; BANDS],
        score: end.0,
        seen: 0,
    };
    let (mut band, mut index) = (end.1, end.2);
    for _ in 0..BANDS {
        let Some(node) = nodes.get(band).and_then(|row| row.get(index)) else {
            break;
        };
        if node.score <= 0.0 {
            break;
        }
        if let Some(x) = track.x.get_mut(band) {
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
    track
}

fn distance(a: f32, b: f32) -> f32 {
    if a > b { a - b } else { b - a }
}
