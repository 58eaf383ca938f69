//! `train`: the neural seam finder's weights, from a seed.

use super::{Outcome, check_out, print_json, seed};
use crate::report::chart::{Chart, Curve};
use crate::training::patterns::Shape;
use crate::training::{self, PASSES, PATTERNS, SEED, Trained};
use crate::whole_file;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Options of `train`.
#[derive(Args)]
pub struct TrainArgs {
    /// Seed of weights and patterns (0 to 2^64 - 1); 1 gives the committed weights
    #[arg(long, value_name = "N", default_value_t = SEED, value_parser = seed)]
    seed: u64,
    /// Write weights.rs and learning.svg here
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON value on stdout (this verb always answers in JSON)
    #[arg(long)]
    json: bool,
}

/// How well a net does on windows that it did not learn from.
#[derive(Serialize)]
struct Learnt {
    joint: &'static str,
    patterns: usize,
    passes: usize,
    /// Sum of squared errors per pattern, first and last pass.
    error_first: f32,
    error_last: f32,
    seen: f64,
    right_band: f64,
    false_alarms: f64,
}

/// `train …`.
pub fn run(args: &TrainArgs) -> Outcome {
    check_out(args.out.as_deref(), "weights.rs")?;
    let [crank, vee] = [Shape::Crank, Shape::Vee].map(|shape| training::train(shape, args.seed));
    let learnt = |joint, shape, trained: &Trained| {
        let [seen, right_band, false_alarms] = training::rates(&trained.net, shape, args.seed.wrapping_add(1));
        Learnt {
            joint,
            patterns: PATTERNS,
            passes: PASSES,
            error_first: trained.curve[0],
            error_last: trained.curve[PASSES - 1],
            seen,
            right_band,
            false_alarms,
        }
    };
    if let Some(dir) = &args.out {
        write(dir, &crank, &vee)?;
    }
    print_json(&[learnt("crank", Shape::Crank, &crank), learnt("vee", Shape::Vee, &vee)])?;
    Ok(true)
}

fn write(dir: &Path, crank: &Trained, vee: &Trained) -> anyhow::Result<()> {
    let source = training::source(&crank.net, &vee.net);
    whole_file::write(&dir.join("weights.rs"), source.as_bytes())?;
    let curve = |trained: &Trained, colour| {
        let points = trained.curve.iter().enumerate();
        Curve::new(
            points.map(|(pass, error)| (pass as f64, f64::from(*error))).collect(),
            colour,
        )
    };
    let chart = Chart {
        size: (720, 300),
        x: "passes over the patterns",
        y: "squared error per pattern: crank (blue), vee (orange)".into(),
        y_least: Some((0.0, 0.5)),
        curves: vec![curve(crank, 0), curve(vee, 1)],
        allowed: None,
        marks: Vec::new(),
    };
    whole_file::write(&dir.join("learning.svg"), chart.svg()?.as_bytes())?;
    Ok(())
}
