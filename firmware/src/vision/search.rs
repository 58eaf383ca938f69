//! In which bands a joint may be.
//!
//! Rows are gathered into bands. A short filter that is blind to offset and slope measures a step, or a kink, about every
//! band; where it is largest the joint's shape is fitted with and without its feature. The best place must be better than
//! no joint, and than any other place.

use super::fit::Problem;
use super::image::SIDE_MAX;
use super::joint::{Feature, HALF_WINDOW};
use super::sensor::Refusal;
use super::window::{Line, Sample};

/// Rows to a band.
pub const PITCH: usize = 4;
/// Most bands of an image.
const BANDS: usize = SIDE_MAX / PITCH;
/// Half a fit's window, bands.
const HALF_BANDS: usize = HALF_WINDOW / PITCH;
/// Half the filter's length, bands: 24 rows. With a band's deviation of 0.7 px a step is known to 0.8 px, of 6 px.
const ARM: usize = 6;
/// Places that are fitted.
const TRIED: usize = 4;
/// The filter's answer counts up to this multiple of the feature's size; more is a ghost or a glint.
const MOST: f32 = 1.5;
/// And from this share of it.
const LEAST: f32 = 0.2;
/// Logarithm of the likelihood ratio joint : no joint that is asked for: next to nothing, as the fit to the rows tells more than that to bands.
const EVIDENCE: f32 = 1.0;
/// Logarithm of the likelihood ratio between the place and the next best one elsewhere.
const ADVANTAGE: f32 = 3.0;
/// Places nearer than this to the best are the same place, bands.
const SAME: usize = 4;

/// The band at which the joint is likeliest; `sigma` is the standard deviation of a row's centre, px.
pub fn likeliest(line: &Line, feature: &Feature, sigma: f32) -> Result<usize, Refusal> {
    let samples: [Sample; BANDS] = line.gather(PITCH);
    let bands = (line.rows / PITCH).min(BANDS);
    let answers = filter(samples.get(..bands).unwrap_or(&[]), feature);
    let evidence_at = |band: usize| {
        let first = band.saturating_sub(HALF_BANDS);
        let seam = (band * PITCH) as f32 - 0.5;
        let problem = Problem {
            samples: samples.get(first..(band + HALF_BANDS).min(bands)).unwrap_or(&[]),
            origin: seam,
            sigma,
            feature: Some(feature),
        };
        let [without, with] = problem.without_and_with(seam);
        without.cost - with.cost
    };
    let tried = peaks(answers.get(..bands).unwrap_or(&[])).map(|peak| peak.map(|band| (evidence_at(band), band)));
    let largest = |best: (f32, usize), next: (f32, usize)| if next.0 > best.0 { next } else { best };
    let best = tried.into_iter().flatten().fold((0.0, 0), largest);
    // The filter is coarse: the place may lie a band beside.
    let best = [best.1.saturating_sub(1), best.1 + 1]
        .into_iter()
        .filter(|&band| best.0 > 0.0 && band > 1 && band < bands)
        .map(|band| (evidence_at(band), band))
        .fold(best, largest);
    if best.0 < EVIDENCE {
        return Err(Refusal::NoStep);
    }
    let elsewhere = |place: &(f32, usize)| place.1 + SAME < best.1 || place.1 > best.1 + SAME;
    let next = tried.into_iter().flatten().filter(elsewhere).fold((0.0, 0), largest);
    if best.0 - next.0 < ADVANTAGE {
        return Err(Refusal::Unclear);
    }
    Ok(best.1)
}

/// How much of the feature, 1 for its expected size, is seen between band `i − 1` and band `i`.
fn filter(samples: &[Sample], feature: &Feature) -> [f32; BANDS] {
    // Unseen bands repeat the last centre; past its ends the line goes on as it came, turned about its end.
    let mut padded = [0.0_f32; BANDS + 2 * ARM];
    let mut seen = samples.iter().filter(|sample| sample.weight > 0.0);
    let (first, last) = (
        seen.next().map_or(0.0, |sample| sample.x),
        seen.next_back().map_or(0.0, |sample| sample.x),
    );
    let mut centre = first;
    for (value, sample) in padded.iter_mut().skip(ARM).zip(samples) {
        if sample.weight > 0.0 {
            centre = sample.x;
        }
        *value = centre;
    }
    let inner = padded;
    for (value, mirrored) in padded.iter_mut().take(ARM).rev().zip(inner.iter().skip(ARM + 1)) {
        *value = 2.0 * first - mirrored;
    }
    let end = ARM + samples.len();
    for (value, mirrored) in padded
        .iter_mut()
        .skip(end)
        .zip(inner.iter().take(end - 1).rev())
        .take(ARM)
    {
        *value = 2.0 * last - mirrored;
    }
    let taps = taps(feature);
    let mut answers = [0.0; BANDS];
    for (answer, window) in answers.iter_mut().zip(padded.windows(2 * ARM)).take(samples.len()) {
        *answer = window.iter().zip(&taps).fold(0.0, |sum, (x, tap)| sum + x * tap);
    }
    answers
}

/// The filter's weights: the feature less its mean and slope, scaled to answer 1.
fn taps(feature: &Feature) -> [f32; 2 * ARM] {
    let shape: [f32; 2 * ARM] = core::array::from_fn(|band| {
        let below = ((band as f32 + 0.5) - ARM as f32) * PITCH as f32;
        feature.size * feature.at(below)
    });
    let u = |band: usize| band as f32 + 0.5 - ARM as f32;
    let mean = shape.iter().sum::<f32>() / (2 * ARM) as f32;
    let (mut moment, mut square) = (0.0_f32, 0.0_f32);
    for (band, value) in shape.iter().enumerate() {
        moment += u(band) * value;
        square += u(band) * u(band);
    }
    let mut taps = shape;
    let mut energy = 0.0_f32;
    for (band, tap) in taps.iter_mut().enumerate() {
        *tap -= mean + moment / square * u(band);
        energy += *tap * *tap;
    }
    taps.map(|tap| tap / energy.max(1e-6))
}

/// The bands in which the answer is largest among its neighbours, largest first.
fn peaks(answers: &[f32]) -> [Option<usize>; TRIED] {
    let mut found = [(LEAST, None); TRIED];
    for (band, window) in answers.windows(3).enumerate() {
        let &[before, here, after] = window else { continue };
        // Bands 0 and 1 have too little above them for a joint.
        if before > here || after >= here || band < 1 {
            continue;
        }
        let mut new = (here.min(MOST), Some(band + 1));
        for kept in &mut found {
            if new.0 > kept.0 {
                core::mem::swap(kept, &mut new);
            }
        }
    }
    found.map(|(_, band)| band)
}
