//! `teach`: along a seam that the controller has never seen, and the taught seam into a file.

use super::cell::{CellArgs, TrialArgs};
use super::{Outcome, check_save, cycles_in, number_in, print_score};
use crate::seal::scenario::{Options, name_of};
use crate::teach::campaign;
use crate::teach::scenario::{LawName, TeachOptions};
use crate::teach::words;
use anyhow::ensure;
use clap::Args;
use std::path::PathBuf;

/// Options of `teach`.
#[derive(Args)]
pub struct TeachArgs {
    #[command(flatten)]
    cell: CellArgs,
    /// Speed along the seam, m/s (0.01 to 0.3)
    #[arg(long, value_name = "M_PER_S", default_value = "0.1", value_parser = number_in(0.01, 0.3))]
    speed: f64,
    /// How the tool is led
    #[arg(long, value_enum, default_value = "lead")]
    law: LawName,
    /// Time from one exposure to the next, ms (15 to 200, a multiple of 5); by default --latency-ms, and 100 with the paper's law
    #[arg(long, value_name = "MS", value_parser = cycles_in(15, 200))]
    vision_ms: Option<u8>,
    #[command(flatten)]
    trials: TrialArgs,
    /// Write what the first trial taught here, with the shape of its joint, TOML; `seal --taught FILE` plays it
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
}

impl TeachArgs {
    fn options(&self) -> anyhow::Result<TeachOptions> {
        let latency = self.cell.camera.latency_ms;
        let period = self.vision_ms.unwrap_or(self.law.vision_period().max(latency));
        Ok(TeachOptions {
            cell: self.cell.options(Options {
                speed: self.speed,
                vision_period: period,
                ..TeachOptions::default().cell
            })?,
            law: self.law,
        })
    }
}

/// `teach …`.
pub fn run(args: &TeachArgs) -> Outcome {
    let model = args.trials.model()?;
    let options = args.options()?;
    let Options {
        vision_period,
        vision_latency,
        ..
    } = options.cell;
    ensure!(
        vision_period >= vision_latency,
        "--vision-ms: {} is too short for one processor, must be at least --latency-ms, {}",
        5 * u32::from(vision_period),
        5 * u32::from(vision_latency)
    );
    let campaign = args.trials.campaign(options);
    check_save(args.save.as_deref())?;
    let result = campaign::run(&campaign, &model, args.trials.out.as_deref())?;
    let mut files = result.files;
    if let (Some(path), Some(taught)) = (&args.save, &result.taught) {
        let title = format!(
            "Taught by tesaki: {} path, at {} m/s, seed {}",
            name_of(&args.cell.path),
            args.speed,
            args.trials.seed
        );
        files.push(taught.write(path, &title)?);
    }
    let score = &result.score;
    print_score(score, &words::score_table(score), &files, args.trials.json)?;
    Ok(score.tally.all_succeeded() && (args.save.is_none() || result.taught.is_some()))
}
