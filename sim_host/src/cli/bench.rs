//! `bench`: what the control cycle costs.

use super::{Outcome, print_json, print_text, seed, whole_in};
use crate::bench::{self, Bench, gate, words};
use crate::whole_file;
use anyhow::Context;
use clap::Args;
use std::fs;
use std::path::PathBuf;

/// Options of `bench`.
#[derive(Args)]
pub struct BenchArgs {
    /// Panels to seal in each configuration (1 to 1000)
    #[arg(long, value_name = "N", default_value = "3", value_parser = whole_in(1_u32, 1000))]
    trials: u32,
    /// Seed of the first panel (0 to 2^64 - 1)
    #[arg(long, value_name = "N", default_value = "1", value_parser = seed)]
    seed: u64,
    /// Write the table into this file, between `<!-- bench: begin -->` and `<!-- bench: end -->`
    #[arg(long, value_name = "README", conflicts_with = "check")]
    update_readme: Option<PathBuf>,
    /// Fail if a figure is more than 5 % over the one in this file's table
    #[arg(long, value_name = "README")]
    check: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// `bench …`.
pub fn run(args: &BenchArgs) -> Outcome {
    let read = |path: &PathBuf| fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()));
    let readme = args.update_readme.as_ref().map(read).transpose()?;
    let committed = match &args.check {
        Some(path) => words::committed(&read(path)?).with_context(|| path.display().to_string())?,
        None => Vec::new(),
    };
    let result = bench::run(&Bench {
        seed: args.seed,
        trials: args.trials,
    })?;
    if args.json {
        print_json(&result)?;
    } else {
        print_text(&words::report(&result))?;
    }
    if let (Some(path), Some(readme)) = (&args.update_readme, readme) {
        let text = words::replace(&readme, &words::block(&result)).with_context(|| path.display().to_string())?;
        whole_file::write(path, text.as_bytes())?;
    }
    let grown = gate::grown(&committed, &result.rows());
    for line in &grown {
        eprintln!("{line}");
    }
    Ok(grown.is_empty())
}
