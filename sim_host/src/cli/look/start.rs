//! `look start`: the start of the seam in a grey image and, with light sections of it, its pose.

use super::{Seen, view};
use crate::camera::optics::Optics;
use crate::cli::{Outcome, number_in, print_json};
use crate::image_file::GreyImage;
use crate::seal::scenario::JointName;
use crate::seal::{setup, words};
use clap::Args;
use firmware::geometry::Pose;
use firmware::geometry::trig::{asin, atan2};
use firmware::job::mount::SensorMount;
use firmware::job::start_pose::{StartLooks, rolled};
use firmware::vision::camera::Pinhole;
use firmware::vision::start::{Aim, StartSensor, Workspace};
use hal::process::{Look, Sighting};
use nalgebra::Vector3;
use serde::Serialize;
use std::path::PathBuf;

/// Options of `look start`.
#[derive(Args)]
pub struct StartArgs {
    /// The grey image, then images of the slit: the first at the same place, each other one further along the seam; PNG or PGM, 450 × 450 px
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Shape of the joint
    #[arg(long, value_enum, default_value = "crank")]
    joint: JointName,
    /// The sensor that took them, as `calibrate --save` writes it [default: as drawn]
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Distance from the grey image's place to the first slit image's, along the image's x, mm (-100 to 100)
    #[arg(long, value_name = "MM", default_value = "0", value_parser = number_in(-100.0, 100.0))]
    first_mm: f64,
    /// Distance from one slit image's place to the next, along the image's x, mm (1 to 100)
    #[arg(long, value_name = "MM", default_value = "20", value_parser = number_in(1.0, 100.0))]
    advance_mm: f64,
    /// Roll of the sensor in the grey image against the slit images, about the image's x, degrees (-30 to 30); `seal` takes them at 10 and -10 in turn
    #[arg(long, value_name = "DEG", default_value = "0", value_parser = number_in(-30.0, 30.0))]
    roll_deg: f64,
    /// One JSON value on stdout (this verb always answers in JSON)
    #[arg(long)]
    json: bool,
}

/// What was seen in one file. The pose stands with the grey image; it needs two slit images.
#[derive(Serialize)]
struct InFile {
    file: String,
    #[serde(flatten)]
    seen: Seen,
    #[serde(flatten)]
    pose: StartPose,
}

/// The part's start frame in Σ_S of the slit images, at the grey image's place.
#[derive(Default, Serialize)]
struct StartPose {
    x_mm: Option<f32>,
    y_mm: Option<f32>,
    z_mm: Option<f32>,
    theta_x_deg: Option<f32>,
    theta_y_deg: Option<f32>,
    theta_z_deg: Option<f32>,
}

/// `look start …`.
pub fn run(args: &StartArgs) -> Outcome {
    let all = look(args)?;
    print_json(&all)?;
    Ok(all.iter().all(|file| file.seen.found && file.seen.reason.is_none()))
}

fn look(args: &StartArgs) -> anyhow::Result<Vec<InFile>> {
    let calibrated = super::calibrated(args.calibration.as_deref(), 1)?;
    let camera = calibrated.map_or(Pinhole::START, |sensor| sensor.start_optics().pinhole(0));
    let sensor = StartSensor::new(camera, args.joint.pattern(), Aim::ANYWHERE);
    let mount = SensorMount {
        pose: Pose::identity(),
        ..calibrated.map_or(setup::as_drawn(Pose::identity()), |sensor| sensor.mount())
    };
    let mut workspace = Box::new(Workspace::new());
    let mut looks = StartLooks::new();
    let mut all = Vec::new();
    for (index, file) in args.files.iter().enumerate() {
        let image = GreyImage::read(file)?;
        let view = view(&image, file, &Optics::START)?;
        let here = Pose::identity();
        let (sighting, t_grey_s) = if index == 0 {
            let roll = args.roll_deg.to_radians().sin() as f32;
            (sensor.sight_grey(&view, &mut workspace), rolled(&here, roll))
        } else {
            let ahead = 1e-3 * (args.first_mm + args.advance_mm * (index - 1) as f64) as f32;
            let p = Vector3::new(ahead, 0.0, 0.0);
            (sensor.sight_slit(&view), Pose { p, ..here })
        };
        let mut seen = seen(&sighting, &camera);
        if looks.take(&sighting, &mount, &t_grey_s).is_err() && seen.reason.is_none() {
            seen.reason = Some("more slit images than there is room for");
        }
        all.push(InFile {
            file: file.display().to_string(),
            seen,
            pose: StartPose::default(),
        });
    }
    if all.len() > 2
        && all.iter().all(|file| file.seen.found)
        && let Some(grey) = all.first_mut()
    {
        match looks.frame(&mount, args.joint.pattern().edge_height()) {
            Ok(start) => grey.pose = StartPose::of(&start.pose),
            Err(refusal) => grey.seen.reason = Some(words::start_refusal(refusal)),
        }
    }
    Ok(all)
}

