//! A second arm of five axes beside the sealing one, on the same bus and in the same cycle: both do their work, and a stop of one stops both.

use firmware::fault::Fault;
use hal::canopen::emcy::code;
use hal::cia402::PowerState;
use sim_host::campaign::Company;
use sim_host::model::Model;
use sim_host::seal::cell::Cell;
use sim_host::seal::scenario::{Options, PathName};
use sim_host::seal::score::TrialScore;
use sim_host::seal::trial;

/// Seals a straight seam with the second arm at work; `upset` is called at the beginning of each cycle, with the nozzle's station (m).
fn seal(path: PathName, mut upset: impl FnMut(f64, &mut Cell)) -> TrialScore {
    let options = Options {
        path,
        second_arm: true,
        ..Options::told()
    };
    let company = Company {
        recording: None,
        progress: &|_| {},
        upset: &mut |_, station, cell| upset(station, cell),
    };
    trial::run(&options, &Model::k3s(), 3, company).expect("the trial runs")
}

#[test]
fn while_a_panel_is_sealed_the_second_arm_goes_to_and_fro_within_half_a_millimetre() {
    let mut way = 0.0;
    let mut before = None;
    let score = seal(PathName::Panel, |_, cell| {
        let tip = cell
            .second
            .as_ref()
            .expect("it is there")
            .plant
            .T_b_n()
            .translation
            .vector;
        if let Some(before) = before.replace(tip) {
            way += (tip - before).norm();
        }
    });
    assert_eq!(score.verdict(0.3), None);
    let deviation = score.second_max.expect("there is a second arm");
    println!(
        "second arm: tip {deviation:.3} mm off at most on {way:.2} m; bus {:.1} %",
        score.run.bus_load
    );
    assert!(deviation < 0.5, "{deviation} mm");
    assert!(way > 1.0, "{way} m");
    assert!(score.run.bus_load < 70.0, "{} % of the bus", score.run.bus_load);
}

#[test]
fn a_fault_of_the_second_arm_stops_both() {
    let mut off = false;
    let score = seal(PathName::Straight, |station, cell| {
        if station > 0.2 {
            let second = cell.second.as_mut().expect("it is there");
            second.drives[3].servo().fail(code::OVER_CURRENT);
        }
        let Cell { nodes, second, .. } = cell;
        let mut all = nodes.drives.iter().chain(&second.as_ref().expect("it is there").drives);
        off = all.all(|drive| drive.state() != PowerState::OperationEnabled);
    });
    let failure = score.run.failure.expect("sealing was stopped");
    assert!(
        failure.starts_with(&format!("fault {} ", Fault::DriveFault as u8)),
        "{failure}"
    );
    assert!(failure.contains("place 9"), "the second arm's fourth axis: {failure}");
    assert!(off, "a drive was still enabled at the end");
    // 0.2 m at 1.5 mm a cycle are 134.
    assert!(
        score.lateral.len() < 134 + 8,
        "the dispenser was on for {} cycles",
        score.lateral.len()
    );
}
