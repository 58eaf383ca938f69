//! Every fault has a number, a defined reaction and a line that a person understands; here each is made to happen during the bead.

use firmware::fault::Fault;
use sim_host::model::{AXES, Model};
use sim_host::node::Nodes;
use sim_host::seal::cell::Cell;
use sim_host::seal::scenario::{Options, PathName};
use sim_host::seal::score::TrialScore;
use sim_host::seal::trial::{self, Company};

/// Seals a straight seam and breaks something once the nozzle is past 0.2 m.
fn seal_and_break(mut upset: impl FnMut(&mut Cell)) -> TrialScore {
    let options = Options {
        path: PathName::Straight,
        ..Options::default()
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

fn must_stop_with(fault: Fault, score: &TrialScore) {
    let failure = score.failure.as_deref().unwrap_or("none");
    assert!(failure.starts_with(&format!("fault {} ", fault as u8)), "{failure}");
    assert!(failure.ends_with(fault.line()), "{failure}");
    // 0.2 m of bead at 1.5 mm a cycle, and not much more.
    assert!(
        score.lateral.len() < 200,
        "the dispenser went on for {} cycles",
        score.lateral.len()
    );
}

#[test]
fn an_open_estop_chain_stops_the_arm_and_is_latched() {
    must_stop_with(Fault::EStop, &seal_and_break(|cell| cell.estop_open = true));
}

#[test]
fn a_drive_that_falls_silent_stops_the_whole_arm() {
    must_stop_with(Fault::DriveSilent, &seal_and_break(|cell| cell.cut = Some(2)));
}

#[test]
fn a_drive_fault_stops_the_whole_arm() {
    let over_current = 0x2310;
    let score = seal_and_break(|cell| cell.nodes.drives[4].servo().fail(over_current));
    let failure = score.failure.as_deref().unwrap_or("none");
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
    );
}

#[test]
fn a_silent_camera_stops_the_arm_along_the_path_before_the_bead_goes_blind() {
    must_stop_with(
        Fault::CameraSilent,
        &seal_and_break(|cell| cell.cut = Some(Nodes::<AXES>::CAMERA)),
    );
}

#[test]
fn a_part_that_is_gone_is_not_sealed_from_memory() {
    must_stop_with(Fault::Blind, &seal_and_break(|cell| cell.part_gone = true));
}
