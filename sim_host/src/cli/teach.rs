//! `teach`: along a seam that the controller has never seen, and the taught seam into a file.

use super::{Outcome, cycles_in, number_in, print_json, print_text};
use crate::model::Model;
use crate::seal::scenario::{JointName, Options, PathName, SurfaceName, name_of};
use crate::target::node::On;
use crate::teach::campaign::{self, Campaign};
use crate::teach::scenario::{LawName, TeachOptions};
use crate::teach::words;
use anyhow::bail;
use clap::Args;
use std::path::PathBuf;

/// Options of `teach`.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct TeachArgs {
    /// Which seam; the controller is not told
    #[arg(long, value_enum, default_value = "panel")]
    path: PathName,
    /// Shape of the joint
    #[arg(long, value_enum, default_value = "crank")]
    joint: JointName,
    /// Speed along the seam, m/s (0.01 to 0.3)
    #[arg(long, value_name = "M_PER_S", default_value = "0.1", value_parser = number_in(0.01, 0.3))]
    speed: f64,
    /// How the tool is led
    #[arg(long, value_enum, default_value = "lead")]
    law: LawName,
    /// How hard the camera's images are
    #[arg(long, value_enum, default_value = "moderate")]
    surface: SurfaceName,
    /// Part misplaced by up to this along each axis, mm (0 to 20)
    #[arg(long, value_name = "MM", default_value = "10", value_parser = number_in(0.0, 20.0))]
    offset_mm: f64,
    /// Part turned by up to this about each axis, degrees (0 to 5)
    #[arg(long, value_name = "DEG", default_value = "3", value_parser = number_in(0.0, 5.0))]
    offset_deg: f64,
    /// Peak deformation of the part, to the side and in height, mm (0 to 5)
    #[arg(long, value_name = "MM", default_value = "2", value_parser = number_in(0.0, 5.0))]
    deform_mm: f64,
    /// Error along each axis with which the operator places the nozzle at the start, mm (0 to 3)
    #[arg(long, value_name = "MM", default_value = "0.1", value_parser = number_in(0.0, 3.0))]
    start_error_mm: f64,
    /// The same about each axis, degrees (0 to 2)
    #[arg(long, value_name = "DEG", default_value = "0.2", value_parser = number_in(0.0, 2.0))]
    start_error_deg: f64,
    /// Share of camera frames lost, percent (0 to 50)
    #[arg(long, value_name = "PERCENT", default_value = "5", value_parser = number_in(0.0, 50.0))]
    frame_loss: f64,
    /// How wrong the controller's servo model is, percent (0 to 30)
    #[arg(long, value_name = "PERCENT", default_value = "10", value_parser = number_in(0.0, 30.0))]
    model_error: f64,
    /// Time from one exposure to the next, ms (15 to 200, a multiple of 5); by default --latency-ms, and 100 with the paper's law
    #[arg(long, value_name = "MS", value_parser = cycles_in(15, 200))]
    vision_ms: Option<u8>,
    /// Time from an exposure to its sighting on the bus, ms (5 to 50, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "20", value_parser = cycles_in(5, 50))]
    latency_ms: u8,
    /// Error frames on the bus in every cycle (0 to 10)
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=10))]
    error_frames: u8,
    /// Where the controller runs: in this process, or as a Cortex-M image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
    /// Number of trials; trial i draws from seed + i
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    trials: u32,
    /// First seed
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Arm model: `k3s`, or a TOML file
    #[arg(long, value_name = "NAME_OR_FILE", default_value = "k3s")]
    robot: String,
    /// Write what the first trial taught here, TOML; `seal --taught FILE` plays it
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Write report, log and candump of the first trial here
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

impl TeachArgs {
    fn options(&self) -> TeachOptions {
        let period = self.law.vision_period().max(self.latency_ms);
        TeachOptions {
            cell: Options {
                on: self.on,
                path: self.path,
                joint: self.joint,
                speed: self.speed,
                surface: self.surface,
                offset: self.offset_mm * 1e-3,
                turn: self.offset_deg.to_radians(),
                deform: self.deform_mm * 1e-3,
                start_error: (self.start_error_mm * 1e-3, self.start_error_deg.to_radians()),
                frame_loss: self.frame_loss / 100.0,
                model_error: self.model_error / 100.0,
                vision_period: self.vision_ms.unwrap_or(period),
                vision_latency: self.latency_ms,
                error_frames: self.error_frames,
                ..TeachOptions::default().cell
            },
            law: self.law,
        }
    }
}

/// `teach …`.
pub fn run(args: &TeachArgs) -> Outcome {
    let model = Model::named(&args.robot)?;
    let options = args.options();
    if options.cell.vision_period < options.cell.vision_latency {
        bail!(
            "--vision-ms: {} is too short for one processor, must be at least --latency-ms, {}",
            5 * u32::from(options.cell.vision_period),
            5 * u32::from(options.cell.vision_latency)
        );
    }
    let campaign = Campaign {
        options,
        seed: args.seed,
        trials: args.trials as usize,
    };
    let result = campaign::run(&campaign, &model, args.out.as_deref())?;
    let mut files = result.files;
    if let (Some(path), Some(taught)) = (&args.save, &result.taught) {
        let title = format!(
            "Taught by tesaki: {} path, {} joint, at {} m/s, seed {}",
            name_of(&args.path),
            name_of(&args.joint),
            args.speed,
            args.seed
        );
        files.push(taught.write(path, &title)?);
    }
    if args.json {
        print_json(&result.score)?;
    } else {
        print_text(&words::score_table(&result.score));
        for file in &files {
            print_text(&format!("{}\n", file.display()));
        }
    }
    Ok(result.score.passed() && (args.save.is_none() || result.taught.is_some()))
}
