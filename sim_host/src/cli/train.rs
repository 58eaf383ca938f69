//! `train`: the weights of the neural seam finder, or of the net that finds a lap joint's edge, from a seed.

use super::{Outcome, check_out, print_json, seed};
use crate::progress;
use crate::report::chart::{Chart, Curve};
use crate::training::patterns::Shape;
use crate::training::rows::{self, examples};
use crate::training::{self, PASSES, PATTERNS, SEED, Trained};
use crate::whole_file;
use clap::{Args, ValueEnum};
use firmware::vision::exchange;
use firmware::vision::net::{self, Net};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Options of `train`.
#[derive(Args)]
pub struct TrainArgs {
    /// Which net
    #[arg(long, value_enum, default_value = "seam")]
    net: NetName,
    /// Seed of weights and of what is learnt from (0 to 2^64 - 1); 1 gives the committed weights
    #[arg(long, value_name = "N", default_value_t = SEED, value_parser = seed)]
    seed: u64,
    /// Write weights.rs and learning.svg here
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Exit 1 if the committed weights are others
    #[arg(long)]
    check: bool,
    /// One JSON value on stdout (this verb always answers in JSON)
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum NetName {
    /// The paper's: whether a seam is in a window, and in which band.
    Seam,
    /// The one that the sensor asks of each row whether it lies above a lap joint's edge; takes minutes.
    Rows,
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
    /// The committed weights are these.
    committed: bool,
}

/// The same of the net of rows, whose examples are whole edges.
#[derive(Serialize)]
struct LearntRows {
    examples: usize,
    passes: usize,
    /// Mean loss, first and last pass.
    loss_first: f32,
    loss_last: f32,
    /// The committed weights are these.
    committed: bool,
}

/// `train …`.
pub fn run(args: &TrainArgs) -> Outcome {
    check_out(args.out.as_deref(), "weights.rs")?;
    match args.net {
        NetName::Seam => train_seam(args),
        NetName::Rows => train_rows(args),
    }
}

fn train_seam(args: &TrainArgs) -> Outcome {
    let [crank, vee] = [Shape::Crank, Shape::Vee].map(|shape| training::train(shape, args.seed));
    let learnt = |joint, shape, trained: &Trained, committed: &Net| {
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
            committed: trained.net == *committed,
        }
    };
    if let Some(dir) = &args.out {
        let source = training::source(&crank.net, &vee.net);
        let curves = vec![curve(&crank.curve, 0), curve(&vee.curve, 1)];
        write(
            dir,
            &source,
            "squared error per pattern: crank (blue), vee (orange)",
            (0.0, 0.5),
            curves,
        )?;
    }
    let learnt = [
        learnt("crank", Shape::Crank, &crank, &net::CRANK),
        learnt("vee", Shape::Vee, &vee, &net::VEE),
    ];
    print_json(&learnt)?;
    Ok(!args.check || learnt.iter().all(|learnt| learnt.committed))
}

fn train_rows(args: &TrainArgs) -> Outcome {
    let bar = progress::bar(examples::SCENES, "images");
    let examples = examples::draw(args.seed, &bar);
    bar.finish_and_clear();
    let bar = progress::bar((rows::PASSES * examples.len()) as u64, "examples learnt from");
    let trained = rows::train(&examples, args.seed, &bar);
    bar.finish_and_clear();
    if let Some(dir) = &args.out {
        let curves = vec![curve(&trained.curve, 0)];
        write(dir, &rows::source(&trained.net), "loss per image", (0.0, 0.2), curves)?;
    }
    let committed = trained.net == exchange::LAP;
    print_json(&LearntRows {
        examples: examples.len(),
        passes: rows::PASSES,
        loss_first: trained.curve[0],
        loss_last: trained.curve[rows::PASSES - 1],
        committed,
    })?;
    Ok(!args.check || committed)
}

fn curve(errors: &[f32], colour: usize) -> Curve {
    let points = errors.iter().enumerate();
    Curve::new(
        points.map(|(pass, error)| (pass as f64, f64::from(*error))).collect(),
        colour,
    )
}

fn write(dir: &Path, source: &str, y: &str, y_least: (f64, f64), curves: Vec<Curve>) -> anyhow::Result<()> {
    whole_file::write(&dir.join("weights.rs"), source.as_bytes())?;
    let chart = Chart {
        size: (720, 300),
        x: "passes",
        y: y.into(),
        y_least: Some(y_least),
        curves,
        allowed: None,
        marks: Vec::new(),
    };
    whole_file::write(&dir.join("learning.svg"), chart.svg()?.as_bytes())?;
    Ok(())
}
