//! Training of the net that says of each row whether it lies above a lap joint's edge (`firmware::vision::exchange`).
//!
//! What is learnt from is the edge's likelihood over all rows together, not each row's answer: so the net learns how much rows that are deceived
//! by the same glint may say together. Adam (Kingma and Ba, 2015) in f32, on batches that are summed in the same order however many threads there
//! are: so a seed gives the same weights, bit for bit, on every machine that renders the same images.

pub mod examples;

use super::row_of;
use examples::Example;
use firmware::vision::edge::ROWS;
use firmware::vision::exchange::{Activity, JOINING, PAIRS, PIXELS, RowNet, SEEING, TAPS, likelihood};
use indicatif::ProgressBar;
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use std::fmt::Write;

/// Passes over the examples.
pub const PASSES: usize = 30;
/// Examples from one step of the weights to the next, and of these to a sum of their own.
const BATCH: usize = 256;
const PART: usize = 32;
/// Step of a weight at first, and what fades of the mean gradient and of its mean square; the step falls to nothing with the passes left.
const RATE: f32 = 3e-3;
const FADE: [f32; 2] = [0.9, 0.999];
/// No division by none.
const LEAST: f32 = 1e-8;
/// The edge is right within this, rows: 0.5 mm …
const RIGHT: f32 = 4.2;
/// … and exactly with this standard deviation, rows, which counts this much besides.
const EXACT: f32 = 0.8;
const EXACT_SHARE: f32 = 0.3;
/// Minus log of what a place counts that is wrong, and of one that is far from exact.
const WRONG: f32 = 30.0;
const INEXACT: f32 = 12.0;
/// Standard deviations of the weights at first.
const START: [f32; 3] = [0.2, 0.13, 0.1];
/// Number of weights.
const WEIGHTS: usize = SEEING * (1 + PIXELS + PAIRS + 2) + JOINING * (1 + TAPS.len() * SEEING) + 1 + JOINING + SEEING;

/// A net and how it came to be.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The net.
    pub net: RowNet,
    /// Mean loss by pass.
    pub curve: Vec<f32>,
}

/// Trains a net on `examples`; `bar` goes on by one for each of them in each pass.
pub fn train(examples: &[Example], seed: u64, bar: &ProgressBar) -> Trained {
    let mut rng = Pcg64::new(u128::from(seed), 0x726f_7773);
    let mut net = start(&mut rng);
    let mut order: Vec<usize> = (0..examples.len()).collect();
    let (mut mean, mut square) = (vec![0.0_f32; WEIGHTS], vec![0.0_f32; WEIGHTS]);
    let mut curve = Vec::with_capacity(PASSES);
    let steps = PASSES * examples.len().div_ceil(BATCH);
    let mut step = 0;
    let mut faded = [1.0_f32; 2];
    for _ in 0..PASSES {
        order.shuffle(&mut rng);
        let mut sum = 0.0_f64;
        for batch in order.chunks(BATCH) {
            let parts: Vec<Gradient> = batch
                .par_chunks(PART)
                .map(|part| {
                    let mut gradient = Gradient::none();
                    part.iter().for_each(|&at| gradient.add(&net, &examples[at]));
                    gradient
                })
                .collect();
            let mut whole = Gradient::none();
            parts.into_iter().for_each(|part| whole.join(part));
            sum += f64::from(whole.loss);
            let rate = RATE * (steps - step) as f32 / steps as f32;
            step += 1;
            for (faded, fade) in faded.iter_mut().zip(FADE) {
                *faded *= fade;
            }
            let slopes = flat(&mut whole.by).map(|slope| *slope / batch.len() as f32);
            for (((weight, slope), mean), square) in flat(&mut net).zip(slopes).zip(&mut mean).zip(&mut square) {
                *mean += (1.0 - FADE[0]) * (slope - *mean);
                *square += (1.0 - FADE[1]) * (slope * slope - *square);
                let spread = (*square / (1.0 - faded[1])).sqrt() + LEAST;
                *weight -= rate * (*mean / (1.0 - faded[0])) / spread;
            }
            bar.inc(batch.len() as u64);
        }
        curve.push((sum / examples.len() as f64) as f32);
    }
    Trained { net, curve }
}

