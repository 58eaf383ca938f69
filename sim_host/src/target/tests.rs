//! In the loop with the image under QEMU: run by `cargo xtask target`, which builds the image.

use super::core::Core;
use super::emulator::{Emulator, SHIFT};
use super::image;
use super::net::Net;
use super::node::On;
use crate::camera::detection::expected_joint;
use crate::camera::scene::Scene;
use crate::camera::{Camera, effects::Effects};
use crate::campaign::Company;
use crate::cell::panel::{Joint, Side, Surface};
use crate::log::{Log, replay};
use crate::model::Model;
use crate::seal::campaign::{self, Campaign};
use crate::seal::scenario::{DriveMode, Options, PathName, SurfaceName};
use crate::seal::score::SealScore;
use crate::seal::trial;
use crate::teach;
use crate::teach::scenario::TeachOptions;
use firmware::cycle::Params;
use firmware::job::phase::Phase;
use firmware::vision::image::View;
use firmware::vision::net;
use hal::camera::ONE_SLIT;
use hal::stage::Stage;
use hal::wire::Wire;
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
            ..Options::told()
        };
        let host = seal(options, 3);
        let qemu = seal(
            Options {
                on: On::Qemu,
                ..options
            },
            3,
        );
        assert!(host.tally.cycles > 1000, "{} cycles", host.tally.cycles);
        assert_eq!(qemu.tally.log_hash, host.tally.log_hash);
        assert_eq!(qemu.lateral_max_mm, host.lateral_max_mm);
    }
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn two_arms_on_one_board_move_as_they_do_in_process_bit_for_bit() {
    // Every frame, input and output of all eleven axes is held against the core in process on the way; here what came of it.
    let run = |on: On| {
        let options = Options {
            on,
            path: PathName::Straight,
            second_arm: true,
            ..Options::told()
        };
        let company = Company {
            recording: None,
            progress: &|_| {},
            upset: &mut |_, _, _| {},
        };
        trial::run(&options, &Model::k3s(), 5, company).unwrap()
    };
    let (host, qemu) = (run(On::Host), run(On::Qemu));
    assert_eq!(qemu.verdict(0.3), None);
    assert_eq!(qemu.run.hash, host.run.hash);
    assert_eq!(qemu.second_max, host.second_max);
    assert!(
        qemu.second_max.is_some_and(|off| off > 0.0 && off < 0.5),
        "{:?} mm",
        qemu.second_max
    );
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_seam_taught_from_the_board_is_the_one_taught_in_process_bit_for_bit() {
    let [host, qemu] = [On::Host, On::Qemu].map(|on| {
        let mut options = TeachOptions::default();
        options.cell.path = PathName::Straight;
        options.cell.speed = 0.2;
        options.cell.on = on;
        let campaign = teach::campaign::Campaign {
            options,
            seed: 3,
            trials: 1,
        };
        teach::campaign::run(&campaign, &Model::k3s(), None).unwrap()
    });
    assert!(host.taught.is_some(), "{:?}", host.score);
    assert_eq!(qemu.score.tally.log_hash, host.score.tally.log_hash);
    assert_eq!(qemu.taught, host.taught);
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_disturbed_run_that_ends_in_a_stop_is_the_same_on_the_board() {
    // Every image is lost: the core stops the arm for want of a sighting.
    let options = Options {
        surface: SurfaceName::Harsh,
        frame_loss: 1.0,
        error_frames: 3,
        ..Options::told()
    };
    let host = seal(options, 1);
    assert!(
        host.tally.failures[0].reason.starts_with("fault 10"),
        "{:?}",
        host.tally.failures
    );
    let qemu = seal(
        Options {
            on: On::Qemu,
            ..options
        },
        1,
    );
    assert_eq!(qemu.tally.log_hash, host.tally.log_hash);
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn two_runs_on_the_board_take_the_same_instructions_and_every_tick_starts_on_time() {
    let options = Options {
        on: On::Qemu,
        path: PathName::Straight,
        ..Options::told()
    };
    let [first, second] = [(); 2].map(|()| seal(options, 2).tally.target.unwrap());
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
    assert_eq!(first.start_error_max_us, 0.0);
    // The same for every event, as the start errors say: what RTIC hands the task before its first line.
    assert!(first.latency_max_instructions <= 32, "{first:?}");
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

/// A log of a straight seam, as recorded in process.
fn logged(name: &str) -> Log {
    let folder = crate::whole_file::tests::folder(name);
    let options = Options {
        path: PathName::Straight,
        ..Options::told()
    };
    let campaign = Campaign {
        options,
        seed: 4,
        trials: 1,
    };
    campaign::run(&campaign, &Model::k3s(), Some(&folder)).unwrap();
    Log::read(&folder.join("run.tlog")).unwrap()
}

/// The middle one of the cycles along the seam, in which every stage runs.
fn along_the_seam(log: &Log) -> usize {
    let phases = log.cycles().map(|cycle| cycle.unwrap().1.outputs.phase);
    let follows: Vec<usize> = phases
        .enumerate()
        .filter_map(|(at, phase)| (phase == Phase::Follow as u8).then_some(at))
        .collect();
    follows[follows.len() / 2]
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_recorded_log_replays_on_the_target_bit_for_bit_stage_by_stage() {
    let log = logged("target-replays");
    let params = Params::read(&mut log.parameters.as_slice()).unwrap();
    let mut core = Core::new(On::Qemu, params).unwrap();
    let report = replay(&log, |inputs| core.step(inputs, None)).unwrap();
    assert_eq!(report.difference, None);
    assert_eq!(report.replayed_hash, log.hash);
    assert!(report.cycles > 500, "{} cycles", report.cycles);
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn the_last_bit_of_any_stage_on_the_target_is_found_and_the_stage_named() {
    let log = logged("target-flips");
    let params = Params::read(&mut log.parameters.as_slice()).unwrap();
    let at = along_the_seam(&log);
    for stage in Stage::ALL {
        let mut core = Core::new(On::Qemu, params.clone()).unwrap();
        let mut cycles = 0..;
        let flip = |cycle| (cycle == Some(at)).then_some(stage);
        let report = replay(&log, |inputs| core.step(inputs, flip(cycles.next()))).unwrap();
        let difference = report.difference.unwrap().to_string();
        let expected = format!("cycle {at}: first in stage {}", stage.name());
        assert!(difference.starts_with(&expected), "{difference}");
    }
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn the_net_on_the_target_sees_what_it_sees_in_process_a_window_in_less_than_20_000_instructions() {
    let mut target = Net::start().unwrap();
    let mut found = 0;
    for side in [Side::Left, Side::Right] {
        let joint = Joint::crank(side);
        let camera = Camera::new(Effects::of(Surface::Moderate), 1);
        for index in 0..10 {
            let image = Scene::draw(Surface::Moderate, joint, 1, index).image(&camera, index);
            let view = View::new(&image, ONE_SLIT[0].into(), ONE_SLIT[1].into()).unwrap();
            let answer = target.find(expected_joint(joint), &image).unwrap();
            assert_eq!(answer.seam, net::find(&view, expected_joint(joint)));
            let left = net::first_window(&view).unwrap();
            let first = net::CRANK.window(&view, left, 0, false);
            assert_eq!(answer.first, first.map(|(_, activity)| activity.output));
            assert!(answer.window <= 20_000, "{} instructions", answer.window);
            found += usize::from(answer.seam.is_some());
        }
    }
    assert!(found > 0, "no seam in 20 images");
}
