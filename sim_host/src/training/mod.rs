//! Training of the neural seam finder by back-propagation (paper 003, 2.13–2.16, signs as corrected in the spec).
//!
//! On line, pattern by pattern, in f32 with the core's own functions: so a seed gives the same weights, bit for bit, on every machine.
//! `tesaki train` writes the weights as the core's source and the learning curve as SVG; a test trains again and compares.

pub mod patterns;
pub mod rows;

use firmware::vision::net::{HIDDEN, MU, Net, OUTPUTS};
use patterns::{Pattern, Shape};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::fmt::Write;

/// Learning rates of weights and thresholds at the first pass (η); the paper's 0.2. They fall in proportion to the passes left, so
/// that the noise of single patterns does not stay in the weights.
const RATE: f32 = 0.2;
/// Seed of the committed weights.
pub const SEED: u64 = 1;
/// Patterns, and passes over them. The paper has about 82 and 1500: of so few it learns the windows with a seam and takes one in eight
/// of those without for one.
pub const PATTERNS: usize = 2000;
/// See [`PATTERNS`].
pub const PASSES: usize = 300;

/// A net and how it came to be.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The net.
    pub net: Net,
    /// Sum of the squared errors per pattern, by pass.
    pub curve: Vec<f32>,
}

/// Trains a net for `shape`.
pub fn train(shape: Shape, seed: u64) -> Trained {
    let mut rng = Pcg64::new(u128::from(seed), shape as u128);
    let mut start = || 2.0 * rng.random::<f32>() - 1.0;
    let mut net = Net {
        hidden: [[0.0; 4]; HIDDEN],
        output: [[0.0; HIDDEN + 1]; OUTPUTS],
    };
    net.hidden.iter_mut().flatten().for_each(|weight| *weight = start());
    net.output.iter_mut().flatten().for_each(|weight| *weight = start());
    let patterns = patterns::draw(shape, PATTERNS, &mut rng);
    let curve = (0..PASSES)
        .map(|pass| {
            let rate = RATE * (PASSES - pass) as f32 / PASSES as f32;
            let sum: f32 = patterns.iter().map(|pattern| learn(&mut net, pattern, rate)).sum();
            sum / PATTERNS as f32
        })
        .collect();
    Trained { net, curve }
}

/// One step down the error of one pattern; its squared error before.
fn learn(net: &mut Net, pattern: &Pattern, rate: f32) -> f32 {
    let activity = net.run(&pattern.inputs);
    let mut error = 0.0;
    let mut back = [0.0_f32; HIDDEN];
    for ((weights, output), wanted) in net.output.iter_mut().zip(activity.output).zip(pattern.wanted) {
        let miss = wanted - output;
        error += miss * miss;
        // (2.14): δ = (v − o)·f′, and f′ = o(1 − o)/μ.
        let delta = miss * output * (1.0 - output) / MU;
        let [threshold, weights @ ..] = weights;
        *threshold += rate * delta;
        for ((weight, hidden), back) in weights.iter_mut().zip(activity.hidden).zip(&mut back) {
            *back += delta * *weight;
            *weight += rate * delta * hidden;
        }
    }
    for ((weights, hidden), back) in net.hidden.iter_mut().zip(activity.hidden).zip(back) {
        let delta = back * hidden * (1.0 - hidden) / MU;
        let [threshold, weights @ ..] = weights;
        *threshold += rate * delta;
        for (weight, input) in weights.iter_mut().zip(pattern.inputs) {
            *weight += rate * delta * input;
        }
    }
    error
}

/// Of windows that were not learnt from: shares in which a seam is seen where there is one, is put into the right band, and is seen
/// where there is none.
pub fn rates(net: &Net, shape: Shape, seed: u64) -> [f64; 3] {
    let mut rng = Pcg64::new(u128::from(seed), 0x7465_7374);
    let patterns = patterns::draw(shape, 4000, &mut rng);
    let (mut seams, mut seen, mut right, mut alarms) = (0.0, 0.0, 0.0, 0.0);
    for pattern in &patterns {
        let [places @ .., is_seam] = net.run(&pattern.inputs).output;
        let says = f64::from(u8::from(is_seam > 0.5));
        if pattern.wanted[4] > 0.5 {
            let most = places.iter().fold(f32::MIN, |most, place| most.max(*place));
            let at_most = |(place, wanted): (&f32, &f32)| *place == most && *wanted > 0.5;
            seams += 1.0;
            seen += says;
            right += f64::from(u8::from(places.iter().zip(&pattern.wanted).any(at_most)));
        } else {
            alarms += says;
        }
    }
    [seen / seams, right / seams, alarms / (patterns.len() as f64 - seams)]
}

/// The nets as the core's source, `firmware/src/vision/net/weights.rs`.
pub fn source(crank: &Net, vee: &Net) -> String {
    let mut text = String::from("//! Weights of the net, made by `tesaki train`: do not edit.\n\nuse super::Net;\n");
    for (name, of, net) in [
        (
            "CRANK",
            "lap joints whose line steps to the right, down the image",
            crank,
        ),
        ("VEE", "bends", vee),
    ] {
        // Writing to a string does not fail.
        let _ = write!(
            text,
            "\n/// For {of}.\n#[rustfmt::skip]\npub const {name}: Net = Net {{\n    hidden: [\n"
        );
        for row in &net.hidden {
            let _ = writeln!(text, "        {},", row_of(row));
        }
        text.push_str("    ],\n    output: [\n");
        for row in &net.output {
            let _ = writeln!(text, "        {},", row_of(row));
        }
        text.push_str("    ],\n};\n");
    }
    text
}

/// Numbers in the shortest form that reads back as the same, with digits in groups as clippy wants them: none at all, in
/// scientific notation.
fn row_of(row: &[f32]) -> String {
    let numbers: Vec<String> = row.iter().map(|weight| format!("{weight:e}")).collect();
    format!("[{}]", numbers.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::vision::net;

    #[test]
    fn training_again_gives_the_committed_weights_bit_for_bit() {
        let [crank, vee] = [Shape::Crank, Shape::Vee].map(|shape| train(shape, SEED));
        assert_eq!((crank.net, vee.net), (net::CRANK, net::VEE));
        let committed = include_str!("../../../firmware/src/vision/net/weights.rs");
        assert!(source(&crank.net, &vee.net) == committed, "weights.rs was edited");
        assert!(crank.curve[PASSES - 1] < 0.5 * crank.curve[0], "{:?}", crank.curve);
    }

    #[test]
    fn enough_windows_without_a_seam_cure_the_false_alarms() {
        // The spec's net of 82 patterns: 12 % of clean windows, 44 % of noisy ones.
        let [seen, right, alarms] = rates(&net::CRANK, Shape::Crank, 77);
        assert!(seen > 0.85 && right > 0.75, "{seen} seen, {right} in the right band");
        assert!(alarms < 0.08, "{alarms} false alarms");
    }
}
