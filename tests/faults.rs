//! Faults that come from outside, made to happen during the bead: each has a number, a defined reaction and a line that a person
//! understands. Those that come from within (limits, timing, buttons) are tested beside the safety machine.

use firmware::fault::Fault;
use sim_host::campaign::Company;
use sim_host::model::{AXES, Model};
use sim_host::node::Nodes;
use sim_host::seal::cell::Cell;
use sim_host::seal::scenario::{Options, PathName};
use sim_host::seal::score::TrialScore;
use sim_host::seal::trial;

/// Seals a straight seam and breaks something once the nozzle is past 0.2 m.
fn seal_and_break(mut upset: impl FnMut(&mut Cell)) -> TrialScore {
    let options = Options {
        path: PathName::Straight,
        ..Options::told()
    };
    let mut broken = false;
    let mut at_once = |_: u64, station: f64, cell: &mut Cell| {
        if station > 0.2 && !broken {
            broken = true;
            upset(cell);
        }
    };
    let company = Company {
        recording: None,
        progress: &|_| {},
        upset: &mut at_once,
    };
    trial::run(&options, &Model::k3s(), 3, company).expect("the trial runs")
}

/// Cycles of bead that a stop from 0.2 m on may leave: 0.2 m at 1.5 mm a cycle is 134, and a quick stop closes the dispenser
/// at once; an I/O node is silent for four cycles before it counts as lost.
const AT_ONCE: usize = 134 + 8;
/// The sensor has seen up to 80 mm ahead, and one interval of 30 mm more is sealed before the arm brakes.
const SEEN_AHEAD: usize = 134 + 80;

fn must_stop_with(fault: Fault, score: &TrialScore, cycles: usize) {
    let failure = score.run.failure.as_deref().unwrap_or("none");
    assert!(failure.starts_with(&format!("fault {} ", fault as u8)), "{failure}");
    assert!(failure.ends_with(fault.line()), "{failure}");
    let laid = score.lateral.len();
    assert!(laid < cycles, "the dispenser was on for {laid} cycles");
}

#[test]
fn an_open_estop_chain_stops_the_arm_and_is_latched() {
    must_stop_with(Fault::EStop, &seal_and_break(|cell| cell.estop_open = true), AT_ONCE);
}

#[test]
fn a_drive_that_falls_silent_stops_the_whole_arm() {
    must_stop_with(Fault::DriveSilent, &seal_and_break(|cell| cell.cut = Some(2)), AT_ONCE);
}

#[test]
fn a_drive_fault_stops_the_whole_arm() {
    let over_current = 0x2310;
    let score = seal_and_break(|cell| cell.nodes.drives[4].servo().fail(over_current));
    let failure = score.run.failure.as_deref().unwrap_or("none");
    // The emergency frame and the statusword race: whichever comes first names the fault.
    let either = [Fault::DriveFault, Fault::Emergency]
        .iter()
        .any(|fault| failure.ends_with(fault.line()));
    assert!(either, "{failure}");
}

#[test]
fn a_silent_io_node_stops_the_arm_because_the_estop_chain_cannot_be_seen() {
    must_stop_with(
        Fault::IoSilent,
        &seal_and_break(|cell| cell.cut = Some(Nodes::<AXES>::IO)),
        AT_ONCE,
    );
}

#[test]
fn a_silent_camera_stops_the_arm_along_the_path_before_the_bead_goes_blind() {
    must_stop_with(
        Fault::CameraSilent,
        &seal_and_break(|cell| cell.cut = Some(Nodes::<AXES>::CAMERA)),
        SEEN_AHEAD,
    );
}

#[test]
fn a_part_that_is_gone_is_not_sealed_from_memory() {
    must_stop_with(Fault::Blind, &seal_and_break(|cell| cell.part_gone = true), SEEN_AHEAD);
}
