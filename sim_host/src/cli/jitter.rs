//! `jitter`: how evenly the control cycle comes, and what it takes.

use super::{Outcome, check_out, print_files, print_json, print_text, seed, whole_in};
use crate::jitter::{self, Load, Measurement, files, words};
use crate::model::Model;
use crate::target::node::On;
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;

/// Options of `jitter`.
#[derive(Args)]
pub struct JitterArgs {
    /// Where the cycle runs: in real time on this machine, or as a Cortex-M image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
    /// Cycles of 5 ms to measure (10 to 100000000)
    #[arg(long, value_name = "N", default_value = "4000", value_parser = whole_in(10_u64, 100_000_000))]
    cycles: u64,
    /// What else runs, at every priority below the cycle's
    #[arg(long, value_enum, default_value = "none")]
    load: Load,
    /// Break something again and again, drawn from this seed (0 to 2^64 - 1), and account for every stop; only with --on qemu
    #[arg(long, value_name = "SEED", value_parser = seed)]
    faults: Option<u64>,
    /// Seed of the cell (0 to 2^64 - 1)
    #[arg(long, value_name = "N", default_value = "1", value_parser = seed)]
    seed: u64,
    /// Write text, JSON, CSV and SVG here
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// `jitter …`.
pub fn run(args: &JitterArgs) -> Outcome {
    if args.faults.is_some() && args.on == On::Host {
        bail!(
            "--faults: on host the cycle runs in real time on a recorded job, in which nothing can be broken; must be with --on qemu"
        );
    }
    let measurement = Measurement {
        on: args.on,
        cycles: args.cycles,
        load: args.load,
        seed: args.seed,
        faults: args.faults,
    };
    check_out(args.out.as_deref(), "jitter.txt")?;
    let figures = jitter::run(&measurement, &Model::k3s())?;
    let files = match &args.out {
        Some(folder) => files::write(&figures, folder)?,
        None => Vec::new(),
    };
    if args.json {
        print_json(&figures)?;
    } else {
        print_text(&words::text(&figures))?;
        print_files(&files)?;
    }
    Ok(figures.passed())
}
