//! How often and how well the start sensor finds the corner in grey images of seeded parts.

use super::light::SpotLight;
use super::scene::{Misplacement, StartScene};
use super::{GreyView, SIDE};
use crate::camera::optics::Optics;
use crate::cell::panel::{Joint, SHEET_M, Surface};
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::start::{Aim, GreyRefusal, StartSensor, Workspace};
use nalgebra::{Point3, Vector3};

/// What became of one image.
#[derive(Clone, Copy, Debug)]
pub struct GreyFind {
    /// Error of the corner, px right and down.
    pub off_px: [f64; 2],
    /// Error of the seam's direction, rad.
    pub turn: f64,
    /// What the sensor said of the corner's standard deviation, px.
    pub sigma_px: f64,
}

/// Looks at part `index` of `seed` from where it was taught.
pub fn look(
    surface: Surface,
    joint: Joint,
    misplaced: &Misplacement,
    seed: u64,
    index: u64,
    workspace: &mut Workspace,
) -> Result<GreyFind, GreyRefusal> {
    let scene = StartScene::draw(surface, joint, misplaced, seed, index);
    let image = GreyView::new(
        Optics::START,
        SpotLight::of(surface),
        seed.wrapping_mul(1_000_003) ^ index,
    )
    .expose(0, &scene.panel, &scene.taught);
    let Ok(view) = View::new(&image, SIDE, SIDE) else {
        return Err(GreyRefusal::NoSeam);
    };
    let corner = StartSensor::new(Pinhole::START, joint.pattern(), Aim::ANYWHERE).corner(&view, workspace)?;
    // The edge that is seen stands a sheet's thickness over the seam.
    let lift = match joint {
        Joint::Crank { .. } => SHEET_M,
        _ => 0.0,
    };
    let pixel = |along: f64| {
        let point = scene.start * Point3::from(Vector3::new(along, 0.0, lift));
        Optics::START.project(&scene.taught.inverse_transform_point(&point).coords)
    };
    let (true_at, ahead) = (pixel(0.0), pixel(0.020));
    let off_px = [f64::from(corner.x) - true_at.0, f64::from(corner.y) - true_at.1];
    Ok(GreyFind {
        off_px,
        turn: f64::from(corner.slope).atan() - ((ahead.1 - true_at.1) / (ahead.0 - true_at.0)).atan(),
        sigma_px: f64::from(corner.sigma),
    })
}
