//! The neural seam finder (paper 003, chapter 2): a net of three layers that says of a small window whether a seam is in it, and where.
//!
//! A window of 20 × 15 px is cut into five bands of three rows. The columns of the line's centre in the bands give the net its three
//! inputs, which neither the line's place nor its inclination changes (2.2, 2.3); it answers with the band of the seam, and with
//! whether there is one. Windows follow the line down the image (2.4); a seam counts when two windows running, the second about what the first
//! found, say so. Equations (2.8), (2.9), (2.13) as corrected in the spec.
//!
//! A line that has left its window keeps the last band's centre, which the paper leaves open; a window is cut at half way between
//! its darkest and its brightest pixel, for the paper begins with binary images. The weights are made by `sim_host::training`.

mod weights;

use super::image::View;
use super::joint::Joint;

pub use weights::{CRANK, VEE};

/// Window width and height, px (a, b).
pub const WIDTH: usize = 20;
/// See [`WIDTH`].
pub const HEIGHT: usize = BANDS * ROWS;
/// Bands of a window, and rows of a band (f).
pub const BANDS: usize = 5;
/// See [`BANDS`].
pub const ROWS: usize = 3;
/// Neurons of the hidden layer. The paper has 5; 8 learn the noisy patterns better (sealing.md, chapter 2).
pub const HIDDEN: usize = 8;
/// Neurons of the output layer: four for the seam in bands 2 to 5, and o_ID, whether there is one.
pub const OUTPUTS: usize = 5;
/// Scale μ of the neurons' function (2.13).
pub const MU: f32 = 0.8;
/// A window with less contrast holds no line, grey levels.
const CONTRAST: u8 = 20;
/// Most windows tried in an image: those that follow a line down 450 rows, and a second look at every other.
const WINDOWS: usize = 56;

/// Weights: of each neuron its threshold h first, then those of its inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Net {
    /// Hidden layer (B).
    pub hidden: [[f32; 4]; HIDDEN],
    /// Output layer (C).
    pub output: [[f32; HIDDEN + 1]; OUTPUTS],
}

/// What the neurons say of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Activity {
    /// Hidden layer, y^B.
    pub hidden: [f32; HIDDEN],
    /// Outputs o_1 to o_4, then o_ID.
    pub output: [f32; OUTPUTS],
}

impl Net {
    /// The net's answer to d_1, d_2, d_3 (px).
    pub fn run(&self, inputs: &[f32; 3]) -> Activity {
        let mut activity = Activity::default();
        for (neuron, [threshold, weights @ ..]) in activity.hidden.iter_mut().zip(&self.hidden) {
            *neuron = fire(*threshold, weights, inputs);
        }
        let hidden = activity.hidden;
        for (neuron, [threshold, weights @ ..]) in activity.output.iter_mut().zip(&self.output) {
            *neuron = fire(*threshold, weights, &hidden);
        }
        activity
    }

    /// The line's centres in the bands of the window whose upper left pixel is `left`, `top`, px from there, and what the net says of them;
    /// `None` without a line.
    pub fn window(&self, view: &View, left: usize, top: usize, mirrored: bool) -> Option<([f32; BANDS], Activity)> {
        let centres = centres(view, left, top)?;
        let sign = if mirrored { -1.0 } else { 1.0 };
        Some((centres, self.run(&differences(&centres).map(|d| sign * d))))
    }

    /// The seam's pixel (x, y) in an image; `None` if no two windows running show one. `mirrored` turns left and right: a net that knows
    /// steps to one hand finds those to the other.
    pub fn seam(&self, view: &View, mirrored: bool) -> Option<(f32, f32)> {
        let (mut left, mut top) = (first_window(view)?, 0_usize);
        // Where to go on if the second window does not confirm the first.
        let mut resume = None;
        for _ in 0..WINDOWS {
            let Some((centres, Activity { output, .. })) = self.window(view, left, top, mirrored) else {
                // No line here: straight on.
                (left, top) = resume.take().unwrap_or((left, top + HEIGHT - ROWS));
                continue;
            };
            let [places @ .., is_seam] = output;
            let (band, _) =
                places.iter().enumerate().fold(
                    (0, f32::MIN),
                    |best, (index, &value)| {
                        if value > best.1 { (index + 1, value) } else { best }
                    },
                );
            let column = |band: usize| left as f32 + centres.get(band).copied().unwrap_or(0.0);
            // The middle row of the band.
            let row = top + ROWS * band + ROWS / 2;
            if is_seam > 0.5 && resume.is_some() {
                return Some((column(band), row as f32));
            }
            // (2.4): the last band becomes the next window's first, and the line its middle.
            let next = (beside(view, column(BANDS - 1)), top + HEIGHT - ROWS);
            (left, top) = if is_seam > 0.5 {
                resume = Some(next);
                (beside(view, column(band)), row.saturating_sub(HEIGHT / 2))
            } else {
                resume.take().unwrap_or(next)
            };
        }
        None
    }
}

/// The seam's pixel by the net for `joint`. A sheet's edge drops out of the window, and is looked for as if it were a lap joint's.
pub fn find(view: &View, joint: Joint) -> Option<(f32, f32)> {
    match joint {
        Joint::Crank { upper_left: left, .. } | Joint::Lip { sheet_left: left, .. } => CRANK.seam(view, !left),
        Joint::Vee { .. } => VEE.seam(view, false),
    }
}

/// Left side of the window whose middle is `column`.
fn beside(view: &View, column: f32) -> usize {
    ((column - 0.5 * WIDTH as f32).max(0.0) as usize).min(view.width().saturating_sub(WIDTH))
}

