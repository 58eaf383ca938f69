//! `latency`: how late the camera exposes, and how old a sighting is when it is used.

use super::{Outcome, cycles_in, number_in, print_json, print_text};
use crate::latency::{self, words};
use crate::model::Model;
use crate::seal::cell::longest_exposure_delay;
use crate::seal::scenario::{Options, SurfaceName};
use crate::target::node::On;
use anyhow::ensure;
use clap::Args;

/// Options of `latency`.
#[derive(Args)]
pub struct LatencyArgs {
    /// Time in the cell from the SYNC that triggers an exposure to its middle, ms (0 to 9.5): what is to be found
    #[arg(long, value_name = "MS", default_value = "0", value_parser = number_in(0.0, 9.5))]
    exposure_delay_ms: f64,
    /// Time in the cell from an exposure to its sighting on the bus, ms (5 to 50, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "20", value_parser = cycles_in(5, 50))]
    latency_ms: u8,
    /// Speed along the seam, m/s (0.1 to 0.3)
    #[arg(long, value_name = "M_PER_S", default_value = "0.3", value_parser = number_in(0.1, 0.3))]
    speed: f64,
    /// Slits of the seam sensor (1 or 2)
    #[arg(long, value_name = "N", default_value = "2", value_parser = clap::value_parser!(u8).range(1..=2))]
    slits: u8,
    /// How hard the camera's images are
    #[arg(long, value_enum, default_value = "moderate")]
    surface: SurfaceName,
    /// Where the controller runs: in this process, or as a Cortex-M image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
    /// Number of runs along the seam; run i draws from seed + i
    #[arg(long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    trials: u32,
    /// First seed
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Arm model: `k3s`, or a TOML file
    #[arg(long, value_name = "NAME_OR_FILE", default_value = "k3s")]
    robot: String,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// `latency …`.
pub fn run(args: &LatencyArgs) -> Outcome {
    let options = Options {
        on: args.on,
        speed: args.speed,
        slits: args.slits,
        surface: args.surface,
        vision_latency: args.latency_ms,
        exposure_delay: args.exposure_delay_ms * 1e-3,
        ..latency::cell()
    };
    check_exposure_delay(&options)?;
    let score = latency::run(&options, &Model::named(&args.robot)?, args.seed, args.trials as usize)?;
    if args.json {
        print_json(&score)?;
    } else {
        print_text(&words::score_table(&score));
    }
    Ok(score.passed)
}

/// An exposure that is not over before its image is read out is none.
pub fn check_exposure_delay(options: &Options) -> anyhow::Result<()> {
    let (delay_ms, longest_ms) = (options.exposure_delay * 1e3, longest_exposure_delay(options) * 1e3);
    ensure!(
        delay_ms <= longest_ms,
        "--exposure-delay-ms: {delay_ms} is past the read-out, must be at most {longest_ms:.1} with --latency-ms {}",
        5 * u32::from(options.vision_latency)
    );
    Ok(())
}
