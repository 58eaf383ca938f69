//! A sensor that is not as drawn: calibrated, it seals as well as one that is.

use sim_host::calibration::camera::Distortion;
use sim_host::calibration::procedure;
use sim_host::calibration::sensor::SensorGeometry;
use sim_host::calibration::simulated;
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
