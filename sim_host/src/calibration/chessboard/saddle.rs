//! Points where two edges cross and four sectors alternate between dark and bright: candidates for corners.

use std::f64::consts::{PI, TAU};

use super::plane::Plane;
use super::subpixel;
use crate::calibration::Pixel;

/// Blur before the search, px: over the grain of a photograph, under the squares.
const BLUR_PX: f64 = 1.2;
/// Radius of the ring on which the sectors are counted, px. Assumed: outside the blur, inside squares of 12 px.
const RING_PX: f64 = 4.0;
/// Samples on the ring, an even number; a sector of 20° still gets two.
const RING_SAMPLES: usize = 32;
/// Least difference between bright and dark on the ring, grey values: several times a camera's noise.
const MIN_CONTRAST: f64 = 12.0;
/// Narrowest sector, rad: a board turned 73° away from the camera.
const MIN_SECTOR_RAD: f64 = 0.3;
/// How far an edge may bend as it goes through the corner, rad.
const MAX_BEND_RAD: f64 = 0.4;
/// How unlike opposite sectors may be, as a share of the contrast. Assumed: corners of the photographs of OpenCV stay
/// below 0.1, outer corners of squares at the rim of their boards lie above 0.2.
const MAX_ASYMMETRY: f64 = 0.2;
/// How far from the saddle the edges about it may meet, px: at a corner it is the blur's share, at the rim of a board,
/// where edges pass one another, several pixels.
const MAX_OFFSET_PX: f64 = 1.5;
/// Half the side of the window that says where they meet, px.
const HALF_WINDOW_PX: i32 = 3;
/// Half the side of the square in which only the strongest saddle is kept, px.
const SUPPRESSION_PX: usize = 3;
/// Strongest saddles that are looked at: a board of 2500 corners and as much clutter.
const MAX_CANDIDATES: usize = 5000;

/// A crossing of two edges.
#[derive(Clone, Copy, Debug)]
pub struct Saddle {
    /// Where it is, px.
    pub at: Pixel,
    /// Directions of the two edges, rad, as lines (modulo π). Going round the corner with the angle increasing (from x to y), the first
    /// is crossed from dark to bright, the second from bright to dark.
    pub axes: [f64; 2],
    /// Difference between bright and dark, grey values.
    pub contrast: f64,
}

/// Every saddle of the image, in order of position.
pub fn find(image: &Plane) -> Vec<Saddle> {
    let margin = RING_PX.ceil() as usize + 1;
    if image.width <= 2 * margin || image.height <= 2 * margin {
        return Vec::new();
    }
    let blurred = image.blurred(BLUR_PX);
    let strength = saddle_strength(&blurred);
    let strength_at = |x: usize, y: usize| strength[y * image.width + x];
    let is_peak = |x: usize, y: usize| {
        let here = strength_at(x, y);
        let columns = x - SUPPRESSION_PX..=x + SUPPRESSION_PX;
        here > 0.0
            && (y - SUPPRESSION_PX..=y + SUPPRESSION_PX).all(|row| {
                // Of two equal ones the first in reading order counts.
                columns.clone().all(|column| match strength_at(column, row) {
                    other if (row, column) < (y, x) => other < here,
                    other => other <= here,
                })
            })
    };
    let mut peaks: Vec<(usize, usize)> = (margin..image.height - margin)
        .flat_map(|y| (margin..image.width - margin).map(move |x| (x, y)))
        .filter(|(x, y)| is_peak(*x, *y))
        .collect();
    peaks.sort_by(|a, b| strength_at(b.0, b.1).total_cmp(&strength_at(a.0, a.1)));
    peaks.truncate(MAX_CANDIDATES);
    peaks
        .iter()
        .filter_map(|(x, y)| {
            let peak = Pixel::new(*x as f64, *y as f64);
            let meeting = subpixel::meeting_point(image, peak, HALF_WINDOW_PX);
            ((meeting - peak).amax() <= MAX_OFFSET_PX).then(|| crossing(&blurred, meeting))?
        })
        .collect()
}

/// Minus the determinant of the second derivatives: positive where the grey values form a saddle.
fn saddle_strength(image: &Plane) -> Vec<f64> {
    let mut strength = vec![0.0; image.width * image.height];
    for y in 1..image.height - 1 {
        for x in 1..image.width - 1 {
            let here = 2.0 * image.at(x, y);
            let xx = image.at(x + 1, y) + image.at(x - 1, y) - here;
            let yy = image.at(x, y + 1) + image.at(x, y - 1) - here;
            let xy =
                (image.at(x + 1, y + 1) + image.at(x - 1, y - 1) - image.at(x + 1, y - 1) - image.at(x - 1, y + 1))
                    / 4.0;
            strength[y * image.width + x] = xy * xy - xx * yy;
        }
    }
    strength
}

/// The crossing at `at`, if the ring about it alternates four times, evenly enough.
fn crossing(blurred: &Plane, at: Pixel) -> Option<Saddle> {
    let angle = |sample: f64| sample * TAU / RING_SAMPLES as f64;
    let ring: [f64; RING_SAMPLES] = std::array::from_fn(|sample| {
        let (sin, cos) = angle(sample as f64).sin_cos();
        blurred.sample(at.x + RING_PX * cos, at.y + RING_PX * sin)
    });
    let (low, high) = ring.iter().fold((f64::MAX, f64::MIN), |(low, high), value| {
        (low.min(*value), high.max(*value))
    });
    let (contrast, middle) = (high - low, (high + low) / 2.0);
    let half = RING_SAMPLES / 2;
    let asymmetry = (0..half)
        .map(|sample| (ring[sample] - ring[sample + half]).abs())
        .sum::<f64>()
        / half as f64;
    if contrast < MIN_CONTRAST || asymmetry > MAX_ASYMMETRY * contrast {
        return None;
    }
    // Angle at which each edge is crossed, and whether from dark to bright.
    let crossings: Vec<(f64, bool)> = (0..RING_SAMPLES)
        .filter_map(|sample| {
            let (this, next) = (ring[sample] - middle, ring[(sample + 1) % RING_SAMPLES] - middle);
            ((this < 0.0) != (next < 0.0)).then(|| (angle(sample as f64 + this / (this - next)), this < 0.0))
        })
        .collect();
    let first = crossings.iter().position(|(_, rising)| *rising)?;
    let &[(a, _), (b, _), (c, _), (d, _)] = crossings.as_slice() else {
        return None;
    };
    let turned = [a, b, c, d, a + TAU, b + TAU, c + TAU, d + TAU];
    let edges: [f64; 4] = std::array::from_fn(|at| turned[first + at]);
    let straight = |from: usize| (edges[from + 2] - edges[from] - PI).abs() <= MAX_BEND_RAD;
    let wide = edges.windows(2).all(|pair| pair[1] - pair[0] >= MIN_SECTOR_RAD);
    (straight(0) && straight(1) && wide && edges[3] - edges[0] <= TAU - MIN_SECTOR_RAD).then(|| Saddle {
        at,
        axes: std::array::from_fn(|axis| (edges[axis] + edges[axis + 2] - PI) / 2.0),
        contrast,
    })
}
