//! `calibrate`: the camera, its slit and its place on the arm, from photographs or from the simulated cell.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::{ArgGroup, Args, ValueEnum};
use nalgebra::Vector3;

use super::{Outcome, check_save, number_in, print_json, print_text, seed, whole_in};
use crate::calibration::board::{Board, Grid};
use crate::calibration::camera::{Camera, Distortion};
use crate::calibration::given::{self, Files};
use crate::calibration::hand_eye::ArmAccuracy;
use crate::calibration::intrinsics::MAX_VIEWS;
use crate::calibration::opencv_yaml::CameraFile;
use crate::calibration::procedure::{self, Options};
use crate::calibration::report::Report;
use crate::calibration::sensor_file::SensorFile;
use crate::calibration::simulated;
use crate::calibration::slit_plane::SlitPlane;
use crate::table::Table;

/// Options of `calibrate`.
#[derive(Args)]
#[command(group = ArgGroup::new("source").required(true).args(["images", "simulate"]))]
pub struct CalibrateArgs {
    /// Photographs of a chessboard (JPEG, PNG, PGM)
    #[arg(long, value_name = "FILE", num_args = 1..)]
    images: Vec<PathBuf>,
    /// Calibrate the simulated cell's camera, slit and hand-eye transform
    #[arg(long)]
    simulate: bool,
    /// Inner corners of the board (3 to 50 in a row or column)
    #[arg(
        long,
        value_name = "COLUMNSxROWS",
        default_value = "9x6",
        conflicts_with = "simulate"
    )]
    board: Grid,
    /// Side of a square, mm (0.1 to 1000)
    #[arg(long, value_name = "MM", default_value = "25", value_parser = number_in(0.1, 1000.0), conflicts_with = "simulate")]
    square_mm: f64,
    /// The arm's pose at each photograph: a line of 12 numbers, rows of [R p] in m
    #[arg(long, value_name = "FILE", conflicts_with = "simulate")]
    poses: Option<PathBuf>,
    /// The same photographs with the slit of the start view on, one for each
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "simulate")]
    slit_images: Vec<PathBuf>,
    /// Of a sensor with two slits: the same photographs with the slit on that is nearer to the nozzle
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "simulate", requires = "far_slit_images")]
    near_slit_images: Vec<PathBuf>,
    /// And with the other one on
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "simulate", requires = "near_slit_images")]
    far_slit_images: Vec<PathBuf>,
    /// Take this camera (OpenCV's YAML) instead of estimating one
    #[arg(long, value_name = "FILE", conflicts_with = "simulate")]
    camera: Option<PathBuf>,
    /// What the lens may do [default: full for photographs, brown for the narrow view of the simulated cell]
    #[arg(long, value_enum)]
    distortion: Option<DistortionName>,
    /// Repeatability of the arm's position, mm (0.001 to 5)
    #[arg(long, value_name = "MM", default_value = "0.02", value_parser = number_in(0.001, 5.0), conflicts_with = "simulate")]
    arm_mm: f64,
    /// Repeatability of the arm's orientation, degrees (0.0001 to 1)
    #[arg(long, value_name = "DEG", default_value = "0.003", value_parser = number_in(0.0001, 1.0), conflicts_with = "simulate")]
    arm_deg: f64,
    /// Views of the board in the simulated cell (16 to 150)
    #[arg(long, value_name = "N", default_value_t = simulated::VIEWS, value_parser = whole_in(simulated::FEWEST_VIEWS, MAX_VIEWS), conflicts_with = "images")]
    views: usize,
    /// Seed of the simulated cell (0 to 2^64 - 1)
    #[arg(long, value_name = "N", default_value = "1", value_parser = seed)]
    seed: u64,
    /// Write the camera here, as OpenCV's YAML, with slit and place on the arm if these were calibrated: `seal --calibration FILE` takes it
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// One JSON value on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// Names of the lens models on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DistortionName {
    /// A plain pinhole.
    None,
    /// k1.
    Radial,
    /// k1, k2, p1, p2.
    Brown,
    /// k1, k2, p1, p2, k3.
    Full,
}

/// `calibrate …`.
pub fn run(args: &CalibrateArgs) -> Outcome {
    check_save(args.save.as_deref())?;
    let report = if args.simulate {
        from_simulation(args)?
    } else {
        from_files(args)?
    };
    if let Some(path) = &args.save {
        let path = match sensor_file(&report) {
            Some(sensor) => sensor.save(path)?,
            None => camera_file(&report).save(path)?,
        };
        eprintln!("{}", path.display());
    }
    if args.json {
        print_json(&report)?;
    } else {
        print_text(&words(&report))?;
    }
    Ok(report.passed)
}

fn from_simulation(args: &CalibrateArgs) -> anyhow::Result<Report> {
    let (truth, measured) = simulated::cell(args.seed, args.views)?;
    // In a narrow view k3 follows the noise.
    let distortion = lens(args, DistortionName::Brown);
    let found = procedure::calibrate(
        &measured,
        &Options {
            distortion,
            camera: None,
            arm: simulated::ARM,
        },
    )?;
    Ok(Report::new(&measured, &[], &found, Some((args.seed, &truth))))
}

