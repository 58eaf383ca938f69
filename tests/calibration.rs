//! A sensor that is not as drawn: calibrated, it seals as well as one that is; and its lens, known, takes nothing from what it sees.

use firmware::vision::TwoSlitSensor;
use firmware::vision::image::View;
use firmware::vision::start::{Aim, StartSensor, Workspace};
use nalgebra::{Point3, Vector3};
use sim_host::calibration::camera::{Camera as Intrinsics, Distortion};
use sim_host::calibration::lens::Lens;
use sim_host::calibration::procedure;
use sim_host::calibration::sensor::SensorGeometry;
use sim_host::calibration::simulated;
use sim_host::camera::Camera;
use sim_host::camera::effects::Effects;
use sim_host::camera::optics::CAMERA_HEIGHT_M;
use sim_host::camera::scene::Scene;
use sim_host::camera::start::light::SpotLight;
use sim_host::camera::start::scene::{Misplacement, StartScene};
use sim_host::camera::start::{GreyView, SIDE};
use sim_host::cell::panel::{Joint, SHEET_M, Side, Surface};
use sim_host::model::Model;
use sim_host::seal::campaign::{self, Campaign};
use sim_host::seal::scenario::Options;
use sim_host::seal::score::SealScore;

/// The sensor of the cell of `seed` with so many slits as its calibration finds it.
fn calibrated(seed: u64, slits: u8) -> SensorGeometry {
    let (_, measured) = simulated::cell(seed, simulated::VIEWS).expect("measurements");
    let options = procedure::Options {
        distortion: Distortion::Brown,
        camera: None,
        arm: simulated::ARM,
    };
    let found = procedure::calibrate(&measured, &options).expect("a calibration");
    let [slit, near, far] = found.slits.map(|slit| slit.expect("a slit").plane);
    let pair = (slits == 2).then_some([near, far]);
    SensorGeometry::of(&found.camera, &found.hand_eye.expect("poses").t_5_c, &slit, pair)
}

fn seal(slits: u8, camera_seed: u64, calibration: Option<SensorGeometry>) -> SealScore {
    let campaign = Campaign {
        options: Options {
            slits,
            camera_seed: Some(camera_seed),
            calibration,
            ..Options::default()
        },
        seed: 9700,
        trials: 4,
    };
    campaign::run(&campaign, &Model::k3s(), None)
        .expect("the trials run")
        .score
}

#[test]
fn a_sensor_that_is_off_by_what_mounting_leaves_seals_only_when_it_is_calibrated() {
    for (slits, seed) in [(1, 1), (1, 2), (2, 1), (2, 2)] {
        let score = seal(slits, seed, Some(calibrated(seed, slits)));
        assert!(score.passed(), "{slits} slits: {score:#?}");
        let score = seal(slits, seed, None);
        assert_eq!(score.tally.succeeded, 0, "{slits} slits: {score:#?}");
    }
}

/// The sensor of a simulated cell, behind a lens that moves the start view's corner by 1.9 % of half its diagonal: twice what small lenses do.
fn through_a_strong_lens() -> SensorGeometry {
    let truth = simulated::truth(3);
    let camera = Intrinsics {
        distortion: [-0.3, 0.1, 0.001, -0.001, 0.0],
        ..truth.camera
    };
    SensorGeometry::of_truth(&simulated::Truth { camera, ..truth }, 2)
}

fn without_its_lens(sensor: &SensorGeometry) -> SensorGeometry {
    SensorGeometry {
        lens: Lens::NONE,
        ..*sensor
    }
}

/// Root mean square error of what a sensor that believes itself `known` sees of the seam through `built`, across and in height, m.
fn seam_rms(built: &SensorGeometry, known: &SensorGeometry) -> f64 {
    let optics = built.seam_optics();
    let camera = Camera::behind(optics, Effects::of(Surface::Clean), 5);
    let joint = Joint::crank(Side::Left);
    let sensor = TwoSlitSensor::new(known.pinholes(), joint.pattern());
    let (mut squares, mut count) = (0.0, 0.0);
    for index in 0..60 {
        let scene = Scene::draw_under(&optics, Surface::Clean, joint, 11, index);
        let image = scene.image(&camera, index);
        let view = View::new(&image, optics.width, optics.height).expect("an image");
        let truths = [Some(scene.truth), scene.ahead];
        for (sighting, truth) in sensor.sight(&view).iter().zip(truths) {
            if let (0, Some(truth)) = (sighting.refusal, truth) {
                let point = Vector3::from(sighting.point().map(f64::from));
                let (lateral, height) = scene.errors_from(&truth, &point);
                squares += lateral.powi(2) + height.powi(2);
                count += 1.0;
            }
        }
    }
    assert!(count > 100.0, "{count} of 120 seen");
    f64::sqrt(squares / count)
}

/// The same of the start's corner in grey images of parts up to 15 mm off, as far as its ray tells, m.
fn corner_rms(built: &SensorGeometry, known: &SensorGeometry) -> f64 {
    let misplaced = Misplacement {
        shift: 0.015,
        turn: 0.05,
        deform: 0.0,
    };
    let joint = Joint::crank(Side::Left);
    let sensor = StartSensor::new(known.start_optics().pinhole(0), joint.pattern(), Aim::ANYWHERE);
    let mut workspace = Box::new(Workspace::new());
    let (mut squares, mut count) = (0.0, 0.0);
    for index in 0..20 {
        let scene = StartScene::draw(Surface::Clean, joint, &misplaced, 11, index);
        let light = SpotLight::of(Surface::Clean);
        let image = GreyView::new(built.start_optics(), light, index).expose(0, &scene.panel, &scene.taught);
        let view = View::new(&image, SIDE, SIDE).expect("an image");
        let sighting = sensor.sight_grey(&view, &mut workspace);
        // What is seen is the edge, a sheet's thickness over the seam.
        let corner = scene.start * Point3::new(0.0, 0.0, SHEET_M);
        let corner = scene.taught.inverse_transform_point(&corner);
        let seen = corner.coords * (CAMERA_HEIGHT_M / (CAMERA_HEIGHT_M - corner.z));
        if sighting.refusal == 0 {
            let point = Vector3::from(sighting.point().map(f64::from));
            squares += (point - seen).xy().norm_squared();
            count += 1.0;
        }
    }
    assert!(count > 12.0, "{count} of 20 seen");
    f64::sqrt(squares / count)
}

#[test]
fn a_lens_that_the_camera_knows_takes_nothing_from_what_it_sees_and_one_that_it_does_not_know_does() {
    let built = through_a_strong_lens();
    let straight = without_its_lens(&built);
    for (what, rms) in [
        ("seam", seam_rms as fn(&SensorGeometry, &SensorGeometry) -> f64),
        ("corner", corner_rms),
    ] {
        let [none, known, unknown] = [(&straight, &straight), (&built, &built), (&built, &straight)]
            .map(|(built, known)| rms(built, known) * 1e6);
        println!(
            "{what}: {none:.1} µm without a lens, {known:.1} with one that is known, {unknown:.1} with one that is not"
        );
        assert!(known < 1.1 * none + 1.0, "{what}: {known} µm, without a lens {none}");
        let excess = (unknown.powi(2) - known.powi(2)).max(0.0).sqrt();
        assert!(excess > 20.0, "{what}: {unknown} µm unknown, {known} known");
    }
}