fn start(rng: &mut Pcg64) -> RowNet {
    let mut net = nothing();
    let mut draw = |size: f32| size * rng.sample::<f32, _>(StandardNormal);
    inputs(&mut net).for_each(|weights| weights.iter_mut().for_each(|weight| *weight = draw(START[0])));
    net.taps
        .iter_mut()
        .flatten()
        .flatten()
        .for_each(|weight| *weight = draw(START[1]));
    net.output.iter_mut().for_each(|weight| *weight = draw(START[2]));
    net
}

fn nothing() -> RowNet {
    RowNet {
        seen: [0.0; SEEING],
        light: [[0.0; SEEING]; PIXELS],
        glare: [[0.0; SEEING]; PAIRS],
        place: [[0.0; SEEING]; 2],
        joined: [0.0; JOINING],
        taps: [[[0.0; JOINING]; SEEING]; TAPS.len()],
        bias: 0.0,
        output: [0.0; JOINING],
        direct: [0.0; SEEING],
    }
}

/// Weights of the neurons that see, by what they see.
fn inputs(net: &mut RowNet) -> impl Iterator<Item = &mut [f32; SEEING]> {
    net.light.iter_mut().chain(&mut net.glare).chain(&mut net.place)
}

/// All weights, always in the same order.
fn flat(net: &mut RowNet) -> impl Iterator<Item = &mut f32> {
    let RowNet {
        seen,
        light,
        glare,
        place,
        joined,
        taps,
        bias,
        output,
        direct,
    } = net;
    let inputs = light.iter_mut().chain(glare).chain(place);
    let seeing = seen.iter_mut().chain(inputs.flatten());
    let joining = joined.iter_mut().chain(taps.iter_mut().flatten().flatten());
    let saying = std::iter::once(bias).chain(output.iter_mut()).chain(direct.iter_mut());
    seeing.chain(joining).chain(saying)
}

/// Loss and its slope by each weight, summed over examples.
struct Gradient {
    loss: f32,
    by: RowNet,
}

impl Gradient {
    fn none() -> Self {
        Self {
            loss: 0.0,
            by: nothing(),
        }
    }

    fn join(&mut self, mut part: Self) {
        self.loss += part.loss;
        for (sum, slope) in flat(&mut self.by).zip(flat(&mut part.by)) {
            *sum += *slope;
        }
    }

    fn add(&mut self, net: &RowNet, example: &Example) {
        let activity = net.run(example.rows.iter().copied());
        let (loss, by_say) = loss(&activity.says, example.edge);
        self.loss += loss;
        let Activity { seen, joined, .. } = &activity;
        let mut by_seen = [[0.0_f32; SEEING]; ROWS];
        for (row, &by_say) in by_say.iter().enumerate() {
            self.by.bias += by_say;
            for neuron in 0..SEEING {
                self.by.direct[neuron] += by_say * seen[row][neuron];
                by_seen[row][neuron] += by_say * net.direct[neuron];
            }
            let mut by_joined = [0.0_f32; JOINING];
            for neuron in 0..JOINING {
                self.by.output[neuron] += by_say * joined[row][neuron];
                by_joined[neuron] = by_say * net.output[neuron] * f32::from(u8::from(joined[row][neuron] > 0.0));
                self.by.joined[neuron] += by_joined[neuron];
            }
            for (tap, &away) in TAPS.iter().enumerate() {
                let Some(other) = row.checked_add_signed(away).filter(|other| *other < ROWS) else {
                    continue;
                };
                for neuron in 0..SEEING {
                    let weights = &net.taps[tap][neuron];
                    let slopes = &mut self.by.taps[tap][neuron];
                    let mut back = 0.0;
                    for ((slope, weight), by) in slopes.iter_mut().zip(weights).zip(&by_joined) {
                        *slope += by * seen[other][neuron];
                        back += by * weight;
                    }
                    by_seen[other][neuron] += back;
                }
            }
        }
        for (row, by) in by_seen.iter_mut().enumerate() {
            for ((by, seen), sum) in by.iter_mut().zip(&seen[row]).zip(&mut self.by.seen) {
                if *seen <= 0.0 {
                    *by = 0.0;
                }
                *sum += *by;
            }
            let row = &example.rows[row];
            for (shown, slopes) in row.inputs().zip(inputs(&mut self.by)) {
                if shown != 0.0 {
                    for (slope, by) in slopes.iter_mut().zip(&*by) {
                        *slope += shown * by;
                    }
                }
            }
        }
    }
}

