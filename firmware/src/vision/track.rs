//! The one line that runs through the image.
//!
//! Of the ways through the bands' candidates ([`ways`](super::ways)) the best is the line: a ghost or a scratch is shorter or darker than
//! the line and so loses as a whole, even where the line itself drops out. Where the joint makes a tall step the line is two, and a
//! reflection of the one may go straight on where the step is: so the best pair is sought, of a way that ends above the step and one that
//! begins below it, and a step there must be.

use super::band::{self, BANDS, CANDIDATES, Candidate};
use super::image::View;
use super::number::limit;
use super::sensor::{Refusal, SEEN, TRACKED};
use super::ways::{self, SKIP, Ways};

/// A step of this many pixels or more is no drift. Twice that of a lap joint, half a lip's.
const TALL: f32 = 12.0;
/// Price of a pixel by which a tall step differs from the expected one, in units of one well-lit band, and its ceiling.
const STEP_PRICE: f32 = 0.1;
/// See [`STEP_PRICE`].
const STEP_MOST: f32 = 3.0;

/// Gain of a gap between two sheets, in which both their lines are dark: where a line goes over to a reflection neither is.
const GAP_GAIN: f32 = 0.5;
/// Light within this distance of a line is that line's, px.
const GAP_REACH: f32 = 14.0;
/// Less than this share of the line's usual contrast is dark.
const DARK: f32 = 0.5;

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
    let rival = Ways::through(bands.iter().take(count), first_guess);
    if rival.best.0 > RIVAL * track.score {
        return Err(Refusal::TwoLines);
    }
    Ok((track, sum / seen))
}

/// The best line through `bands`; candidates of contrast `typical` (grey levels) or more gain fully.
fn best(bands: &[[Candidate; CANDIDATES]], typical: f32, step: f32) -> Track {
    let mut track = Track {
        x: [None; BANDS],
        score: 0.0,
        seen: 0,
    };
    let down = Ways::through(bands.iter(), typical);
    if step * step < TALL * TALL {
        let (score, band, candidate) = down.best;
        track.score = score;
        down.trace(band, candidate, Some, &mut track);
        return track;
    }
    let up = Ways::through(bands.iter().rev(), typical);
    if let Some((score, (band, candidate), (other, below))) = joined(&down, &up, bands, typical, step) {
        track.score = score;
        down.trace(band, candidate, Some, &mut track);
        up.trace(other, below, |band| bands.len().checked_sub(band + 1), &mut track);
    }
    track
}

/// A band, and a candidate in it.
type At = (usize, usize);

/// Best pair of a way `down` through `bands` and of one `up` that begins a `step` (px) aside below it: their score and their ends.
fn joined(down: &Ways, up: &Ways, bands: &[[Candidate; CANDIDATES]], typical: f32, step: f32) -> Option<(f32, At, At)> {
    let count = bands.len();
    let light = DARK * typical;
    let mut best = (0.0_f32, None);
    for (band, (above, top)) in down.nodes.iter().zip(&down.tops).enumerate().take(count) {
        for skipped in 0..=SKIP {
            let Some(other) = count.checked_sub(band + 2 + skipped) else {
                break;
            };
            let (Some(below), Some(other_top)) = (up.nodes.get(other), up.tops.get(other)) else {
                break;
            };
            let skip_price = ways::SKIP_PRICE * skipped as f32;
            if top + other_top - skip_price + GAP_GAIN <= best.0 {
                continue;
            }
            let between = bands.get(band + 1..band + 1 + skipped).unwrap_or(&[]).as_flattened();
            for (index, node) in above.iter().enumerate().filter(|(_, node)| node.score > 0.0) {
                for (next_index, next) in below.iter().enumerate().filter(|(_, next)| next.score > 0.0) {
                    let off = ways::distance(next.x, node.x + step) - ways::FREE_DRIFT * skipped as f32;
                    let price = limit(STEP_PRICE * off, 0.0, STEP_MOST) + skip_price;
                    let score = node.score + next.score - price;
                    if score + GAP_GAIN <= best.0 {
                        continue;
                    }
                    let on_either = |x: f32| ways::distance(x, node.x).min(ways::distance(x, next.x)) < GAP_REACH;
                    let dark = skipped > 0 && !between.iter().any(|lit| lit.contrast > light && on_either(lit.x));
                    let score = if dark { score + GAP_GAIN } else { score };
                    if score > best.0 {
                        best = (score, Some(((band, index), (other, next_index))));
                    }
                }
            }
        }
    }
    best.1.map(|(above, below)| (best.0, above, below))
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;

    #[test]
    fn a_reflection_that_goes_straight_on_does_not_hide_a_tall_step() {
        let mut pixels = [20_u8; 250 * 250];
        for (y, row) in pixels.chunks_exact_mut(250).enumerate() {
            if y < 130 {
                row[97..=103].fill(100);
            } else if y >= 140 {
                row[121..=127].fill(100);
                row[97..=103].fill(96);
            }
        }
        let view = View::new(&pixels, 250, 250).unwrap();
        let below = |step| {
            let (track, _) = follow(&view, step).unwrap();
            track.x[25].unwrap()
        };
        assert!((below(24.0) - 124.0).abs() < 3.0, "column {}", below(24.0));
        // Where none is expected, nothing is nearer than what goes straight on.
        assert!((below(0.0) - 100.0).abs() < 3.0, "column {}", below(0.0));
    }
}
