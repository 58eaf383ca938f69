//! In the loop with the image under QEMU: run by `cargo xtask target`, which builds the image.

use super::emulator::{Emulator, SHIFT};
use super::image;
use super::node::On;
use crate::model::Model;
use crate::seal::campaign::{self, Campaign};
use crate::seal::scenario::{DriveMode, Options, PathName, SurfaceName};
use crate::seal::score::SealScore;
use std::path::Path;

fn seal(options: Options, seed: u64) -> SealScore {
    let campaign = Campaign {
        options,
        seed,
        trials: 1,
    };
    campaign::run(&campaign, &Model::named("k3s").unwrap(), None)
        .unwrap()
        .score
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_panel_sealed_from_the_board_is_the_one_sealed_in_process_bit_for_bit() {
    for mode in [DriveMode::Csv, DriveMode::Cst] {
        let options = Options {
            mode,
            path: PathName::Panel,
            ..Options::default()
        };
        let host = seal(options, 3);
        let qemu = seal(
            Options {
                on: On::Qemu,
                ..options
            },
            3,
        );
        assert!(host.cycles > 1000, "{} cycles", host.cycles);
        assert_eq!(qemu.log_hash, host.log_hash);
        assert_eq!(qemu.lateral_max_mm, host.lateral_max_mm);
    }
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_disturbed_run_that_ends_in_a_stop_is_the_same_on_the_board() {
    // Every image is lost: the core stops the arm for want of a sighting.
    let options = Options {
        surface: SurfaceName::Harsh,
        frame_loss: 1.0,
        error_frames: 3,
        ..Options::default()
    };
    let host = seal(options, 1);
    assert!(host.failures[0].reason.starts_with("fault 10"), "{:?}", host.failures);
    let qemu = seal(
        Options {
            on: On::Qemu,
            ..options
        },
        1,
    );
    assert_eq!(qemu.log_hash, host.log_hash);
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn two_runs_on_the_board_take_the_same_instructions_and_every_tick_starts_on_time() {
    let options = Options {
        on: On::Qemu,
        path: PathName::Straight,
        ..Options::default()
    };
    let [first, second] = [(); 2].map(|()| seal(options, 2).target.unwrap());
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
    assert_eq!(first.start_error_max_us, 0.0);
    assert!(first.latency_max_instructions <= 20, "{first:?}");
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_board_without_sound_parameters_sends_nothing_and_says_so() {
    let image = image::find("controller").unwrap();
    let mut emulator = Emulator::start(&image, b"no parameters", SHIFT).unwrap();
    let error = emulator.message().unwrap_err().to_string();
    assert_eq!(
        error,
        "the image stopped itself after 0 timer events: parameters refused, or a panic"
    );
}

#[test]
fn a_missing_image_is_named_with_the_way_to_make_it() {
    let error = Emulator::start(Path::new("/nowhere/controller"), &[], SHIFT)
        .err()
        .unwrap()
        .to_string();
    assert_eq!(
        error,
        "image /nowhere/controller: no such file; `cargo xtask build` makes it"
    );
}
