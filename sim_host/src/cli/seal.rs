//! `seal`: a sealing job, or a campaign of them.

use super::{Outcome, cycles_in, number_in, print_json, print_text};
use crate::model::Model;
use crate::seal::campaign::{self, Campaign};
use crate::seal::scenario::{DriveMode, HoldName, JointName, Options, PathName, StartName, SurfaceName};
use crate::seal::{ablation, words};
use crate::target::node::On;
use crate::taught::TaughtSeam;
use clap::Args;
use firmware::job::survey::SECTIONS;
use std::path::{Path, PathBuf};

/// Options of `seal`.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct SealArgs {
    /// Which seam
    #[arg(long, value_enum, default_value = "panel")]
    path: PathName,
    /// Shape of the joint
    #[arg(long, value_enum, default_value = "crank")]
    joint: JointName,
    /// Speed along the seam, m/s (0.02 to 0.5)
    #[arg(long, value_name = "M_PER_S", default_value = "0.3", value_parser = number_in(0.02, 0.5))]
    speed: f64,
    /// How the nozzle is led from one correction to the next
    #[arg(long, value_enum, default_value = "smooth")]
    hold: HoldName,
    /// Slits of the seam sensor (1 or 2)
    #[arg(long, value_name = "N", default_value = "2", value_parser = clap::value_parser!(u8).range(1..=2))]
    slits: u8,
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
    /// Where the start pose comes from: measured by the sensor first, or told with an error
    #[arg(long, value_enum, default_value = "given")]
    start: StartName,
    /// Places along the seam that are looked at once the start is measured: 0 (none, as in the paper) or 2 to 12
    #[arg(long, value_name = "N", default_value = "8", value_parser = survey)]
    survey: u8,
    /// Error of the given start pose per axis, mm (0 to 2)
    #[arg(long, value_name = "MM", default_value = "0.1", value_parser = number_in(0.0, 2.0))]
    start_error_mm: f64,
    /// Error of the given start pose about each axis, degrees (0 to 1)
    #[arg(long, value_name = "DEG", default_value = "0.2", value_parser = number_in(0.0, 1.0))]
    start_error_deg: f64,
    /// Share of camera frames lost, percent (0 to 50)
    #[arg(long, value_name = "PERCENT", default_value = "5", value_parser = number_in(0.0, 50.0))]
    frame_loss: f64,
    /// Times that the camera takes a lost image again by itself, 10 ms later (0 to 3)
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=3))]
    retakes: u8,
    /// How wrong the controller's servo model is, percent (0 to 30)
    #[arg(long, value_name = "PERCENT", default_value = "10", value_parser = number_in(0.0, 30.0))]
    model_error: f64,
    /// Drive mode: velocity with the drive's own speed loop, or torque as in the paper
    #[arg(long, value_enum, default_value = "csv")]
    mode: DriveMode,
    /// Servo without feed-forward
    #[arg(long)]
    no_feed_forward: bool,
    /// Play the taught path without the sensor's corrections
    #[arg(long)]
    no_preview: bool,
    /// Time from one burst of exposures to the next, ms (20 to 200, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "100", value_parser = cycles_in(20, 200))]
    vision_ms: u8,
    /// Time from an exposure to its sighting on the bus, ms (5 to 50, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "20", value_parser = cycles_in(5, 50))]
    latency_ms: u8,
    /// Error frames on the bus in every cycle (0 to 10)
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=10))]
    error_frames: u8,
    /// Play the seam in this file, as `teach --save` writes it, on a part that lies elsewhere and is bent otherwise
    #[arg(long, value_name = "FILE")]
    taught: Option<PathBuf>,
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
    /// Run holds × feed-forward × drive modes and print the table
    #[arg(long, conflicts_with_all = ["hold", "no_feed_forward", "mode", "out"])]
    ablate: bool,
    /// Write report, log, candump and the images' parameters of the first trial here
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

impl SealArgs {
    fn options(&self) -> anyhow::Result<Options> {
        // Read once, and played until the process ends.
        let read = |path: &PathBuf| TaughtSeam::read(path).map(|seam| &*Box::leak(Box::new(seam)));
        let taught = self.taught.as_ref().map(read).transpose()?;
        Ok(Options {
            second_arm: false,
            on: self.on,
            path: self.path,
            joint: self.joint,
            speed: self.speed,
            hold: self.hold,
            slits: self.slits,
            surface: self.surface,
            offset: self.offset_mm * 1e-3,
            turn: self.offset_deg.to_radians(),
            deform: self.deform_mm * 1e-3,
            start: self.start,
            survey: self.survey,
            start_error: (self.start_error_mm * 1e-3, self.start_error_deg.to_radians()),
            frame_loss: self.frame_loss / 100.0,
            retakes: self.retakes,
            model_error: self.model_error / 100.0,
            mode: self.mode,
            feed_forward: !self.no_feed_forward,
            preview: !self.no_preview,
            vision_period: self.vision_ms,
            vision_latency: self.latency_ms,
            error_frames: self.error_frames,
            taught,
        })
    }
}

fn survey(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(number) if number == 0 || (2..=SECTIONS).contains(&usize::from(number)) => Ok(number),
        _ => Err(format!("must be 0 or from 2 to {SECTIONS}")),
    }
}

/// `cargo run --release` alone: one panel, with its report.
pub fn panel() -> Outcome {
    let campaign = Campaign {
        options: Options::default(),
        seed: 1,
        trials: 1,
    };
    report(&campaign, &Model::k3s(), Some(Path::new("target/tesaki/panel")), false)
}

/// `seal …`.
pub fn run(args: &SealArgs) -> Outcome {
    let model = Model::named(&args.robot)?;
    let campaign = Campaign {
        options: args.options()?,
        seed: args.seed,
        trials: args.trials as usize,
    };
    if args.ablate {
        let table = ablation::run(&campaign, &model)?;
        if args.json {
            print_json(&table)?
        } else {
            print_text(&ablation::table(&table))
        }
        return Ok(true);
    }
    report(&campaign, &model, args.out.as_deref(), args.json)
}

fn report(campaign: &Campaign, model: &Model, out: Option<&Path>, json: bool) -> Outcome {
    let result = campaign::run(campaign, model, out)?;
    if json {
        print_json(&result.score)?;
    } else {
        print_text(&words::score_table(&result.score));
        for file in &result.files {
            print_text(&format!("{}\n", file.display()));
        }
    }
    Ok(result.score.passed())
}
