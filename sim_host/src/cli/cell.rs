//! Options that every verb has which runs a job along a seam: the cell with its disturbances, and how often the job is run.

use super::{cycles_in, number_in, seed, whole_in};
use crate::calibration::sensor_file::SensorFile;
use crate::campaign::Campaign;
use crate::model::{Model, ModelError};
use crate::seal::cell::longest_exposure_delay;
use crate::seal::scenario::{JointName, Options, PathName, SurfaceName};
use crate::target::node::On;
use anyhow::{Context, anyhow, ensure};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use std::path::PathBuf;

/// The cell.
#[derive(Args)]
pub struct CellArgs {
    /// Which seam
    #[arg(long, value_enum, default_value = "panel")]
    pub path: PathName,
    /// Shape of the joint
    #[arg(long, value_enum, default_value = "crank")]
    pub joint: JointName,
    /// Part misplaced by up to this along each axis, mm (0 to 20)
    #[arg(long, value_name = "MM", default_value = "10", value_parser = number_in(0.0, 20.0))]
    offset_mm: f64,
    /// Part turned by up to this about each axis, degrees (0 to 5)
    #[arg(long, value_name = "DEG", default_value = "3", value_parser = number_in(0.0, 5.0))]
    offset_deg: f64,
    /// Peak deformation of the part, to the side and in height, mm (0 to 5)
    #[arg(long, value_name = "MM", default_value = "2", value_parser = number_in(0.0, 5.0))]
    deform_mm: f64,
    /// Error along each axis of a start pose that is told, mm (0 to 2)
    #[arg(long, value_name = "MM", default_value = "0.1", value_parser = number_in(0.0, 2.0))]
    start_error_mm: f64,
    /// The same about each axis, degrees (0 to 1)
    #[arg(long, value_name = "DEG", default_value = "0.2", value_parser = number_in(0.0, 1.0))]
    start_error_deg: f64,
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Time from a SYNC to the middle of its exposure that the controller reckons with, ms (-5 to 20): what `latency` measures [default: what
    /// --calibration says, or else 0]
    #[arg(long, value_name = "MS", value_parser = number_in(-5.0, 20.0))]
    compensate_ms: Option<f64>,
    /// How wrong the controller's servo model is, percent (0 to 30)
    #[arg(long, value_name = "PERCENT", default_value = "10", value_parser = number_in(0.0, 30.0))]
    model_error: f64,
    /// Error frames on the bus in every cycle (0 to 10)
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole_in(0_u8, 10))]
    error_frames: u8,
    /// Where the controller runs: in this process, or as a Cortex-M image under QEMU (`cargo xtask build` makes it)
    #[arg(long, value_enum, default_value = "host")]
    on: On,
}

impl CellArgs {
    /// `rest` in this cell.
    pub fn options(&self, rest: Options) -> anyhow::Result<Options> {
        let options = self.camera.options(Options {
            on: self.on,
            path: self.path,
            joint: self.joint,
            offset: self.offset_mm * 1e-3,
            turn: self.offset_deg.to_radians(),
            deform: self.deform_mm * 1e-3,
            start_error: (self.start_error_mm * 1e-3, self.start_error_deg.to_radians()),
            model_error: self.model_error / 100.0,
            error_frames: self.error_frames,
            ..rest
        })?;
        Ok(Options {
            assumed_delay: self.compensate_ms.map_or(options.assumed_delay, |ms| ms * 1e-3),
            ..options
        })
    }
}

/// The cell's camera and its images.
#[derive(Args)]
pub struct CameraArgs {
    /// Slits of the seam sensor (1 to 2)
    #[arg(long, value_name = "N", default_value = "2", value_parser = whole_in(1_u8, 2))]
    slits: u8,
    /// How hard the camera's images are
    #[arg(long, value_enum, default_value = "moderate")]
    surface: SurfaceName,
    /// Share of camera frames lost, percent (0 to 50)
    #[arg(long, value_name = "PERCENT", default_value = "5", value_parser = number_in(0.0, 50.0))]
    frame_loss: f64,
    /// Time from an exposure to its sighting on the bus, ms (5 to 50, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "20", value_parser = cycles_in(5, 50))]
    pub latency_ms: u8,
    /// Time from the SYNC that triggers an exposure to its middle, ms (0 to 9.5, and less than the read-out)
    #[arg(long, value_name = "MS", default_value = "0", value_parser = number_in(0.0, 9.5))]
    exposure_delay_ms: f64,
    /// The cell's sensor is made and mounted as that of `calibrate --simulate --seed N`, not as drawn (0 to 2^64 - 1)
    #[arg(long, value_name = "N", value_parser = seed)]
    camera_seed: Option<u64>,
    /// The sensor as the controller knows it, as `calibrate --save` writes it
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
}

