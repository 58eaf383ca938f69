//! `look seam --slits 2`: the seam in images of the two-slit sensor, by each slit, and its pose.

use super::{Seen, view};
use crate::camera::optics::Optics;
use crate::cli::{Outcome, print_json};
use crate::image_file::GreyImage;
use firmware::vision::camera::Pinhole;
use firmware::vision::joint::Joint;
use firmware::vision::two_slit::TwoSlitSensor;
use firmware::vision::two_slit::pose::SeamPose;
use serde::Serialize;
use std::path::PathBuf;

/// What was seen in one file.
#[derive(Serialize)]
struct InFile {
    file: String,
    /// Both slits found the seam.
    found: bool,
    reason: Option<&'static str>,
    /// The nearer to the nozzle first.
    slits: [Seen; 2],
    pose: Option<Pose>,
}

/// Pose of the seam in the sensor's frame, Rot(x)·Rot(y)·Rot(z), with standard deviations.
#[derive(Serialize)]
struct Pose {
    d_y_mm: f32,
    d_z_mm: f32,
    theta_x_deg: f32,
    theta_y_deg: f32,
    theta_z_deg: f32,
    sigma_d_y_mm: f32,
    sigma_d_z_mm: f32,
    sigma_theta_x_deg: f32,
    sigma_theta_y_deg: f32,
    sigma_theta_z_deg: f32,
}

impl Pose {
    fn new(pose: &SeamPose) -> Self {
        let [d_y, d_z, x, y, z] = pose.value;
        let sigma = |at: usize| pose.covariance[(at, at)].sqrt();
        Self {
            d_y_mm: d_y * 1e3,
            d_z_mm: d_z * 1e3,
            theta_x_deg: x.to_degrees(),
            theta_y_deg: y.to_degrees(),
            theta_z_deg: z.to_degrees(),
            sigma_d_y_mm: sigma(0) * 1e3,
            sigma_d_z_mm: sigma(1) * 1e3,
            sigma_theta_x_deg: sigma(2).to_degrees(),
            sigma_theta_y_deg: sigma(3).to_degrees(),
            sigma_theta_z_deg: sigma(4).to_degrees(),
        }
    }
}

/// Looks for the seam of `joint` in `files`, with the slits behind `cameras`.
pub fn run(files: &[PathBuf], cameras: &[Pinhole; 2], joint: Joint) -> Outcome {
    let sensor = TwoSlitSensor::new(*cameras, joint);
    let mut all = Vec::new();
    for file in files {
        let image = GreyImage::read(file)?;
        let finds = sensor.find(&view(&image, file, &Optics::TWO_SLITS)?);
        let [near, ahead] = &finds;
        let slits = [Seen::local(near, &cameras[0]), Seen::local(ahead, &cameras[1])];
        let pose = match finds {
            [Ok(near), Ok(ahead)] => sensor.pose(&[near, ahead]),
            _ => None,
        };
        all.push(InFile {
            file: file.display().to_string(),
            found: pose.is_some(),
            reason: slits[0].reason.or(slits[1].reason),
            slits,
            pose: pose.as_ref().map(Pose::new),
        });
    }
    print_json(&all)?;
    Ok(all.iter().all(|seen| seen.found))
}
