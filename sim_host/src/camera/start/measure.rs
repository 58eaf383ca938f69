//! How well the start pose is measured, over seeded parts: the job's own measurement ([`Measure`]) on rendered images, with an arm that stands
//! exactly where it is sent, so that what is left is the sensor's and the method's.

use super::light::SpotLight;
use super::scene::{Misplacement, StartScene};
use super::{GreyView, SIDE};
use crate::camera::effects::Effects;
use crate::camera::optics::Optics;
use crate::camera::{Camera, Motion};
use crate::cell::panel::{Joint, Surface};
use crate::seal::setup::{as_drawn, isometry};
use firmware::fault::Fault;
use firmware::geometry::Pose;
use firmware::job::measure::{Measure, MeasureParams, Next};
use firmware::job::path::{TaughtPath, Travel};
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::start::{Aim, StartSensor, Workspace};
use hal::process::{Look, Sighting};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Cycles after which a measurement that neither ends nor fails is given up: six views of nine places, three tries of 60 cycles each.
const PATIENCE: u32 = 40_000;
/// SYNC count of every exposure; here none is ever late.
const STAMP: u8 = 1;

/// A measured start.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Error of the corner, in the true start frame, m.
    pub shift: Vector3<f64>,
    /// Error of the attitude, in the true start frame, rotation vector, rad.
    pub turn: Vector3<f64>,
    /// The same against the rigid part of the displacement, without the part's deformation and waviness, rad.
    pub rigid_turn: Vector3<f64>,
    /// Images taken.
    pub images: u32,
}

/// Measures part `index` of `seed`.
pub fn measure(
    surface: Surface,
    joint: Joint,
    misplaced: &Misplacement,
    seed: u64,
    index: u64,
    workspace: &mut Workspace,
) -> Result<Measured, Fault> {
    let scene = StartScene::draw(surface, joint, misplaced, seed, index);
    let own = seed.wrapping_mul(1_000_003) ^ index;
    let grey = GreyView::new(Optics::START, SpotLight::of(surface), own);
    let slit = Camera::behind(Optics::START, Effects::of(surface), own);
    let sensor = StartSensor::new(Pinhole::START, joint.pattern(), Aim::MIDDLE);
    let params = MeasureParams {
        start: true,
        edge_height: joint.pattern().edge_height(),
        bend: joint.pattern().is_bend(),
        sections: 0,
    };
    let mount = as_drawn(Pose {
        r: Matrix3::identity(),
        p: Vector3::new(0.080, 0.0, 0.0),
    });
    let path = taught_path(&scene.taught);
    let mut job = Measure::EMPTY;
    let (mut to_part, mut t_b_n) = (Pose::identity(), Pose::identity());
    let mut images = 0;
    for _ in 0..PATIENCE {
        match job.next(&params, &path, &mount, &mut to_part)? {
            Next::Go(pose) => t_b_n = pose,
            Next::Wait => {}
            Next::Done => break,
        }
        if job.exposure(STAMP) == 0 {
            continue;
        }
        images += 1;
        let t_b_s = isometry(&(t_b_n * mount.pose));
        let look = job.look();
        let image = match look {
            Look::StartGrey => grey.expose(images, &scene.panel, &t_b_s),
            _ => slit.expose(images, Some(&scene.panel), &t_b_s, &Motion::default()),
        };
        let Ok(view) = View::new(&image, SIDE, SIDE) else {
            return Err(Fault::StartDoubtful);
        };
        let seen = match look {
            Look::StartGrey => sensor.sight_grey(&view, workspace),
            _ => sensor.sight_slit(&view),
        };
        let sighting = Sighting { stamp: STAMP, ..seen };
        job.take(&params, &path, &mount, &mut to_part, &sighting, &t_b_n);
    }
    let start = job.start().ok_or(Fault::StartDoubtful)?;
    let found = isometry(&start.pose);
    let turn = |truth: &Isometry3<f64>| (truth.rotation.inverse() * found.rotation).scaled_axis();
    let corner = Point3::from(found.translation.vector);
    Ok(Measured {
        shift: scene.start.inverse_transform_point(&corner).coords,
        turn: turn(&scene.start),
        rigid_turn: turn(&scene.rigid),
        images: images as u32,
    })
}

/// A straight path from the taught start.
fn taught_path(taught: &Isometry3<f64>) -> TaughtPath {
    let travel = Travel {
        speed: 0.3,
        acceleration: 2.0,
        centripetal: 3.0,
        turn_rate: 3.0,
        lead: 0.080,
    };
    let single = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
    let along = single(taught * Vector3::x());
    let up = single(taught * Vector3::z());
    let seam = |s: f32| (single((taught * Point3::new(f64::from(s), 0.0, 0.0)).coords), along, up);
    TaughtPath::new(0.5, &travel, seam)
        .unwrap_or_else(|_| unreachable!("half a metre is neither too short nor too long"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::panel::Side;

    const MISPLACED: Misplacement = Misplacement {
        shift: 0.020,
        turn: 5.0 * std::f64::consts::PI / 180.0,
        deform: 0.0,
    };

    #[test]
    fn parts_20_mm_and_5_degrees_off_are_measured_to_a_seventh_of_a_millimetre_and_a_third_of_a_degree() {
        let mut workspace = Box::new(Workspace::new());
        let joint = Joint::crank(Side::Left);
        for index in 0..24 {
            let found = measure(Surface::Moderate, joint, &MISPLACED, 11, index, &mut workspace).unwrap();
            let (shift, turn) = (found.shift.norm(), found.turn.norm().to_degrees());
            assert!(shift <= 0.15e-3 && turn <= 0.3, "part {index}: {shift} m, {turn}°");
        }
    }

    #[test]
    fn a_part_that_is_nowhere_is_not_found() {
        let far = Misplacement {
            shift: 0.5,
            ..MISPLACED
        };
        let mut workspace = Box::new(Workspace::new());
        let lost = measure(Surface::Moderate, Joint::crank(Side::Left), &far, 11, 0, &mut workspace);
        assert_eq!(lost.unwrap_err(), Fault::StartNotFound);
    }
}