impl CameraArgs {
    /// `rest` with this camera.
    pub fn options(&self, rest: Options) -> anyhow::Result<Options> {
        let file = self.calibration.as_deref().map(SensorFile::load).transpose()?;
        let sensor = |file: SensorFile| file.geometry(self.slits).context("--calibration");
        let options = Options {
            camera_seed: self.camera_seed,
            calibration: file.map(sensor).transpose()?,
            assumed_delay: file.and_then(|file| file.exposure_delay_s).unwrap_or(0.0),
            slits: self.slits,
            surface: self.surface,
            frame_loss: self.frame_loss / 100.0,
            vision_latency: self.latency_ms,
            exposure_delay: self.exposure_delay_ms * 1e-3,
            ..rest
        };
        let longest_ms = longest_exposure_delay(&options) * 1e3;
        ensure!(
            self.exposure_delay_ms <= longest_ms,
            "--exposure-delay-ms: {} is past the read-out, must be at most {longest_ms:.1} with --latency-ms {}",
            self.exposure_delay_ms,
            5 * u32::from(self.latency_ms)
        );
        Ok(options)
    }
}

/// The trials, and what they leave.
#[derive(Args)]
pub struct TrialArgs {
    /// Number of trials (1 to 1000000); trial i draws from seed + i
    #[arg(long, value_name = "N", default_value = "1", value_parser = whole_in(1_usize, 1_000_000))]
    trials: usize,
    /// First seed (0 to 2^64 - 1)
    #[arg(long, value_name = "N", default_value = "1", value_parser = seed)]
    pub seed: u64,
    /// Arm model: `k3s`, or a TOML file
    #[arg(long, value_name = "NAME_OR_FILE", default_value = "k3s", value_parser = NonEmptyStringValueParser::new())]
    robot: String,
    /// Write report, log, candump and the images' parameters of the first trial here
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    pub json: bool,
}

impl TrialArgs {
    /// So many trials with these options.
    pub fn campaign<Options>(&self, options: Options) -> Campaign<Options> {
        Campaign {
            options,
            seed: self.seed,
            trials: self.trials,
        }
    }

    /// The arm.
    pub fn model(&self) -> anyhow::Result<Model> {
        let named = |error| match error {
            ModelError::Unreadable { .. } => anyhow!("{error}"),
            _ => anyhow!("--robot {}: {error}", self.robot),
        };
        Model::named(&self.robot).map_err(named)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::sensor_file::tests::file;
    use crate::whole_file::tests::folder;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        cell: CellArgs,
    }

    fn options(arguments: &[&str]) -> anyhow::Result<Options> {
        let line = Line::try_parse_from([&["line"], arguments].concat())?;
        line.cell.options(Options::default())
    }

    #[test]
    fn a_calibration_brings_the_sensor_of_either_kind_and_its_delay_unless_another_is_told() {
        let folder = folder("cell-arguments");
        let whole = folder.join("whole.yml").display().to_string();
        SensorFile::save(&file(), whole.as_ref()).unwrap();
        let read = SensorFile::load(whole.as_ref()).unwrap();
        for slits in [1, 2] {
            let calibrated = options(&["--calibration", &whole, "--slits", &slits.to_string()]).unwrap();
            assert_eq!(calibrated.calibration, Some(read.geometry(slits).unwrap()));
            assert_eq!(calibrated.assumed_delay, 0.005);
        }
        let told = options(&["--calibration", &whole, "--compensate-ms", "2"]).unwrap();
        assert_eq!(told.assumed_delay, 0.002);
        assert_eq!(options(&[]).unwrap().assumed_delay, 0.0);
        let one_slit = folder.join("one-slit.yml").display().to_string();
        let without = SensorFile { pair: None, ..file() };
        without.save(one_slit.as_ref()).unwrap();
        assert_eq!(
            format!("{:#}", options(&["--calibration", &one_slit]).unwrap_err()),
            "--calibration: pair_planes: missing, must be there for a sensor with two slits"
        );
    }
}