/// Left side of the first window: that about the brightest place in the top band (X_g − 10); `None` in a dark one.
pub fn first_window(view: &View) -> Option<usize> {
    // Squared, so that a line counts more than as much light spread evenly.
    let square = |&pixel: &u8| u32::from(pixel) * u32::from(pixel);
    let [upper, middle, lower] = core::array::from_fn::<_, ROWS, _>(|y| view.row(y));
    let light = || {
        let columns = upper.iter().zip(middle).zip(lower);
        columns.map(|((upper, middle), lower)| square(upper) + square(middle) + square(lower))
    };
    let mut sum: u32 = light().take(WIDTH).sum();
    let mut best = (sum, 0);
    for ((enters, leaves), left) in light().skip(WIDTH).zip(light()).zip(1..) {
        sum = sum + enters - leaves;
        if sum > best.0 {
            best = (sum, left);
        }
    }
    (best.0 > 0).then_some(best.1)
}

/// Columns l_1 to l_5 of the line's centre in the bands of a window, px from its left side; `None` without a line.
pub fn centres(view: &View, left: usize, top: usize) -> Option<[f32; BANDS]> {
    let rows = || (top..top + HEIGHT).map(|y| view.span(y, left, left + WIDTH));
    let (mut darkest, mut brightest) = (u8::MAX, 0);
    for &pixel in rows().flatten() {
        darkest = darkest.min(pixel);
        brightest = brightest.max(pixel);
    }
    if top + HEIGHT > view.height() || brightest < darkest.saturating_add(CONTRAST) {
        return None;
    }
    let threshold = darkest / 2 + brightest / 2;
    let mut rows = rows();
    let mut last = None;
    let mut centres = [0.0; BANDS];
    for centre in &mut centres {
        let (mut mass, mut moment) = (0_u32, 0_u32);
        for row in rows.by_ref().take(ROWS) {
            for (x, &pixel) in (0_u32..).zip(row) {
                let lit = u32::from(pixel > threshold);
                mass += lit;
                moment += lit * x;
            }
        }
        if mass > 0 {
            last = Some(moment as f32 / mass as f32);
        }
        *centre = last.unwrap_or(0.5 * (WIDTH as f32 - 1.0));
    }
    Some(centres)
}

/// d_1, d_2, d_3 (2.2), (2.3).
pub fn differences([l1, l2, l3, l4, l5]: &[f32; BANDS]) -> [f32; 3] {
    let first = l1 - l2;
    [l2 - l3 - first, l3 - l4 - first, l4 - l5 - first]
}

fn fire(threshold: f32, weights: &[f32], inputs: &[f32]) -> f32 {
    let sum = weights.iter().zip(inputs).fold(threshold, |sum, (w, y)| sum + w * y);
    // f(x) = 1 / (1 + exp(−x/μ)) (2.13, sign corrected).
    1.0 / (1.0 + exp(-sum * (1.0 / MU)))
}

/// e^x from + − × and the exponent's bits, the same on every processor; relative error below 4e-6. Beyond ±60 it stays.
fn exp(x: f32) -> f32 {
    const LOG2_E: f32 = core::f32::consts::LOG2_E;
    const LN_2: f32 = core::f32::consts::LN_2;
    let x = super::number::limit(x, -60.0, 60.0);
    let turns = x * LOG2_E;
    let whole = (turns + if turns < 0.0 { -0.5 } else { 0.5 }) as i32;
    let r = x - whole as f32 * LN_2;
    // Taylor's series to the sixth power; |r| ≤ 0.347.
    let series = [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let fraction = series.iter().fold(0.0, |sum, c| sum * r + c);
    fraction * f32::from_bits(((whole + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    #[test]
    fn the_exponential_agrees_with_the_standard_librarys() {
        for step in -6000..=6000 {
            let x = step as f32 * 0.01;
            assert!((exp(x) / x.exp() - 1.0).abs() < 4e-6, "{x}: {} for {}", exp(x), x.exp());
        }
    }

    #[test]
    fn a_step_gives_the_papers_differences_whatever_the_lines_slope() {
        for slope in [-1.0_f32, 0.0, 0.7] {
            let line = |band: usize, step: f32| -> [f32; BANDS] {
                core::array::from_fn(|k| 10.0 + slope * k as f32 - if k + 1 >= band { step } else { 0.0 })
            };
            let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(near(differences(&line(2, 5.0)), [-5.0; 3]));
            assert!(near(differences(&line(3, 5.0)), [5.0, 0.0, 0.0]));
            assert!(near(differences(&line(4, 5.0)), [0.0, 5.0, 0.0]));
            assert!(near(differences(&line(5, 5.0)), [0.0, 0.0, 5.0]));
        }
    }

    fn image(column: impl Fn(usize) -> f32) -> Vec<u8> {
        let mut pixels = std::vec![10; 250 * 250];
        for (y, row) in pixels.chunks_exact_mut(250).enumerate() {
            let x = column(y) as usize;
            row[x - 3..=x + 3].fill(120);
        }
        pixels
    }

    #[test]
    fn a_clean_step_is_found_within_its_band_to_either_hand_and_a_plain_line_shows_none() {
        for (seam, mirrored) in [(100, false), (131, true), (172, false)] {
            let step = if mirrored { -5.5 } else { 5.5 };
            let pixels = image(|y| 110.0 + 0.1 * y as f32 + if y < seam { 0.0 } else { step });
            let view = View::new(&pixels, 250, 250).unwrap();
            let (_, y) = CRANK.seam(&view, mirrored).unwrap();
            assert!((y - seam as f32).abs() <= 4.0, "row {y} for {seam}");
            assert_eq!(CRANK.seam(&view, !mirrored), None, "to the other hand");
        }
        let plain = image(|y| 110.0 + 0.1 * y as f32);
        assert_eq!(CRANK.seam(&View::new(&plain, 250, 250).unwrap(), false), None);
    }
}
