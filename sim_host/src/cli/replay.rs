//! `replay`: a log's inputs through the core again, outputs compared bit for bit.

use super::{Outcome, print_json, print_text};
use crate::log::{Log, replay};
use crate::progress;
use anyhow::Context;
use clap::Args;
use firmware::cycle::{Params, State, step};
use hal::wire::Wire;
use serde::Serialize;
use std::path::PathBuf;

/// Options of `replay`.
#[derive(Args)]
pub struct ReplayArgs {
    /// Log of a run (.tlog), as `seal --out` writes it
    log: PathBuf,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// The JSON of `replay`.
#[derive(Serialize)]
struct ReplayResult {
    log: String,
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
    let mut state = State::new(&params);
    let bar = progress::bar(log.len() as u64, "cycles");
    let report = replay(&log, |inputs| {
        bar.inc(1);
        step(&params, &mut state, inputs)
    });
    bar.finish_and_clear();
    let result = ReplayResult {
        log: args.log.display().to_string(),
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
            )),
            Some(difference) => print_text(&format!("differs: {difference}\n")),
        }
    }
    Ok(result.identical)
}
