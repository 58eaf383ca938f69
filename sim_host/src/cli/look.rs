//! `look`: one vision routine on image files.

mod start;
mod two_slits;

use super::{Outcome, print_json, whole_in};
use crate::calibration::sensor::SensorGeometry;
use crate::calibration::sensor_file::SensorFile;
use crate::camera::optics::Optics;
use crate::image_file::GreyImage;
use crate::seal::scenario::JointName;
use crate::seal::words;
use anyhow::{Context, anyhow, bail};
use clap::{Args, Subcommand, ValueEnum};
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::sensor::{Find, Refusal, SeamSensor};
use firmware::vision::{net, printed};
use hal::process::Sighting;
use serde::Serialize;
use start::StartArgs;
use std::path::{Path, PathBuf};

/// Options of `look`.
#[derive(Args)]
pub struct LookArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// The seam in images of the slit sensor
    Seam(SeamArgs),
    /// The start of the seam: a grey image of its end, and its pose from images of the slit beside it
    Start(StartArgs),
}

#[derive(Args)]
struct SeamArgs {
    /// Images, PNG or PGM: of 250 × 250 px of 0.12 mm with one slit, of 400 × 240 px of 0.125 mm with two
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Shape of the joint
    #[arg(long, value_enum, default_value = "crank")]
    joint: JointName,
    /// Slits of the sensor (1 to 2) [default: what the first image's size says]
    #[arg(long, value_name = "N", value_parser = whole_in(1_u8, 2))]
    slits: Option<u8>,
    /// The sensor that took them, as `calibrate --save` writes it, for --method local [default: as drawn]
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// How the seam is looked for
    #[arg(long, value_enum, default_value = "local")]
    method: Method,
    /// One JSON value on stdout (this verb always answers in JSON)
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// The sensor's own: a local fit of the joint's shape to the line.
    Local,
    /// The paper's windows and D_i, for reference.
    Printed,
    /// The paper's neural net, for reference.
    Net,
}

/// What was seen in one file.
#[derive(Serialize)]
struct InFile {
    file: String,
    #[serde(flatten)]
    seen: Seen,
}

/// What was seen in one image, or by one slit in it; pixels count from the centre of the top-left one, x right, y down. The angle is that of the
/// line against the column axis, without what the lens adds.
#[derive(Default, Serialize)]
struct Seen {
    found: bool,
    reason: Option<&'static str>,
    x_px: Option<f32>,
    y_px: Option<f32>,
    angle_deg: Option<f32>,
    quality: Option<u8>,
    /// One may go by it without asking another image.
    sure: Option<bool>,
}

impl Seen {
    /// By the sensor's own method, behind `camera`.
    fn local(found: &Result<Find, Refusal>, camera: &Pinhole) -> Self {
        match found {
            Ok(find) => Self {
                found: true,
                reason: None,
                x_px: Some(find.x),
                y_px: Some(find.y),
                angle_deg: Some(camera.slope(find.x, find.y, find.slope).atan().to_degrees()),
                quality: Some(find.quality),
                sure: Some(find.quality >= Sighting::SURE),
            },
            Err(refusal) => Self::refused(words::refusal(*refusal as u8)),
        }
    }

    /// By a method that knows neither angle nor quality; `reason` is what it means that it found nothing.
    fn reference(found: Option<(f32, f32)>, reason: &'static str) -> Self {
        match found {
            Some((x, y)) => Self {
                found: true,
                x_px: Some(x),
                y_px: Some(y),
                ..Self::default()
            },
            None => Self::refused(reason),
        }
    }

    /// Nothing, and why.
    fn refused(reason: &'static str) -> Self {
        Self {
            reason: Some(reason),
            ..Self::default()
        }
    }
}

/// The sensor with so many slits in a calibration's file, if one is given.
fn calibrated(file: Option<&Path>, slits: u8) -> anyhow::Result<Option<SensorGeometry>> {
    let sensor = |path| SensorFile::load(path)?.geometry(slits).context("--calibration");
    file.map(sensor).transpose()
}

/// What the emulated sensors take images by, and what to say of one of that size where another is asked for.
const VIEWS: [(Optics, &str); 3] = [
    (
        Optics::TRACKING,
        "; this is of the one-slit sensor: look seam --slits 1",
    ),
    (
        Optics::TWO_SLITS,
        "; this is of the two-slit sensor: look seam --slits 2",
    ),
    (Optics::START, "; this is of the seam's start: look start"),
];

/// Slits of the sensor that took the image in `file`, by its size.
fn slits_of(file: &Path) -> anyhow::Result<u8> {
    let image = GreyImage::read(file)?;
    let [one, two, _] = VIEWS.map(|(optics, _)| optics);
    for (slits, optics) in [(1, &one), (2, &two)] {
        if is_of(&image, optics) {
            return Ok(slits);
        }
    }
    Err(other_size(
        &image,
        file,
        &format!("{} (one slit) or {} (two)", size(&one), size(&two)),
    ))
}

fn is_of(image: &GreyImage, optics: &Optics) -> bool {
    (image.width, image.height) == (optics.width, optics.height)
}

fn size(optics: &Optics) -> String {
    format!("{} × {}", optics.width, optics.height)
}

/// That the image in `file` is not of the size that it `must` be, and what it is if another sensor's.
fn other_size(image: &GreyImage, file: &Path, must: &str) -> anyhow::Error {
    let GreyImage { width, height, .. } = image;
    let other = VIEWS.iter().find(|(optics, _)| is_of(image, optics));
    let hint = other.map_or("", |(_, hint)| hint);
    anyhow!(
        "image {}: size is {width} × {height} px, must be {must}{hint}",
        file.display()
    )
}

