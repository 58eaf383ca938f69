//! What the comparison between the board and the core in process finds. Needs the image: `cargo xtask target`.

use super::*;
use crate::model::Model;
use crate::seal::cell::Cell;
use crate::seal::cell::TICKS;
use crate::seal::scenario::Options;
use crate::seal::setup::Setup;
use crate::target::image;
use crate::target::node::{Node, On};
use anyhow::anyhow;
use firmware::fault::Fault;
use firmware::safety::State as SafetyState;

/// Runs `cycles` without any other node on the bus; the core in process is given what `change` makes of the parameters.
fn run(cycles: u32, change: impl FnOnce(&mut MasterConfig<AXES>)) -> anyhow::Result<()> {
    let setup = Setup::new(&Options::told(), &Model::named("k3s")?, 1)?;
    let mut controller = TargetController::new(&image::find("controller")?, &setup.master, setup.params.clone(), ())?;
    let mut other = setup.master;
    change(&mut other);
    controller.mirror = Controller::new(&other, &setup.params).map_err(|error| anyhow!("{}", error.field))?;
    for _ in 0..cycles {
        controller.sync(&mut |_| {})?;
        controller.cycle(&mut |_| {})?;
    }
    Ok(())
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_controller_alone_on_the_bus_sends_the_same_frames_on_both() {
    run(400, |_| {}).unwrap();
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn one_frame_that_differs_is_found_in_its_cycle() {
    // The master's heartbeat is due one cycle later in process.
    let error = run(400, |master| master.master_heartbeat_cycles += 1)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("cycle 6: frames differ"), "{error}");
}

/// Seals in lock step; the board is stalled for 1 ms in these cycles after it began to run. Overruns told to the core, and where it stands
/// 100 cycles after the last stall.
fn sealed_with_stalls(stalls: &[u32]) -> (u32, SafetyState, Fault) {
    let (options, model) = (Options::told(), Model::named("k3s").unwrap());
    let setup = Setup::new(&options, &model, 1).unwrap();
    let mut node = Node::new(On::Qemu, &setup.master, setup.params.clone()).unwrap();
    let mut cell = Cell::new(&options, &model, &setup, 1);
    let (mut running, mut overruns) = (0, 0);
    while running < stalls.iter().max().unwrap() + 100 {
        cell.press(node.state().safety());
        cell.start_cycle(0);
        node.sync(&mut |frame| cell.send(frame)).unwrap();
        for tick in 1..=TICKS {
            cell.run_tick(&mut node, &mut |_| {});
            if tick == TICKS / 2 {
                if stalls.contains(&running) {
                    node.stall();
                }
                let (inputs, _) = node.cycle(&mut |frame| cell.send(frame)).unwrap();
                overruns += u32::from(inputs.overruns);
                running += u32::from(running > 0 || node.state().safety() == SafetyState::Running);
            }
        }
    }
    (overruns, node.state().safety(), node.state().trip().fault)
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn two_late_cycles_in_a_second_are_counted_and_three_stop_the_arm() {
    assert_eq!(sealed_with_stalls(&[100, 150]), (2, SafetyState::Running, Fault::None));
    let (overruns, state, fault) = sealed_with_stalls(&[100, 150, 200]);
    assert_eq!((overruns, fault), (3, Fault::Overrun));
    assert!(
        matches!(state, SafetyState::Stopped | SafetyState::Faulted),
        "{state:?}"
    );
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn however_many_ticks_a_stall_swallows_sync_and_cycle_keep_their_times() {
    let setup = Setup::new(&Options::told(), &Model::named("k3s").unwrap(), 1).unwrap();
    let mut parameters = bytes_of(&setup.master);
    parameters.extend(bytes_of(&setup.params));
    let mut board = Emulator::start(&image::find("controller").unwrap(), &parameters, SHIFT).unwrap();
    let (mut first, mut late_or_missed) = (None, 0);
    for event in 0..100 {
        let message = board.message().unwrap();
        let timing = Timing::read(&mut message.trace.as_slice()).unwrap();
        let zero = timing.start.wrapping_sub(timing.latency);
        let since = zero.wrapping_sub(*first.get_or_insert(zero));
        let half = 25 * HALF_US;
        let events = (since + half / 2) / half;
        assert_eq!(
            timing.event == Event::Sync,
            events.is_multiple_of(2),
            "after {events} ticks"
        );
        late_or_missed += u32::from(timing.overruns);
        // 0.5, 1.0, … 10 ms, each followed by four events in peace.
        let stall = if event % 5 == 0 { event / 5 + 1 } else { 0 };
        board.answer(&[], stall << ask::STALL_SHIFT).unwrap();
    }
    assert!(late_or_missed > 20, "{late_or_missed}");
}