fn from_files(args: &CalibrateArgs) -> anyhow::Result<Report> {
    let files = Files {
        images: args.images.clone(),
        poses: args.poses.clone(),
        slit_images: [&args.slit_images, &args.near_slit_images, &args.far_slit_images].map(Vec::clone),
    };
    let camera = args.camera.as_deref().map(CameraFile::load).transpose()?;
    let (measured, refused) = given::measure(
        &files,
        &Board {
            grid: args.board,
            square_m: args.square_mm * 1e-3,
        },
    )?;
    if let Some(camera) = &camera {
        anyhow::ensure!(
            (camera.width, camera.height) == measured.size,
            "--camera: image_width, image_height {} × {}: must be {} × {} px as the images",
            camera.width,
            camera.height,
            measured.size.0,
            measured.size.1
        );
    }
    let options = Options {
        distortion: lens(args, DistortionName::Full),
        camera: camera.map(|file| file.camera),
        arm: ArmAccuracy {
            position_m: args.arm_mm * 1e-3,
            turn_rad: args.arm_deg.to_radians(),
        },
    };
    let found = procedure::calibrate(&measured, &options).map_err(|error| match refused.first() {
        // Most likely what is wrong: a board of another size, a photograph of something else.
        Some(first) => anyhow!("{error:#}; refused {}, {}: {}", refused.len(), first.name, first.reason),
        None => error,
    })?;
    Ok(Report::new(&measured, &refused, &found, None))
}

fn lens(args: &CalibrateArgs, default: DistortionName) -> Distortion {
    match args.distortion.unwrap_or(default) {
        DistortionName::None => Distortion::None,
        DistortionName::Radial => Distortion::Radial1,
        DistortionName::Brown => Distortion::Brown,
        DistortionName::Full => Distortion::Full,
    }
}

fn camera_file(report: &Report) -> CameraFile {
    let camera = Camera {
        fx: report.fx,
        fy: report.fy,
        cx: report.cx,
        cy: report.cy,
        distortion: report.distortion,
    };
    CameraFile {
        width: report.image_width,
        height: report.image_height,
        camera,
        rms_px: report.rms_px,
    }
}

/// All of the sensor, if all of it was calibrated.
fn sensor_file(report: &Report) -> Option<SensorFile> {
    let plane = |[x, y, z, distance_mm]: [f64; 4]| SlitPlane {
        normal: Vector3::new(x, y, z),
        distance_m: distance_mm * 1e-3,
    };
    Some(SensorFile {
        camera: camera_file(report),
        t_5_c: given::pose_of(&report.hand_eye?).ok()?,
        slit: plane(report.slit_plane?),
        pair: report.pair_planes.map(|pair| pair.map(plane)),
        views: report.views_used,
        exposure_delay_s: None,
    })
}

/// The report for a reader.
fn words(report: &Report) -> String {
    let figure = |value: Option<f64>, digits: usize| value.map_or(String::new(), |value| format!("{value:.digits$}"));
    let mut views = Table::new(["view", "corners px", "slit px", "arm mm", "arm °", "refused"]);
    for view in &report.views {
        views.row([
            view.view.clone(),
            figure(view.rms_px, 3),
            figure(view.slit_rms_px, 3),
            figure(view.hand_eye_mm, 3),
            figure(view.hand_eye_deg, 3),
            view.refused.clone().unwrap_or_default(),
        ]);
    }
    let mut numbers = Table::new(["camera", "value", "±"]);
    let names = ["fx px", "fy px", "cx px", "cy px", "k1", "k2", "p1", "p2", "k3"];
    let values = camera_file(report).camera.parameters();
    for ((name, value), deviation) in names.iter().zip(values).zip(report.deviations) {
        numbers.row([name.to_string(), format!("{value:.5}"), format!("{deviation:.5}")]);
    }
    let mut text = format!("{views}\n{numbers}\n");
    if let (Some(angle), Some(crossing)) = (report.slit_angle_deg, report.slit_crossing_mm) {
        text +=
            &format!("slit: at {angle:.3}° to the camera's axis, which it crosses {crossing:.3} mm from the camera\n");
    }
    if let Some([_, _, _, x, _, _, _, y, _, _, _, z]) = report.hand_eye.map(|pose| pose.map(|number| number * 1e3)) {
        text += &format!("camera on the arm: ({x:.3}, {y:.3}, {z:.3}) mm in Σ_5\n");
    }
    let mut checks = Table::new(["check", "value", "limit", "unit", "verdict"]);
    for check in &report.checks {
        checks.row([
            check.name.to_string(),
            format!("{:.4}", check.value),
            check.limit.to_string(),
            check.unit.to_string(),
            if check.passed { "pass" } else { "FAIL" }.to_string(),
        ]);
    }
    let verdict = if report.passed { "passed" } else { "FAILED" };
    text + &format!("\n{checks}\ncalibration {verdict}: {} views\n", report.views_used)
}
