//! `latency`: how late the camera exposes, and how old a sighting is when it is used.

use super::cell::{CameraArgs, TrialArgs};
use super::{Outcome, check_save, number_in, print_score};
use crate::calibration::sensor_file::SensorFile;
use crate::latency::{self, words};
use crate::seal::scenario::Options;
use crate::target::node::On;
use clap::Args;
use std::path::PathBuf;

/// Options of `latency`.
#[derive(Args)]
pub struct LatencyArgs {
    #[command(flatten)]
    camera: CameraArgs,
    /// Speed along the seam, m/s (0.1 to 0.3)
    #[arg(long, value_name = "M_PER_S", default_value = "0.3", value_parser = number_in(0.1, 0.3))]
    speed: f64,
    /// Where the controller runs: in this process, or as a Cortex-M image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
    /// Write the calibration here with the delay that was measured: `seal --calibration FILE` takes both
    #[arg(long, value_name = "FILE", requires = "calibration")]
    save: Option<PathBuf>,
    #[command(flatten)]
    trials: TrialArgs,
}

/// `latency …`.
pub fn run(args: &LatencyArgs) -> Outcome {
    let options = args.camera.options(Options {
        on: args.on,
        speed: args.speed,
        ..latency::cell()
    })?;
    let TrialArgs { out, json, .. } = &args.trials;
    check_save(args.save.as_deref())?;
    let result = latency::run(&args.trials.campaign(options), &args.trials.model()?, out.as_deref())?;
    if let (Some(path), Some(calibration), true) = (&args.save, &args.camera.calibration, result.score.passed()) {
        let with_delay = SensorFile {
            exposure_delay_s: Some(1e-3 * result.score.exposure_delay_ms),
            ..SensorFile::load(calibration)?
        };
        eprintln!("{}", with_delay.save(path)?.display());
    }
    print_score(&result.score, &words::score_table(&result.score), &result.files, *json)?;
    Ok(result.score.passed())
}