fn seen(sighting: &Sighting, camera: &Pinhole) -> Seen {
    if sighting.refusal != 0 {
        return Seen::refused(words::refusal(sighting.refusal));
    }
    let point = Vector3::from(sighting.point());
    let [x, y] = camera.pixel(&point);
    // In the grey image the seam's direction in the image, y down; in the slit's the line's inclination from the column axis.
    let sign = if sighting.look == Look::StartGrey { -1.0 } else { 1.0 };
    Seen {
        found: true,
        reason: None,
        x_px: Some(x),
        y_px: Some(y),
        angle_deg: Some(sign * sighting.angle().to_degrees()),
        quality: Some(sighting.quality),
        sure: Some(sighting.is_sure()),
    }
}

impl StartPose {
    fn of(Pose { r, p }: &Pose) -> Self {
        let mm = p * 1e3;
        Self {
            x_mm: Some(mm.x),
            y_mm: Some(mm.y),
            z_mm: Some(mm.z),
            theta_x_deg: Some(atan2(-r.m23, r.m33).to_degrees()),
            theta_y_deg: Some(asin(r.m13).to_degrees()),
            theta_z_deg: Some(atan2(-r.m12, r.m11).to_degrees()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Company;
    use crate::model::Model;
    use crate::seal::cell::Cell;
    use crate::seal::scenario::{Options, PathName};
    use crate::seal::trial;
    use crate::whole_file::tests::folder;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        start: StartArgs,
    }

    /// The start frame's y, mm, from images of the start whose grey one is taken to be rolled by so much; or why there is none.
    fn aside(files: &[String], roll: &str) -> Result<f32, Option<&'static str>> {
        let roll = format!("--roll-deg={roll}");
        let words = ["look", &roll, "--first-mm=2.5", "--advance-mm=12"];
        let line = Line::try_parse_from(words.into_iter().chain(files.iter().map(String::as_str))).unwrap();
        let all = look(&line.start).unwrap();
        all[0].pose.y_mm.ok_or(all[0].seen.reason)
    }

    #[test]
    fn a_start_that_a_run_looked_at_last_lies_where_the_sensor_was_held_if_the_grey_images_roll_is_told() {
        let folder = folder("look-start");
        let mut views: Vec<Vec<String>> = Vec::new();
        let mut taken = 0;
        let mut keep = |_, _, cell: &mut Cell| {
            for shot in cell.shots.iter().skip(taken) {
                if shot.look == Look::StartGrey {
                    views.push(Vec::new());
                }
                // Of a view four light sections; before the first, and behind the last, it is searched and proven.
                if let Some(view) = views.last_mut()
                    && matches!(shot.look, Look::StartGrey | Look::StartSlit)
                    && view.len() < 5
                {
                    let file = folder.join(format!("{}.png", shot.cycle));
                    std::fs::write(&file, shot.image.to_png().unwrap()).unwrap();
                    view.push(file.display().to_string());
                }
            }
            taken = cell.shots.len();
        };
        let company = Company {
            recording: None,
            progress: &|_| (),
            upset: &mut keep,
        };
        let options = Options {
            path: PathName::Straight,
            frame_loss: 0.0,
            ..Options::default()
        };
        trial::run(&options, &Model::k3s(), 1, company).unwrap();
        let (last, roll) = (views.last().unwrap(), if views.len() % 2 == 1 { "10" } else { "-10" });
        assert!(views.len() > 1 && last.len() == 5, "{} views", views.len());
        let told = aside(last, roll).unwrap();
        assert!(told.abs() < 0.05, "{told} mm");
        let untold = aside(last, "0");
        assert_eq!(
            untold,
            Err(Some("a light section's seam does not lie on the grey image's"))
        );
    }
}
