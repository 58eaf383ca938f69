//! The camera's image in the cell's loop. Needs the images: `cargo xtask target`.

use super::*;
use crate::model::Model;
use crate::seal::campaign::{self, Campaign};
use crate::seal::scenario::{Options, PathName, SurfaceName};
use crate::seal::score::SealScore;
use crate::target::image;
use crate::target::node::On;
use firmware::camera::Timing;
use firmware::vision::camera::Pinhole;
use firmware::vision::joint::Joint;
use hal::canopen::cob;

fn seal(options: Options) -> SealScore {
    let campaign = Campaign {
        options,
        seed: 5,
        trials: 1,
    };
    campaign::run(&campaign, &Model::k3s(), None).unwrap().score
}

fn params() -> Params {
    Params {
        node: 32,
        timing: Timing {
            latency_cycles: 4,
            grey_latency_cycles: 20,
            vision_cycles: 2,
            retries: 1,
        },
        slits: 1,
        pinholes: [Pinhole::TRACKING; 2],
        start: Pinhole::START,
        joint: Joint::Vee { flank: 0.5 },
    }
}

fn camera(params: &Params) -> TargetCamera {
    TargetCamera::start(&image::find("camera").unwrap(), params).unwrap()
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn lost_images_retakes_and_every_latency_give_the_same_run_on_the_board() {
    for (slits, vision_latency, retakes) in [(1, 4, 0), (1, 5, 1), (2, 10, 3)] {
        let options = Options {
            slits,
            path: PathName::Straight,
            surface: SurfaceName::Harsh,
            frame_loss: 0.3,
            vision_latency,
            retakes,
            ..Options::told()
        };
        let (host, qemu) = (
            seal(options),
            seal(Options {
                on: On::Qemu,
                ..options
            }),
        );
        assert_eq!(
            qemu.tally.log_hash, host.tally.log_hash,
            "{slits} slits, latency {vision_latency}, {retakes} retakes"
        );
        assert!(qemu.camera.unwrap().images > 5);
    }
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn two_runs_take_the_same_instructions_for_every_image() {
    let options = Options {
        on: On::Qemu,
        path: PathName::Straight,
        ..Options::told()
    };
    let [first, second] = [(); 2].map(|()| seal(options).camera.unwrap());
    assert_eq!(first, second);
    // What is left of the default latency, 20 ms, after 10 ms of read-out.
    assert!(first.vision_max_instructions < 10_000_000 >> SHIFT, "{first:?}");
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_latency_that_is_too_short_for_the_boards_vision_is_told_as_that() {
    // After the read-out 15 ms are left, 7.5 million instructions; a grey view takes 90.
    let campaign = Campaign {
        options: Options {
            on: On::Qemu,
            path: PathName::Straight,
            grey_latency: 5,
            ..Options::default()
        },
        seed: 5,
        trials: 1,
    };
    let error = campaign::run(&campaign, &Model::k3s(), None).err().unwrap();
    assert!(format!("{error:#}").contains("the board's vision is late"), "{error:#}");
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_node_that_answers_otherwise_is_found_at_its_frame() {
    let mut board = camera(&params());
    board.mirror = CameraNode::new(33, params().timing);
    let error = board.power_on(&mut |_| {}).unwrap_err().to_string();
    assert!(error.starts_with("camera, cycle 1: frames differ"), "{error}");
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn only_frames_that_are_for_the_node_stop_the_board() {
    let mut board = camera(&params());
    let mut boot = Vec::new();
    board.power_on(&mut |frame| boot.push(frame)).unwrap();
    assert_eq!(boot, [Frame::of(cob::heartbeat(32), [0])]);
    board
        .receive(&Frame::of(cob::tpdo(1, 1), [0; 8]), 60_000, &mut |_| {})
        .unwrap();
    let upload = Frame::of(cob::sdo_request(32), [0x40, 0x18, 0x10, 2, 0, 0, 0, 0]);
    let mut answer = Vec::new();
    board
        .receive(&upload, 120_000, &mut |frame| answer.push(frame))
        .unwrap();
    assert_eq!(
        answer,
        [Frame::of(cob::sdo_response(32), [0x43, 0x18, 0x10, 2, 2, 0, 0, 0])],
        "its product code"
    );
    board.elapse(&mut |_| {}).unwrap();
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_board_without_sound_parameters_says_so() {
    let error = TargetCamera::start(&image::find("controller").unwrap(), &params())
        .err()
        .unwrap();
    assert!(format!("{error:#}").contains("parameters refused"), "{error:#}");
}