/// The image in `file` as a sensor with such optics sees it.
fn view<'a>(image: &'a GreyImage, file: &Path, optics: &Optics) -> anyhow::Result<View<'a>> {
    if !is_of(image, optics) {
        return Err(other_size(image, file, &size(optics)));
    }
    View::new(&image.pixels, image.width, image.height).with_context(|| format!("image {}", file.display()))
}

/// `look …`.
pub fn run(args: &LookArgs) -> Outcome {
    let args = match &args.what {
        What::Seam(args) => args,
        What::Start(args) => return start::run(args),
    };
    if args.method != Method::Local && args.calibration.is_some() {
        bail!("--method: printed and net know no camera, must be local with --calibration");
    }
    let slits = match args.slits {
        Some(slits) => slits,
        None => slits_of(&args.files[0])?,
    };
    if args.method != Method::Local && slits == 2 {
        bail!("--method: printed and net look at one slit, must be local with two");
    }
    let sensor = calibrated(args.calibration.as_deref(), slits)?;
    if slits == 2 {
        let slits = sensor.map_or(Pinhole::TWO_SLITS, |sensor| sensor.pinholes());
        return two_slits::run(&args.files, &slits, args.joint.pattern());
    }
    let camera = sensor.map_or(Pinhole::TRACKING, |sensor| sensor.pinholes()[0]);
    let sensor = SeamSensor::new(camera, args.joint.pattern());
    let mut all = Vec::new();
    for file in &args.files {
        let image = GreyImage::read(file)?;
        let view = view(&image, file, &Optics::TRACKING)?;
        let seen = match args.method {
            Method::Local => Seen::local(&sensor.find(&view), &camera),
            Method::Printed => Seen::reference(printed::seam(&view), "no window holds a line"),
            Method::Net => {
                let found = net::find(&view, args.joint.pattern());
                Seen::reference(found, "no two windows running show a seam")
            }
        };
        all.push(InFile {
            file: file.display().to_string(),
            seen,
        });
    }
    print_json(&all)?;
    Ok(all.iter().all(|file| file.seen.found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::whole_file::tests::folder;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        look: LookArgs,
    }

    fn error(arguments: &[&str]) -> String {
        let line = Line::try_parse_from([&["line"], arguments].concat()).unwrap();
        format!("{:#}", run(&line.look).unwrap_err())
    }

    /// An image of this size without any light, in a file of `folder`.
    fn dark(folder: &Path, width: usize, height: usize) -> String {
        let file = folder.join(format!("{width}-{height}.pgm"));
        let head = format!("P5 {width} {height} 255\n").into_bytes();
        std::fs::write(&file, [head, vec![0; width * height]].concat()).unwrap();
        file.display().to_string()
    }

    #[test]
    fn a_method_that_knows_no_camera_takes_no_calibration() {
        for method in ["printed", "net"] {
            assert_eq!(
                error(&["seam", "--method", method, "--calibration", "cam.yml", "a.png"]),
                "--method: printed and net know no camera, must be local with --calibration"
            );
        }
    }

    #[test]
    fn an_image_of_another_size_than_the_sensors_is_refused() {
        let folder = folder("look-arguments");
        let refused = |(width, height): (usize, usize), arguments: &[&str]| {
            let file = dark(&folder, width, height);
            let told = error(&[arguments, &[&file]].concat());
            told.strip_prefix(&format!("image {file}: size is {width} × {height} px, must be "))
                .unwrap()
                .to_string()
        };
        let [one, two, start]: [&[&str]; 3] = [&["seam", "--slits", "1"], &["seam", "--slits", "2"], &["start"]];
        for (arguments, size) in [(one, "250 × 250"), (two, "400 × 240"), (start, "450 × 450")] {
            assert_eq!(refused((250, 240), arguments), size);
        }
        let of_one = "; this is of the one-slit sensor: look seam --slits 1";
        let of_two = "; this is of the two-slit sensor: look seam --slits 2";
        assert_eq!(refused((400, 240), one), format!("250 × 250{of_two}"));
        assert_eq!(refused((250, 250), two), format!("400 × 240{of_one}"));
        assert_eq!(refused((400, 240), start), format!("450 × 450{of_two}"));
        assert_eq!(
            refused((450, 450), two),
            "400 × 240; this is of the seam's start: look start"
        );
    }

    #[test]
    fn without_slits_the_first_images_size_says_how_many_the_sensor_has() {
        let folder = folder("look-slits");
        let sizes = [(250, 250), (400, 240), (450, 450), (250, 240)];
        let [one, two, start, other] = sizes.map(|(width, height)| dark(&folder, width, height));
        let wrong = |first: &str, second: &str| error(&["seam", first, second]);
        assert!(wrong(&one, &two).ends_with("must be 250 × 250; this is of the two-slit sensor: look seam --slits 2"));
        assert!(wrong(&two, &one).ends_with("must be 400 × 240; this is of the one-slit sensor: look seam --slits 1"));
        assert_eq!(
            wrong(&other, &one),
            format!("image {other}: size is 250 × 240 px, must be 250 × 250 (one slit) or 400 × 240 (two)")
        );
        assert!(wrong(&start, &one).ends_with("(two); this is of the seam's start: look start"));
        let printed = error(&["seam", "--method", "printed", &two]);
        assert_eq!(
            printed,
            "--method: printed and net look at one slit, must be local with two"
        );
    }
}
