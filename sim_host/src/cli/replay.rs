//! `replay`: a log's inputs through the core again, its stages and outputs compared bit for bit.

use super::{Outcome, print_json, print_text, whole_in};
use crate::log::{Log, replay};
use crate::progress;
use crate::target::core::Core;
use crate::target::node::On;
use anyhow::{Context, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use firmware::cycle::Params;
use hal::stage::Stage;
use hal::wire::Wire;
use serde::Serialize;
use std::path::PathBuf;

/// Options of `replay`.
#[derive(Args)]
pub struct ReplayArgs {
    /// Log of a run (.tlog), as `seal --out` writes it
    log: PathBuf,
    /// Where the core runs: in this process, or in an image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
    /// Flip the last bit of what comes out of this stage, to see that it is found
    #[arg(long, value_name = "STAGE", value_parser = PossibleValuesParser::new(Stage::ALL.map(Stage::name)))]
    flip: Option<String>,
    /// --flip does that in the first cycle from this one on in which the stage runs (0 to 100000000)
    #[arg(long, value_name = "CYCLE", default_value = "0", value_parser = whole_in(0_u64, 100_000_000), requires = "flip")]
    at: u64,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// The JSON of `replay`.
#[derive(Serialize)]
struct ReplayResult {
    log: String,
    on: On,
    cycles: u64,
    identical: bool,
    log_hash: String,
    replay_hash: String,
    difference: Option<String>,
}

/// `replay …`.
pub fn run(args: &ReplayArgs) -> Outcome {
    let log = Log::read(&args.log)?;
    let params = Params::read(&mut log.parameters.as_slice()).with_context(|| {
        format!(
            "{}: the parameters in the log are not those of this version",
            args.log.display()
        )
    })?;
    let named = |stage: &Stage| args.flip.as_deref() == Some(stage.name());
    let mut flip = Stage::ALL.into_iter().find(named);
    let mut core = Core::new(args.on, params)?;
    let bar = progress::bar(log.len() as u64, "cycles");
    let mut cycles = 0..;
    let report = replay(&log, |inputs| {
        bar.inc(1);
        let now = flip.filter(|_| cycles.next() >= Some(args.at));
        let answer = core.step(inputs, now)?;
        if answer.trail.marks().iter().any(|mark| Some(mark.stage) == now) {
            flip = None;
        }
        Ok(answer)
    });
    bar.finish_and_clear();
    let report = report?;
    if let (Some(stage), None) = (flip, &report.difference) {
        bail!(
            "--flip {}: the stage runs in no cycle from {} on",
            stage.name(),
            args.at
        );
    }
    let result = ReplayResult {
        log: args.log.display().to_string(),
        on: args.on,
        cycles: report.cycles,
        identical: report.difference.is_none(),
        log_hash: format!("{:016x}", report.recorded_hash),
        replay_hash: format!("{:016x}", report.replayed_hash),
        difference: report.difference.as_ref().map(ToString::to_string),
    };
    if args.json {
        print_json(&result)?;
    } else {
        match &result.difference {
            None => print_text(&format!(
                "identical: {} cycles, hash {}\n",
                result.cycles, result.log_hash
            ))?,
            Some(difference) => print_text(&format!("differs: {difference}\n"))?,
        }
    }
    Ok(result.identical)
}