/// Minus the logarithm of the likelihood that is within [`RIGHT`] of the true `edge` (rows from the first), and in part of that which is exactly there; and its
/// slope by what each row says.
fn loss(says: &[f32; ROWS], edge: f32) -> (f32, [f32; ROWS]) {
    let logits = likelihood(says);
    let away = |at: usize| at as f32 - edge;
    let all = weighted(&logits, |_| 0.0);
    let right = weighted(&logits, |at| if away(at).abs() <= RIGHT { 0.0 } else { -WRONG });
    let exact = weighted(&logits, |at| (-0.5 * (away(at) / EXACT).powi(2)).max(-INEXACT));
    let loss = (all.1 - right.1) + EXACT_SHARE * (all.1 - exact.1);
    let mut slopes = [0.0; ROWS];
    // A row counts for all edges after it.
    let mut sum = 0.0;
    for (row, slope) in slopes.iter_mut().enumerate().rev() {
        let by = |shares: &[f32; ROWS + 1]| all.0[row + 1] - shares[row + 1];
        sum += by(&right.0) + EXACT_SHARE * by(&exact.0);
        *slope = sum;
    }
    (loss, slopes)
}

/// Shares of the likelihood, each place counted by its weight (log), and the logarithm of their sum.
fn weighted(logits: &[f32; ROWS + 1], weight: impl Fn(usize) -> f32) -> ([f32; ROWS + 1], f32) {
    let mut shares: [f32; ROWS + 1] = std::array::from_fn(|at| logits[at] + weight(at));
    let most = shares.iter().copied().fold(f32::MIN, f32::max);
    let mut sum = 0.0;
    for share in &mut shares {
        *share = libm::expf(*share - most);
        sum += *share;
    }
    (shares.map(|share| share / sum), most + libm::logf(sum))
}

/// The net as the core's source, `firmware/src/vision/exchange/weights.rs`.
pub fn source(net: &RowNet) -> String {
    let mut text = String::from(
        "//! Weights of the net, made by `tesaki train --net rows`: do not edit.\n\nuse super::RowNet;\n\n/// For lap joints.\n\
         #[rustfmt::skip]\npub const LAP: RowNet = RowNet {\n",
    );
    let tap = |tap: &[[f32; JOINING]; SEEING]| format!("[{}]", tap.each_ref().map(|row| row_of(row)).join(", "));
    let by_input = |weights: &[[f32; SEEING]]| weights.iter().map(|row| row_of(row)).collect();
    let layers: [(&str, Vec<String>); 4] = [
        ("light", by_input(&net.light)),
        ("glare", by_input(&net.glare)),
        ("place", by_input(&net.place)),
        ("taps", net.taps.iter().map(tap).collect()),
    ];
    for (name, rows) in layers {
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {name}: [\n        {},\n    ],", rows.join(",\n        "));
    }
    let rows = [
        ("seen", row_of(&net.seen)),
        ("joined", row_of(&net.joined)),
        ("output", row_of(&net.output)),
        ("direct", row_of(&net.direct)),
    ];
    for (name, row) in rows {
        let _ = writeln!(text, "    {name}: {row},");
    }
    let _ = write!(text, "    bias: {:e},\n}};\n", net.bias);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_by_each_weight_is_that_of_the_loss() {
        let mut rng = Pcg64::new(3, 4);
        let mut net = start(&mut rng);
        let bar = ProgressBar::hidden();
        let [example, ..] = &examples::draw_some(5, [1, 0], &bar)[..] else {
            panic!("no example");
        };
        let mut gradient = Gradient::none();
        gradient.add(&net, example);
        let slopes: Vec<f32> = flat(&mut gradient.by).map(|slope| *slope).collect();
        assert_eq!(slopes.len(), WEIGHTS);
        let loss = |net: &RowNet| loss(&net.run(example.rows.iter().copied()).says, example.edge).0;
        for at in (0..WEIGHTS).step_by(7) {
            const STEP: f32 = 2e-3;
            let mut at_step = |by: f32| {
                if let Some(weight) = flat(&mut net).nth(at) {
                    *weight += by;
                }
                loss(&net)
            };
            let (up, down) = (at_step(STEP), at_step(-2.0 * STEP));
            at_step(STEP);
            let expected = (up - down) / (2.0 * STEP);
            assert!(
                (slopes[at] - expected).abs() < 0.02 * expected.abs() + 0.02,
                "weight {at}: {} for {expected}",
                slopes[at]
            );
        }
    }
}
