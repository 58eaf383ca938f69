//! Windows that a net learns from: a line of a few pixels with a seam in one of its bands, or none, and with what images have of noise.

use firmware::vision::image::View;
use firmware::vision::net::{HEIGHT, ROWS, WIDTH, centres, differences};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// What a window may show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// The line steps to the right.
    Crank,
    /// The line is bent into a valley.
    Vee,
}

/// One window and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// d_1, d_2, d_3, px.
    pub inputs: [f32; 3],
    /// What is wanted of o_1 to o_4 and o_ID: 0 or 1.
    pub wanted: [f32; 5],
}

/// Side of the image that the window is cut from, px, and where it is cut.
const SIDE: usize = 64;
const AT: usize = 22;

/// Share of windows without a seam. With the paper's fifth the net raises an alarm in every eighth clean window (sealing.md).
const PLAIN: f64 = 0.6;
/// Of a lap joint's windows without a seam, the share that show a step to the other hand.
const OTHER_HAND: f64 = 0.25;
/// Line width, step and slope as in the spec's re-created training: px, px, px per row.
const WIDTH_PX: [f64; 2] = [5.0, 10.0];
const STEP_PX: [f64; 2] = [3.5, 8.0];
const SLOPE: [f64; 2] = [-0.35, 0.35];
/// Change of the slope at a valley's bottom, px per row: flanks of 15° seen at 45°, and tilts.
const KINK: [f64; 2] = [0.42, 0.66];
/// Bend of a sheet, px per row².
const BEND: [f64; 2] = [-0.004, 0.004];
/// Standard deviation of a row's centre, px, at most; share of pixels that are wrong, at most.
const JITTER_PX: f64 = 0.8;
const SALT: f64 = 0.02;

/// Draws `count` patterns.
pub fn draw(shape: Shape, count: usize, rng: &mut Pcg64) -> Vec<Pattern> {
    let mut patterns = Vec::with_capacity(count);
    while patterns.len() < count {
        let is_seam = rng.random::<f64>() >= PLAIN;
        let other_hand = !is_seam && shape == Shape::Crank && rng.random::<f64>() < OTHER_HAND;
        let band = rng.random_range(1..=4_usize);
        let shown = (is_seam || other_hand).then_some(band);
        if let Some(inputs) = window(shape, shown, if other_hand { -1.0 } else { 1.0 }, rng) {
            let mut wanted = [0.0; 5];
            if is_seam {
                wanted[band - 1] = 1.0;
                wanted[4] = 1.0;
            }
            patterns.push(Pattern { inputs, wanted });
        }
    }
    patterns
}

/// The net's inputs for a window with the seam, or what is like one, in `band` (2 to 5 as 1 to 4), or without; `hand` is that of the step.
fn window(shape: Shape, band: Option<usize>, hand: f64, rng: &mut Pcg64) -> Option<[f32; 3]> {
    let mut within = |[low, high]: [f64; 2]| low + (high - low) * rng.random::<f64>();
    let (width, slope, bend) = (within(WIDTH_PX), within(SLOPE), within(BEND));
    let (step, kink) = (hand * within(STEP_PX), within(KINK));
    let (jitter, salt) = (within([0.1, JITTER_PX]), within([0.0, SALT]));
    let middle = within([-2.0, 2.0]) + AT as f64 + 0.5 * WIDTH as f64;
    // The seam is in any row of its band.
    let seam = band.map(|band| (ROWS * band) as f64 + within([-0.5, ROWS as f64 - 0.5]));
    let mut pixels = vec![0_u8; SIDE * SIDE];
    for row in 0..HEIGHT {
        let from_middle = row as f64 - 0.5 * HEIGHT as f64;
        let mut x = middle + slope * from_middle + bend * from_middle * from_middle;
        if let Some(seam) = seam {
            x += match shape {
                Shape::Crank if (row as f64) < seam => -0.5 * step,
                Shape::Crank => 0.5 * step,
                Shape::Vee => 0.5 * kink * -(row as f64 - seam).abs(),
            };
        }
        x += jitter * rng.sample::<f64, _>(StandardNormal);
        for column in 0..WIDTH {
            let inside = ((AT + column) as f64 - x).abs() < 0.5 * width;
            let wrong = rng.random::<f64>() < salt;
            pixels[(AT + row) * SIDE + AT + column] = if inside != wrong { 200 } else { 10 };
        }
    }
    let view = View::new(&pixels, SIDE, SIDE).ok()?;
    centres(&view, AT, AT).map(|centres| differences(&centres))
}
